"""Regularize a folder of hexahedral meshes with defaults, and say what became of each; beside peers, if asked.

    python benchmarks/folder.py MESHES                                    # prints the table
    python benchmarks/folder.py MESHES --boundary fixed --peers PYTHON -o results/fixed
    python benchmarks/folder.py MESHES --reference PUBLISHED --match -o results/matched

Takes every mesh of hexahedra, or, where some are called ``<name>_input.*``, those; others are told. ``--reference``
holds results of others, ``<name>_published.*`` or ``<name>.*``, with the same cells; ``--match`` lets the surface move
as far as theirs did, at least 0.005. ``--peers`` names the Python with mfem, gmsh and vtk (see peers.py).

Each run is a process of its own with a limit on CPU seconds. All results are measured in the same way, by this program:

inverted   cells with a non-positive scaled Jacobian at a corner
invalid    cells not proved to have det J > 0 everywhere (Bernstein coefficients, bisected)
min, mean  over the cells, of the smallest corner scaled Jacobian
H          symmetric Hausdorff distance of the boundary to the input's / diagonal of the bounding box
d          mean distance of the two, both ways, in 1e-4 diagonals
shape, ER  smallest corner mean ratio and largest edge ratio of a cell
sharp      length of the edges of the boundary over 45 degrees over that in the input
volume     relative change
cells      smallest and largest volume of a cell over that in the input, of cells that are valid there
CPU        seconds of all threads: of the whole process, and (ours) of the work alone, without starting Python and
           loading the compiled kernels, which a tiny mesh has done before
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import resource
import sys
import tempfile
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from machine import described, run
from numpy.typing import NDArray
from peers import PEERS, available

import hexconformal as hc
from hexconformal.geometry import SurfaceLocator, hausdorff, mean_distance, sharp_length
from hexconformal.io import READ_EXTENSIONS
from hexconformal.mesh.topology import boundary_quads

LEAST = 0.005  # share of the diagonal that a matched surface may move in any case


@dataclass(frozen=True)
class Row:
    """One line of the table; the figures are None where nothing came out."""

    mesh: str
    cells: int
    method: str
    inverted: int | None = None
    invalid: int | None = None
    min: float | None = None
    mean: float | None = None
    hausdorff: float | None = None
    distance: float | None = None
    shape: float | None = None
    edge_ratio: float | None = None
    sharp: float | None = None
    volume: float | None = None
    smallest: float | None = None
    largest: float | None = None
    cpu: float | None = None
    work: float | None = None
    note: str = ""


class Scorer:
    """Measures positions of one mesh against its input."""

    def __init__(self, name: str, mesh: hc.HexMesh) -> None:
        self.name, self.mesh = name, mesh
        self.quads = boundary_quads(mesh.cells)[0]
        self._diagonal = float(np.linalg.norm(np.ptp(mesh.points[np.unique(mesh.cells)], axis=0)))
        before = hc.quality(mesh)
        self._volumes, self._valid = before.volume, before.valid
        self._sharp = sharp_length(mesh.points, self.quads)

    def moved_by(self, points: NDArray[np.float64]) -> float:
        return hausdorff(points, self.mesh.points, self.quads) / self._diagonal

    def drifted_by(self, points: NDArray[np.float64]) -> float:
        one, other = (SurfaceLocator(x, self.quads) for x in (points, self.mesh.points))
        return mean_distance(one, other, near=True) / self._diagonal

    def row(self, method: str, points: NDArray[np.float64], **more: Any) -> Row:
        quality = hc.quality((points, self.mesh.cells))
        summary = quality.summary()
        ratios = quality.volume[self._valid] / self._volumes[self._valid]
        return Row(
            self.name,
            summary.count,
            method,
            summary.inverted,
            summary.invalid,
            summary.scaled_jacobian.min,
            summary.scaled_jacobian.mean,
            self.moved_by(points),
            self.drifted_by(points),
            summary.shape.min,
            summary.edge_ratio.max,
            sharp_length(points, self.quads) / self._sharp if self._sharp else None,
            summary.total_volume / self._volumes.sum() - 1.0,
            ratios.min(initial=np.inf),
            ratios.max(initial=0.0),
            **more,
        )


def regularized(source: str, target: str, options: dict[str, Any]) -> None:
    """The process of one run: a tiny mesh first, then the mesh; prints CPU seconds and why it stopped."""
    mesh = hc.read(source)
    # Tangled, with a curved boundary: what a mesh may need is loaded.
    tiny = hc.generate.jittered(*hc.generate.ball(2, 2), amount=0.9, keep_boundary=False, valid=False)
    hc.regularize(tiny, **options)
    began = time.process_time()
    result = hc.regularize(mesh, **options)
    work = time.process_time() - began
    np.save(target, result.points)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e9
    print(json.dumps({"work": work, "reason": result.report.reason, "peak": peak}))


def ours(scorer: Scorer, source: Path, options: dict[str, Any], limit: float) -> Row:
    """Our result, from a process of its own."""
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / "points.npy"
        ended = run([sys.executable, __file__, str(source), "--one", str(target), json.dumps(options)], limit)
        if ended.code != 0 or not target.exists():
            why = "over time" if ended.code is None else ended.output.strip().splitlines()[-1]
            return Row(scorer.name, len(scorer.mesh.cells), "hexconformal", cpu=ended.cpu, note=why)
        said = json.loads(ended.output.strip().splitlines()[-1])
        return scorer.row("hexconformal", np.load(target), cpu=ended.cpu, work=said["work"], note=said["reason"])


def meshes(folder: Path) -> list[tuple[str, Path]]:
    """Names and files of the meshes of a folder."""
    files = sorted(p for p in folder.iterdir() if p.suffix.lower() in READ_EXTENSIONS)
    inputs = [p for p in files if p.stem.endswith("_input")]
    return [(p.stem.removesuffix("_input"), p) for p in inputs or files]


def published(folder: Path | None, name: str, mesh: hc.HexMesh) -> NDArray[np.float64] | None:
    """Points of somebody else's result for a mesh, if there is one with the same cells."""
    for stem in (f"{name}_published", name) if folder else ():
        for path in sorted(folder.glob(f"{stem}.*")):
            other = hc.read(path)
            if other.cells.shape == mesh.cells.shape and (other.cells == mesh.cells).all():
                return other.points
    return None


