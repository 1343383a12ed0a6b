"""Other cells than linear hexahedra beside other tools, in one run: quadratic hexahedra, and linear cells of all types.

    python benchmarks/other_cells.py --peers PYTHON -o benchmarks/other_cells.md
    python benchmarks/other_cells.py --meshes FOLDER FOLDER --only sphere --peers PYTHON

The boundary stays in all runs, which every tool can do. Meshes of our own are made here; those of a folder are taken
that have quadratic hexahedra alone, or linear cells of several types. ``--peers`` names the Python in which mfem, gmsh
and vtk are installed (quadratic_peers.py and peers.py say how they are run). Each run is a process of its own with a
limit on CPU seconds, and all results are measured by this program:

invalid        cells not proved to have det J > 0 everywhere: of quadratic ones by the 216 Bernstein coefficients
SJ             smallest scaled Jacobian, and the mean of the cells' smallest; of quadratic ones at 9^3 places
detmin/detmax  smallest of a cell, of det J at the same places
CPU            seconds of the whole process, with its start; behind them, of ours, those of the work alone
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from curved_meshes import CURVED, perturbed
from machine import described, run
from numpy.typing import NDArray
from peers import PEERS, Answer, available
from quadratic_peers import QUADRATIC_PEERS, quality_of

import hexconformal as hc
from hexconformal.elements import QUADRATIC_TYPES, SOLID_TYPES, quadratic_shape_gradients
from hexconformal.io import READ_EXTENSIONS
from hexconformal.mesh import MixedMesh, boundary_quads, collapsed_mesh, with_wedges_upright

sys.path.append(str(Path(__file__).parents[1] / "tests"))
from meshes.mixed import mixed_block

Field = NDArray[np.float64]
_LATTICE = np.stack(np.meshgrid(*[np.linspace(0.0, 1.0, 9)] * 3), axis=-1).reshape(-1, 3)


def regularized(folder: Path) -> None:
    """The process of one run of ours: a tiny mesh first, then the mesh; prints CPU seconds and why it stopped."""
    mesh = loaded(folder)
    tiny = mixed_block(2)
    if mesh.blocks[0].cell_type.name in QUADRATIC_TYPES:
        tiny = perturbed(hc.elevated(hc.generate.box((3, 3, 3)), len(mesh.blocks[0].cell_type.nodes)), 0.3)
    hc.regularize(tiny, boundary="fixed")
    began = time.process_time()
    result = hc.regularize(mesh, boundary="fixed")
    print(json.dumps({"work": time.process_time() - began, "reason": result.report.reason}))
    np.save(folder / "out.npy", result.points)


def saved(mesh: MixedMesh, folder: Path) -> None:
    """Put a mesh where the process of a run finds it."""
    arrays: dict[str, Any] = {block.cell_type.name: block.cells for block in mesh.blocks}
    np.savez(folder / "in.npz", points=mesh.points, **arrays)


def loaded(folder: Path) -> MixedMesh:
    """The mesh that was put there."""
    with np.load(folder / "in.npz") as data:
        return MixedMesh.of_types(data["points"], {name: data[name] for name in SOLID_TYPES if name in data})


def ours(mesh: MixedMesh, limit: float) -> tuple[Answer, str]:
    """Our result from a process of its own, and the seconds of CPU of the work alone."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        saved(mesh, folder)
        ended = run([sys.executable, __file__, "--one", str(folder)], limit)
        if ended.code != 0:
            why = "over time" if ended.code is None else ended.output.strip().splitlines()[-1]
            return Answer(None, ended.cpu, why), ""
        said = json.loads(ended.output.strip().splitlines()[-1])
        return Answer(np.load(folder / "out.npy"), ended.cpu, said["reason"]), f" / {said['work']:.1f}"


def quadratic_rows(name: str, mesh: MixedMesh, python: str | None, limit: float) -> Iterator[str]:
    """A line for the input, and one for each tool."""
    (block,) = mesh.blocks
    x = mesh.points[block.cells]
    yield _quadratic_row(f"{name} ({len(x)} of {x.shape[1]} nodes)", "input", x, "", "")
    answer, work = ours(mesh, limit)
    found = None if answer.points is None else answer.points[block.cells]
    yield _quadratic_row("", "hexconformal", found, f"{answer.cpu:.1f}{work}", answer.note)
    for title, peer in QUADRATIC_PEERS.items() if python else ():
        answer = peer(python or "", mesh.points, block, limit)
        yield _quadratic_row("", title, answer.points, f"{answer.cpu:.1f}", answer.note)


def _quadratic_row(name: str, method: str, x: Field | None, cpu: str, note: str) -> str:
    if x is None:
        return f"| {name} | {method} | | | | {cpu} | {note} |"
    measured = quality_of(x)
    gradients = quadratic_shape_gradients(_LATTICE, SOLID_TYPES[f"hexahedron{x.shape[1]}"])
    det = np.concatenate([np.linalg.det(np.einsum("cai,qaj->cqij", part, gradients)) for part in _parts(x)])
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = (det.min(axis=1) / np.abs(det).max(axis=1)).min()
    scaled = measured.scaled_jacobian
    invalid = int((~measured.valid).sum())
    return (
        f"| {name} | {method} | {invalid} | {scaled.min():.3f} / {scaled.mean():.3f} | {ratio:.3f} | {cpu} | {note} |"
    )


