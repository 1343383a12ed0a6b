"""How far meshes follow their boundary, and what a step costs, for each operator of MeshMotion.

    python benchmarks/motion.py                     # writes benchmarks/motion.md, some minutes
    python benchmarks/motion.py --cells 24          # the cost on a smaller mesh, printed only

Every case goes in equal steps until one is refused, or to its end, and back; largest motion is the last one that was
reached completely. The elasticity solve that a step is compared with is assembled by scikit-fem and solved by
conjugate gradients to 1e-8 with pyamg's smoothed aggregation and rigid body modes.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from machine import described
from numpy.typing import NDArray

from hexconformal import MeshMotion
from hexconformal.generate import box
from hexconformal.motion.mesh_motion import OPERATORS

sys.path.append(str(Path(__file__).parents[1] / "examples"))
sys.path.append(str(Path(__file__).parents[1] / "tests"))
from meshes.hexahedra import cube_in_cube, turned
from moving_cylinder import BOX, TO_SKFEM, o_grid

Field = NDArray[np.float64]


@dataclass(frozen=True)
class Case:
    """A mesh, its moving and fixed nodes, their way at an amount of motion, and the amounts to go through."""

    name: str
    points: Field
    cells: NDArray
    moving: NDArray
    fixed: NDArray
    way: Callable[[Field, float], Field]
    step: float
    end: float
    shown: float  # amount at which the quality is told


def beam_in_channel() -> tuple[Field, NDArray, NDArray, NDArray]:
    """The channel of Turek & Hron, one layer of cells thick, with a square block of side 0.1 for the cylinder."""
    x = np.concatenate([np.linspace(0, 0.15, 9), np.linspace(0.15, 0.25, 7)[1:], np.linspace(0.25, 0.6, 25)[1:]])
    x = np.concatenate([x, 0.6 + 1.9 * (np.linspace(0, 1, 31)[1:]) ** 1.6])
    half = np.concatenate([np.linspace(0.01, 0.05, 4), 0.05 + (np.linspace(0, 1, 10)[1:]) * 0.15])
    y = np.concatenate([0.2 - half[::-1], [0.2], 0.2 + half])
    y[-1] = 0.41
    points, cells = box((len(x) - 1, len(y) - 1, 1))
    i, j = np.rint(points[:, 0] * (len(x) - 1)).astype(int), np.rint(points[:, 1] * (len(y) - 1)).astype(int)
    points = np.column_stack([x[i], y[j], 0.02 * points[:, 2]])
    cx, cy = points[cells].mean(axis=1)[:, :2].T
    block = (cx > 0.15) & (cx < 0.25) & (np.abs(cy - 0.2) < 0.05)
    beam = (cx > 0.25) & (cx < 0.6) & (np.abs(cy - 0.2) < 0.01)
    used, cells = np.unique(cells[~(block | beam)], return_inverse=True)
    points = points[used]
    dx, dy = points[:, 0], np.abs(points[:, 1] - 0.2)
    body = (dx > 0.25 - 1e-9) & (dx < 0.6 + 1e-9) & (dy < 0.01 + 1e-9)
    block = (dx > 0.15 - 1e-9) & (dx < 0.25 + 1e-9) & (dy < 0.05 + 1e-9)
    outer = (dx == 0) | (dx == dx.max()) | (points[:, 1] == 0) | (points[:, 1] == points[:, 1].max())
    return points, cells.reshape(-1, 8), np.flatnonzero(body), np.flatnonzero((block | outer) & ~body)


def bent(points: Field, tip: float, root: float = 0.25, length: float = 0.35, middle: float = 0.2) -> Field:
    """First bending mode of a clamped beam along x, its cross-sections turning with it."""
    k, ratio = 1.8751040687 / length, 0.7340955138
    s = points[:, 0] - root

    def mode(t: Field) -> Field:
        return np.cosh(k * t) - np.cos(k * t) - ratio * (np.sinh(k * t) - np.sin(k * t))

    slope = k * (np.sinh(k * s) + np.sin(k * s) - ratio * (np.cosh(k * s) - np.cos(k * s)))
    size = tip / mode(np.array([length]))[0]
    angle, arm = np.arctan(size * slope), points[:, 1] - middle
    return np.column_stack([-arm * np.sin(angle), size * mode(s) + arm * (np.cos(angle) - 1), 0 * s])


def cases() -> list[Case]:
    """The standard tests."""
    cube = cube_in_cube()
    points, cells = o_grid()
    x, y = points[:, 0], points[:, 1]
    body = np.flatnonzero(np.hypot(x, y) < 0.5001)
    wall = np.flatnonzero((x == BOX[0]) | (x == BOX[1]) | (y == BOX[2]) | (y == BOX[3]))
    return [
        Case("cube in cube, about z, degrees", *cube, lambda x, a: turned(x, (0, 0, 1), a), 10, 180, 30),
        Case("cube in cube, about (1,1,1), degrees", *cube, lambda x, a: turned(x, (1, 1, 1), a), 10, 150, 30),
        Case("cube in cube, translation", *cube, lambda x, a: np.tile([a, 0, 0], (len(x), 1)), 0.1, 1.0, 0.5),
        Case("beam in a channel, tip", *beam_in_channel(), bent, 0.01, 0.15, 0.1),
        Case("cylinder with layers, across", points, cells, body, wall, lambda x, a: np.tile([0, a, 0], (len(x), 1)),
             0.25, 2.5, 0.5),
        Case("cylinder with layers, degrees", points, cells, body, wall, lambda x, a: turned(x, (0, 0, 1), a),
             10, 180, 30),
    ]  # fmt: skip


def followed(case: Case, operator: str) -> str:
    """A row: how far, how good on the way, what a step cost, how exactly the way back leads to the start."""
    motion = MeshMotion((case.points, case.cells), case.moving, case.fixed, operator=operator)
    start = case.points[case.moving]
    amounts, lows, shown, cpu, refused = [], [], "", 0.0, False
    for k in range(1, round(case.end / case.step) + 1):
        amount = k * case.step
        began = time.process_time()
        report = motion.step(case.way(start, amount)).report
        cpu += time.process_time() - began
        if report.refused:
            refused = True
            break
        amounts.append(amount)
        lows.append(report.min_scaled_jacobian)
        if abs(amount - case.shown) < 1e-9:
            shown = f"{report.min_scaled_jacobian:.3f}"
    for amount in [*amounts[-2::-1], 0.0]:
        end = motion.step(case.way(start, amount))
    back = float(np.abs(end.points - case.points).max())
    cell = float(np.abs(case.points[case.cells[:, 1]] - case.points[case.cells[:, 0]]).max(axis=1).mean())
    reached = f"{amounts[-1]:g}" if amounts else "0"
    more = "" if refused else " (end)"
    steps = len(amounts) + refused
    return (
        f"| {case.name} | {len(case.cells)} | {operator} | {reached}{more} | {shown or '-'} at {case.shown:g} | "
        f"{min(lows, default=float('nan')):.4f} | {cpu / steps:.3f} | {back / cell:.1e} |"
    )


def elasticity(points: Field, cells: NDArray, ids: NDArray, values: Field, held: NDArray) -> tuple[float, float, int]:
    """Wall seconds of assembly, and of set-up and solve, and the iterations, of linear elasticity."""
    import pyamg
    import skfem as sk
    from scipy.sparse.linalg import cg
    from skfem.models.elasticity import linear_elasticity

    began = time.perf_counter()
    mesh = sk.MeshHex(points.T.copy(), cells[:, TO_SKFEM].T.copy(), validate=False, sort_t=False)
    basis = sk.Basis(mesh, sk.ElementVector(sk.ElementHex1()), intorder=2)
    matrix = linear_elasticity(0.3 / 0.52, 0.5 / 1.3).assemble(basis).tocsr()
    assembled = time.perf_counter()
    x = np.zeros((len(points), 3))
    x[ids] = values
    fixed = np.zeros((len(points), 3), dtype=bool)
    fixed[ids] = fixed[held] = True
    free = np.flatnonzero(~fixed.ravel())
    modes = np.zeros((len(points), 3, 6))
    modes[:, [0, 1, 2], [0, 1, 2]] = 1.0
    for axis, direction in enumerate(np.eye(3)):
        modes[:, :, 3 + axis] = np.cross(direction, points)
    inner = matrix[free][:, free]
    # Blocks of three unknowns: whole nodes are held.
    solver = pyamg.smoothed_aggregation_solver(inner.tobsr((3, 3)), B=modes.reshape(-1, 6)[free])
    count = []
    cg(inner, -(matrix @ x.ravel())[free], rtol=1e-8, M=solver.aspreconditioner(), callback=lambda _: count.append(1))
    return assembled - began, time.perf_counter() - assembled, len(count)


def cost(n: int) -> list[str]:
    """Lines on one step of a cube in a cube of about 100,000 cells, and on one elasticity solve."""
    points, cells, inner, outer = cube_in_cube(n)
    lines = []
    for operator in OPERATORS:
        began = time.perf_counter()
        motion = MeshMotion((points, cells), inner, outer, operator=operator)
        setup = time.perf_counter() - began
        seconds = []
        for k in range(1, 7):
            report = motion.step(turned(points[inner], (0, 0, 1), 2.0 * k)).report
            seconds.append(report.seconds)
        low = report.min_scaled_jacobian
        lines.append(
            f"| {operator} | {setup:.2f} | {np.median(seconds[1:]):.2f} | {max(seconds[1:]):.2f} | {low:.3f} |"
        )
        print(lines[-1], flush=True)
    assembly, solve, rounds = elasticity(points, cells, inner, turned(points[inner], (0, 0, 1), 2.0), outer)
    told = f"Linear elasticity once: assembly {assembly:.2f} s, set-up and solve {solve:.2f} s ({rounds} iterations)."
    head = ["| operator | set-up s | step s, median | largest | min SJ at 12 degrees |", "|---|--:|--:|--:|--:|"]
    return [f"{len(cells)} cells, cube in cube, steps of 2 degrees about z; wall seconds.", "", *head, *lines, "", told]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cells", type=int, help="along an edge, for the cost alone; prints instead of writing")
    asked = parser.parse_args()
    load = os.getloadavg()
    if asked.cells:
        print("\n".join(cost(asked.cells)))
        return
    lines = ["# Moving meshes", "", described(load), "", "## Cost of a step", "", *cost(48), "", "## How far", ""]
    lines += ["Equal steps (10 degrees, 0.1, 0.01 for the beam, 0.25 for the cylinder) until one is refused; CPU"]
    lines += ["seconds; the way back ends where the mesh began, up to the last column, in cell sizes.", ""]
    lines += ["| case | cells | operator | reached | min SJ | lowest min SJ | CPU s / step | back |"]
    lines += ["|---|--:|---|--:|--:|--:|--:|--:|"]
    for case in cases():
        for operator in OPERATORS:
            lines.append(followed(case, operator))
            print(lines[-1], flush=True)
    Path(__file__).with_suffix(".md").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
