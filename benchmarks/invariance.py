"""Does it matter in which unit a mesh is, where it is, and how it is numbered? Largest difference of the results.

    python benchmarks/invariance.py meshes/*.vtu    # the table of docs/reliability.md

Every mesh is regularized with the defaults as it is, in units 10^6 times larger and smaller, 10^4 of its diagonals from
the origin, and with its nodes and cells in random order.
"""

from __future__ import annotations

import argparse
import os
from pathlib import Path

import numpy as np
from machine import described

import hexconformal as hc


def variants(points: np.ndarray, cells: np.ndarray, diagonal: float) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """The same mesh otherwise."""
    rng = np.random.default_rng(0)
    nodes, order = rng.permutation(len(points)), rng.permutation(len(cells))
    return {
        "unit": (1e-6 * points, cells),
        "larger": (1e6 * points, cells),
        "far": (points + 1e4 * diagonal, cells),
        "order": (points[nodes], np.argsort(nodes)[cells[order]]),
    }


def row(path: Path) -> str:
    """Largest distance between nodes in diagonals, and difference of the smallest and mean scaled Jacobian."""
    mesh = hc.read(path)
    plain = hc.regularize((mesh.points, mesh.cells))
    diagonal = plain.report.diagonal
    back = {"unit": 1e6, "larger": 1e-6, "far": 1.0, "order": 1.0}
    shown, least, mean = [], 0.0, 0.0
    for name, other in variants(mesh.points, mesh.cells, diagonal).items():
        result = hc.regularize(other)
        moved = (result.points - (1e4 * diagonal if name == "far" else 0.0)) * back[name]
        wanted = plain.points if name != "order" else plain.points[np.random.default_rng(0).permutation(len(moved))]
        shown.append(f"{np.linalg.norm(moved - wanted, axis=1).max() / diagonal:.0e}")
        one, two = plain.report.after.scaled_jacobian, result.report.after.scaled_jacobian
        least, mean = max(least, abs(one.min - two.min)), max(mean, abs(one.mean - two.mean))
    return f"| {path.stem.removesuffix('_input')} | {' | '.join(shown)} | {least:.0e} | {mean:.0e} |"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("meshes", nargs="+", type=Path)
    load = os.getloadavg()
    print("| mesh | x 1e-6 | x 1e6 | 1e4 diagonals away | another order | smallest | mean |")
    print("|---|--:|--:|--:|--:|--:|--:|")
    for path in parser.parse_args().meshes:
        print(row(path), flush=True)
    print(f"\n{described(load)}")


if __name__ == "__main__":
    main()