def _parts(x: Field) -> list[Field]:
    return np.array_split(x, len(x) // 500 + 1)


def linear_rows(name: str, mesh: MixedMesh, python: str | None, limit: float) -> Iterator[str]:
    """A line for the input, and one for each tool."""
    cells = {block.cell_type.name: block.cells for block in mesh.blocks}
    counts = ", ".join(f"{len(rows)} {kind}" for kind, rows in cells.items())
    yield _linear_row(f"{name} ({counts})", "input", mesh, mesh.points, "", "")
    answer, work = ours(mesh, limit)
    yield _linear_row("", "hexconformal", mesh, answer.points, f"{answer.cpu:.1f}{work}", answer.note)
    quads = boundary_quads(collapsed_mesh(mesh).cells)[0]
    triangles = quads[:, 2] == quads[:, 3]
    faces = {"triangle": quads[triangles, :3], "quad": quads[~triangles]}
    faces = {kind: rows for kind, rows in faces.items() if len(rows)}
    peers = available(python)[0] if python else {}
    for title, runner in peers.items():
        answer = PEERS[title](runner, mesh.points, cells, faces, limit)
        yield _linear_row("", title, mesh, answer.points, f"{answer.cpu:.1f}", answer.note)


def _linear_row(name: str, method: str, mesh: MixedMesh, points: Field | None, cpu: str, note: str) -> str:
    if points is None:
        return f"| {name} | {method} | | | {cpu} | {note} |"
    measured = hc.quality(mesh.replaced(points))
    assert isinstance(measured, hc.MixedQuality)
    scaled = ", ".join(
        f"{kind} {one.scaled_jacobian.min():.3f} / {one.scaled_jacobian.mean():.3f}"
        for kind, one in measured.by_type().items()
    )
    return f"| {name} | {method} | {int((~measured.valid).sum())} | {scaled} | {cpu} | {note} |"


def shaken(mesh: MixedMesh, amount: float) -> MixedMesh:
    """The mesh with nodes that are not on its boundary moved by up to `amount` along each axis."""
    moves = np.random.default_rng(1).uniform(-amount, amount, mesh.points.shape)
    moves[boundary_quads(collapsed_mesh(mesh).cells)[0]] = 0.0
    return mesh.replaced(mesh.points + moves)


def meshes(folders: list[Path]) -> Iterator[tuple[str, MixedMesh]]:
    """Names and meshes: our own, and those of folders that are of these cells."""
    for name, make in CURVED:
        yield name, make()
    for amount in (0.2, 0.5):
        yield f"bar of four types, inner nodes off by {amount:g} h", shaken(mixed_block(4), amount)
    for folder in folders:
        for path in sorted(folder.iterdir()):
            if path.suffix.lower() not in READ_EXTENSIONS:
                continue
            try:
                mesh = hc.as_volume_mesh(path)
            except ValueError:
                continue
            if isinstance(mesh, MixedMesh):
                yield path.stem.removesuffix("_input"), with_wedges_upright(mesh)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--meshes", type=Path, nargs="*", default=[], help="folders of further meshes")
    parser.add_argument("--peers", nargs="?", const=sys.executable, help="interpreter that has mfem, gmsh, vtk")
    parser.add_argument("--limit", type=float, default=60.0, help="CPU seconds of a run")
    parser.add_argument("--only", nargs="+", help="parts of names of meshes")
    parser.add_argument("-o", "--output", type=Path, help="write the tables there")
    parser.add_argument("--one", type=Path, help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.one:
        regularized(asked.one)
        return
    load, quadratic, linear = os.getloadavg(), [], []
    for name, mesh in meshes(asked.meshes):
        if asked.only and not any(part in name for part in asked.only):
            continue
        kinds = {block.cell_type.name for block in mesh.blocks}
        if kinds <= set(QUADRATIC_TYPES) and len(kinds) == 1:
            rows, table = quadratic_rows(name, mesh, asked.peers, asked.limit), quadratic
        elif not kinds & set(QUADRATIC_TYPES):
            rows, table = linear_rows(name, mesh, asked.peers, asked.limit), linear
        else:
            continue
        for row in rows:
            print(row, flush=True)
            table.append(row)
    text = "\n".join([
        "# Other cells", "", described(load), "", "## Quadratic hexahedra, fixed boundary", "",
        "| mesh | tool | invalid | SJ min / mean | detmin / detmax | CPU s | note |", "|---|---|--:|--:|--:|--:|---|",
        *quadratic, "", "## Linear cells of several types, fixed boundary", "",
        "| mesh | tool | invalid | SJ min / mean | CPU s | note |", "|---|---|--:|---|--:|---|", *linear, "",
    ])  # fmt: skip
    if asked.output:
        asked.output.write_text(text)


if __name__ == "__main__":
    main()
