"""Twenty tangled cylinders of wedges and hexahedra: what comes out, type by type.

    python benchmarks/swept_seeds.py                      # writes benchmarks/swept_seeds.md; some minutes
    python benchmarks/swept_seeds.py --seeds 3            # fewer, printed only

Every node is moved by a normal deviate of 0.6 of the shortest edge around it in each coordinate, so that most cells are
inside out. In the first two cases nodes inside are moved alone; in the others all nodes are, those of the two ends
within their planes, and the round side, which is crumpled then, is let go. The bounds are those that such meshes were
asked to reach before the work on wedges began.
"""

from __future__ import annotations

import argparse
import os
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from machine import described
from numpy.typing import NDArray

import hexconformal as hc
from hexconformal.elements import CELL_TYPES
from hexconformal.generate import swept_cylinder
from hexconformal.mesh import MixedMesh, blocks_of

NOISE = 0.6
BOUNDS = {"hexahedron": 0.94, "wedge": 0.75}
MEAN = {"emphasis": "mean"}


@dataclass(frozen=True)
class Case:
    """What is moved and what is asked for; with `ends` the nodes of the two ends stay in their planes."""

    name: str
    inside: bool
    options: dict[str, Any]
    ends: bool = False


CASES = [
    Case("nodes inside; defaults", True, {}),
    Case('nodes inside; `boundary="free", emphasis="mean"`', True, {"boundary": "free", **MEAN}),
    Case('all nodes; `boundary="free"`, ends held in their planes', False, {"boundary": "free"}, True),
    Case('the same, `emphasis="mean", sizes="free"`', False, {"boundary": "free", "sizes": "free", **MEAN}, True),
]


def shortest_edges(mesh: MixedMesh) -> NDArray[np.float64]:
    """(n,) length of the shortest edge at each node."""
    shortest = np.full(len(mesh.points), np.inf)
    for block in blocks_of(mesh):
        edges = block.cells[:, block.cell_type.edges].reshape(-1, 2)
        lengths = np.linalg.norm(mesh.points[edges[:, 0]] - mesh.points[edges[:, 1]], axis=1)
        np.minimum.at(shortest, edges, lengths[:, None])
    return shortest


def shaken(mesh: MixedMesh, seed: int, inside: bool) -> tuple[MixedMesh, NDArray[np.bool_]]:
    """The mesh with its noise, and the components (n, 3) that lie in the planes of the two ends."""
    x, y, z = mesh.points.T
    ends, side = np.isin(z, [z.min(), z.max()]), np.hypot(x, y) > 1.0 - 1e-9
    planes = np.column_stack([0 * ends, 0 * ends, ends]).astype(bool)
    moves = NOISE * shortest_edges(mesh)[:, None] * np.random.default_rng(seed).normal(size=mesh.points.shape)
    moves[np.tile((ends | side)[:, None], 3) if inside else planes] = 0.0
    return mesh.replaced(mesh.points + moves), planes


def rows(case: Case, mesh: MixedMesh, seeds: int) -> list[str]:
    """A row for every type of cells."""
    begun, found = time.process_time(), []
    for seed in range(seeds):
        tangled, planes = shaken(mesh, seed, case.inside)
        report = hc.regularize(tangled, **case.options, fixed=planes if case.ends else None).report
        found.append((report.before.types, report.after.types))
        told = [f"{name} {one.invalid} {one.scaled_jacobian.min:.3f}" for name, one in found[-1][1].items()]
        print(case.name, seed, *told, flush=True)
    seconds = (time.process_time() - begun) / seeds
    lines = []
    for name, bound in BOUNDS.items():
        before, after = ([one[side][name] for one in found] for side in (0, 1))
        least = np.array([one.scaled_jacobian.min for one in after])
        missed = np.flatnonzero((least < bound) | np.array([one.invalid > 0 for one in after]))
        invalid = [one.invalid for one in before]
        lines.append(
            f"| {case.name} | {before[0].count} {CELL_TYPES[name].plural} | {min(invalid)} to {max(invalid)} | "
            f"{sum(one.invalid for one in after)} | {least.min():.3f} | {np.median(least):.3f} | "
            f"{np.mean([one.scaled_jacobian.mean for one in after]):.3f} | {bound} | "
            f"{', '.join(map(str, missed)) or 'none'} | {seconds:.1f} |"
        )
    return lines


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, help="fewer than 20; prints instead of writing")
    asked, load = parser.parse_args(), os.getloadavg()
    mesh = MixedMesh.of_types(*swept_cylinder(core=6, layers=3, axial=6, length=1.2))
    count = asked.seeds or 20
    text = f"""\
# Tangled cylinders of wedges and hexahedra

{described(load)}

`swept_cylinder(core=6, layers=3, axial=6, length=1.2)`, {count} seeds. Every node is moved by a normal deviate of
{NOISE} of the shortest edge around it in each coordinate. Where all nodes are moved, those of the two ends stay in
their planes, and the round side is let go.

Invalid cells: of a seed before, and of all seeds together after. The smallest scaled Jacobian of a seed, the least and
the median over the seeds, and the mean one. A seed misses if a cell is invalid or below the bound, which was asked for
before the work on wedges began. CPU seconds for a seed.

| noise; options | cells | invalid before | after | min SJ | median | mean SJ | bound | seeds that miss | CPU s |
|---|---|--:|--:|--:|--:|--:|--:|--:|--:|"""
    lines = text.splitlines()
    for case in CASES:
        lines += rows(case, mesh, count)
    print("\n".join(lines[-2 * len(CASES) - 2 :]))
    if asked.seeds is None:
        Path(__file__).with_suffix(".md").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
