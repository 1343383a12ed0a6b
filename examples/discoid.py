"""Figure 2 of Gruber & Aulisa: a quad cube under Willmore flow of constant area and volume becomes a discoid.

    python examples/discoid.py                  # some minutes; leaves discoid.png and discoid/

Once without remeshing, once with: the same surface, but only one keeps its squares.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import pictures

import surface

FACES = [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]


def quad_cube(n: int) -> tuple[np.ndarray, np.ndarray]:
    """The surface of the unit cube, n x n squares a side: points and quadrilaterals."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]])
    u, v = np.meshgrid(np.arange(n + 1) / n, np.arange(n + 1) / n, indexing="ij")
    i = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    table = np.stack([i[:-1, :-1], i[1:, :-1], i[1:, 1:], i[:-1, 1:]], axis=2).reshape(-1, 4)
    points, quads = [], []
    for number, (a, b, _, d) in enumerate(corners[FACES].astype(float)):
        points.append((a + u[..., None] * (b - a) + v[..., None] * (d - a)).reshape(-1, 3))
        quads.append(table + number * (n + 1) ** 2)
    whole = np.concatenate(points)
    _, first, inverse = np.unique((whole * n).round(), axis=0, return_index=True, return_inverse=True)
    return whole[first], inverse.ravel()[np.concatenate(quads)]


def main() -> None:
    """Follow both flows and draw them."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--size", type=int, default=16, help="squares along an edge of the cube")
    parser.add_argument("--steps", type=int, default=260)
    parser.add_argument("--picture", type=Path, default=Path("discoid.png"))
    arguments = parser.parse_args()
    points, quads = quad_cube(arguments.size)
    rows = []
    for title, remesh in (("(a) without remeshing", False), ("(b) with remeshing", True)):
        flow = surface.Willmore((points, quads), conserve=("area", "volume"))
        moments = list(surface.evolve(flow, steps=arguments.steps, remesh=remesh))
        for moment in moments[:: max(len(moments) // 8, 1)] + moments[-1:]:
            record = moment.record
            print(
                f"{title}: step {record.step}, t = {record.time:.4f}, W / 8 pi = {record.energy / 16 / np.pi:.4f}, "
                f"reduced volume {record.reduced_volume:.4f}, smallest angle {record.min_angle:.1f}"
            )
        # Where a quarter, a half, ... of the energy's fall is done: the times at which there is something to see.
        energy = np.array([moment.record.energy for moment in moments])
        share = (energy[0] - energy) / (energy[0] - energy[-1])
        shown = [0, *(int(np.searchsorted(share, goal)) for goal in (0.8, 0.92, 0.97)), len(moments) - 1]
        rows.append(
            (title, [pictures.Shot(moments[k].surface_mesh, f"t = {moments[k].record.time:.3g}") for k in shown])
        )
    pictures.draw(arguments.picture, rows, view=(1.0, -0.9, 0.55))
    print(f"wrote {arguments.picture}")


if __name__ == "__main__":
    main()
