"""Cut every cell of a hexahedral mesh in eight, several times: real parts of any size.

    python benchmarks/cut.py part.vtu finer.vtu            # 8 times as many cells
    python benchmarks/cut.py part.vtu finer.vtu --times 2  # 64 times as many

Nodes come at the middle of edges, faces and cells, where the trilinear cell is.
"""

from __future__ import annotations

import argparse

import numpy as np
from numpy.typing import NDArray

import hexconformal as hc
from hexconformal.elements import CORNERS

Field = NDArray[np.float64]
Ints = NDArray[np.int64]


def cut_in_eight(points: Field, cells: Ints) -> tuple[Field, Ints]:
    """The mesh with each cell (m, 8) cut in eight, those of a cell together."""
    # The 27 nodes of a cell by which of its corners each lies between: a node is what these nodes are.
    grid = np.array([[i, j, k] for k in range(3) for j in range(3) for i in range(3)])
    between = [np.flatnonzero((np.abs(2 * CORNERS - place) < 2).all(axis=1)) for place in grid]
    names = np.full((27, len(cells), 8), -1)
    for name, corners in zip(names, between, strict=True):
        name[:, : len(corners)] = np.sort(cells[:, corners], axis=1)
    kinds, numbers = np.unique(names.reshape(-1, 8), axis=0, return_inverse=True)
    used = (kinds >= 0)[:, :, None]
    middles = np.where(used, points[kinds], 0.0).sum(axis=1) / used.sum(axis=1)
    of = numbers.reshape(27, len(cells))
    firsts = grid[(grid < 2).all(axis=1)]
    parts = ((firsts[:, None] + CORNERS[None]) * [1, 3, 9]).sum(axis=2)
    return middles, np.ascontiguousarray(of[parts].transpose(2, 0, 1).reshape(-1, 8))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("mesh")
    parser.add_argument("output")
    parser.add_argument("--times", type=int, default=1)
    asked = parser.parse_args()
    mesh = hc.read(asked.mesh)
    points, cells = mesh.points, mesh.cells
    for _ in range(asked.times):
        points, cells = cut_in_eight(points, cells)
    hc.write(asked.output, hc.HexMesh(points, cells))


if __name__ == "__main__":
    main()