def rows_of(name: str, source: Path, asked: argparse.Namespace, peers: dict[str, str]) -> list[Row]:
    """Input, somebody else's result, ours, and the peers'."""
    mesh = hc.read(source)
    scorer = Scorer(name, mesh)
    rows = [scorer.row("input", mesh.points)]
    options: dict[str, Any] = {"boundary": asked.boundary}
    other = published(asked.reference, name, mesh)
    if other is not None:
        rows.append(scorer.row("published", other))
        if asked.match:
            options["hausdorff"] = max(LEAST, scorer.moved_by(other))
    rows.append(ours(scorer, source, options, asked.limit))
    for method, runner in peers.items():
        answer = PEERS[method](runner, mesh.points, {"hexahedron": mesh.cells}, {"quad": scorer.quads}, asked.limit)
        if answer.points is None:
            rows.append(Row(name, len(mesh.cells), method, cpu=answer.cpu, note=answer.note))
        else:
            rows.append(scorer.row(method, answer.points, cpu=answer.cpu, note=answer.note))
    return rows


def table(rows: list[Row]) -> list[str]:
    """The rows in markdown."""
    titles = ["mesh", "method", "inverted / invalid", "min / mean SJ", "H", "d", "shape", "ER", "sharp"]
    titles += ["volume", "cells"]
    lines = [f"| {' | '.join(titles)} | CPU s, whole / work | note |"]
    lines.append("|---|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|---|")
    before = ""
    for row in rows:
        name = "" if row.mesh == before else f"{row.mesh} ({row.cells})"
        before = row.mesh
        figures = [""] * 9
        if row.min is not None:
            figures = [f"{row.inverted} / {row.invalid}", f"{row.min:.3f} / {row.mean:.3f}"]
            figures += [f"{row.hausdorff:.4f}", f"{1e4 * (row.distance or 0.0):.1f}", f"{row.shape:.3f}"]
            figures += [f"{row.edge_ratio:.3g}", "" if row.sharp is None else f"{row.sharp:.2f}"]
            figures += [f"{row.volume:+.4f}", f"{row.smallest:.2g} .. {row.largest:.2g}"]
        seconds = "" if row.cpu is None else f"{row.cpu:.1f}"
        seconds += "" if row.work is None else f" / {row.work:.1f}"
        lines.append(f"| {name} | {row.method} | {' | '.join(figures)} | {seconds} | {row.note} |")
    return lines


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--boundary", choices=("slide", "fixed"), default="slide")
    parser.add_argument("--reference", type=Path, help="folder of somebody else's results")
    parser.add_argument("--match", action="store_true", help="move the surface as far as the reference did")
    parser.add_argument("--peers", nargs="?", const=sys.executable, help="interpreter that has mfem, gmsh, vtk")
    parser.add_argument("--limit", type=float, default=300.0, help="CPU seconds of a run")
    parser.add_argument("--only", nargs="+", help="names of meshes")
    parser.add_argument("-o", "--output", type=Path, help="write OUTPUT.md and OUTPUT.csv besides")
    parser.add_argument("--one", nargs=2, help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.one:
        regularized(str(asked.folder), asked.one[0], json.loads(asked.one[1]))
        return
    load = os.getloadavg()
    peers, notes = available(asked.peers) if asked.peers else ({}, [])
    rows: list[Row] = []
    for name, source in meshes(asked.folder):
        if not asked.only or name in asked.only:
            try:
                rows += rows_of(name, source, asked, peers)
            except hc.MeshError as problem:
                notes.append(f"Left out: {problem}")
                print(notes[-1], flush=True)
                continue
            print(*table(rows)[-1 - len(peers) :], sep="\n", flush=True)
    surface = "hausdorff = max(published, 0.005)" if asked.match else "defaults"
    head = [f"boundary = {asked.boundary!r}, otherwise {surface}. {described(load)}", *notes]
    text = "\n\n".join([*head, "\n".join(table(rows))]) + "\n"
    if not asked.output:
        print(text)
        return
    asked.output.parent.mkdir(parents=True, exist_ok=True)
    asked.output.with_suffix(".md").write_text(text)
    with asked.output.with_suffix(".csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, list(asdict(rows[0])))
        writer.writeheader()
        writer.writerows(asdict(row) for row in rows)


if __name__ == "__main__":
    main()
