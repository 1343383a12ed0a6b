"""Random meshes with random options: what is promised, held against what comes out.

    python benchmarks/soak.py                    # 200 cases, a table and every failure; some minutes
    python benchmarks/soak.py --count 1 --seed 17 --kind hexahedra

A case is a seed: it gives the mesh, the options and where the run is left. The exit code is 1 if a promise is broken.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
import traceback
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from independent_distance import finely_measured
from independent_validity import corner_scaled_jacobian, surely_invalid, surely_valid
from machine import described
from scipy.spatial.transform import Rotation

import hexconformal as hc
import surface
from hexconformal.generate import ball, box, cylinder, jittered, twisted_cube
from hexconformal.geometry import Faces, face_area_vectors
from hexconformal.io.pyvista_mesh import grid_from_arrays
from hexconformal.mesh.topology import boundary_quads
from surface.quality.assessment import smallest_angles

LEVEL, ROUNDING = 1e-6, 1e-9
FINE = 0.02  # of a bound: what a measure with many samples of small triangles is off


@dataclass
class Case:
    """A mesh, options for it, and after how many records the run is left (None: it is not)."""

    points: np.ndarray
    cells: np.ndarray
    options: dict[str, Any]
    leave: int | None
    traits: list[str] = field(default_factory=list)


# ------------------------------------------------------------------------------------------- hexahedra
def hexahedra(rng: np.random.Generator) -> Case:
    """A lattice, twisted or sheared, jittered, with holes, once or twice, in any order, size and place."""
    traits = []
    shape = tuple(rng.integers(1, 5, 3).tolist())
    points, cells = box(shape, rng.uniform(0.5, 2.0, 3))
    if rng.random() < 0.3:
        points, cells = twisted_cube(int(rng.integers(2, 5)), rng.uniform(0, 80))
        traits.append("twisted")
    if rng.random() < 0.3:
        points = points @ (np.eye(3) + np.triu(rng.uniform(-1, 1, (3, 3)), 1))
        traits.append("sheared")
    if rng.random() < 0.3 and len(cells) > 4:
        # What is left may touch itself in an edge or a node.
        cells = cells[rng.random(len(cells)) < 0.75] if rng.random() < 0.7 else cells[::2]
        traits.append("holes")
    perhaps = rng.random() < 0.25
    points, cells = jittered(
        points, cells, rng.uniform(0, 0.5), int(rng.integers(1 << 30)), rng.random() < 0.5, not perhaps
    )
    if perhaps:
        traits.append("perhaps tangled")
    return _hexahedral_case(points, cells, traits, rng)


def tangled(rng: np.random.Generator) -> Case:
    """A lattice, ball or cylinder thrown about, with coincident nodes, flat cells, and cells or parts upside down."""
    shape = tuple(rng.integers(1, 5, 3).tolist())
    meshes = {"box": lambda: box(shape, rng.uniform(0.5, 2.0, 3)), "ball": lambda: ball(2, 1)}
    meshes["cylinder"] = lambda: cylinder(2, 1, shape[2])
    kind = str(rng.choice(list(meshes), p=[0.6, 0.2, 0.2]))
    traits = [kind]
    points, cells = meshes[kind]()
    points, cells = jittered(points, cells, rng.choice([0.0, 0.3, 1.0, 2.0]), int(rng.integers(1 << 30)), valid=False)
    points = points.copy()
    if rng.random() < 0.3:
        points += rng.uniform(0, 0.2) * np.ptp(points, axis=0) / 4 * rng.normal(size=points.shape)
        traits.append("rough")
    spoil: dict[str, Callable[[np.ndarray, np.ndarray, np.random.Generator], Any]] = {
        "coincident": _coincident,
        "flat": _flattened,
        "mirrored": _mirrored,
        "pulled through": _pulled_through,
        "part mirrored": _part_mirrored,
    }
    for name, change in spoil.items():
        if rng.random() < 0.35:
            for cell in rng.integers(len(cells), size=1 if name == "part mirrored" else int(rng.integers(1, 4))):
                change(points, cells[cell], rng)
            traits.append(name)
    if rng.random() < 0.1:
        points, cells = np.concatenate([points, points]), np.concatenate([cells, cells + len(points)])
        traits.append("copied")
    return _hexahedral_case(points, cells, traits, rng)


def _coincident(points: np.ndarray, cell: np.ndarray, rng: np.random.Generator) -> None:
    """Two or more nodes of the cell come to one place."""
    some = rng.permutation(cell)[: int(rng.choice([2, 2, 3, 8]))]
    points[some] = points[some[0]]


def _flattened(points: np.ndarray, cell: np.ndarray, rng: np.random.Generator) -> None:
    """The cell is pressed into a plane."""
    axis = int(rng.integers(3))
    points[cell, axis] = points[cell, axis].mean()


def _mirrored(points: np.ndarray, cell: np.ndarray, rng: np.random.Generator) -> None:
    """The cell changes its sides."""
    axis = int(rng.integers(3))
    points[cell, axis] = 2 * points[cell, axis].mean() - points[cell, axis]


def _pulled_through(points: np.ndarray, cell: np.ndarray, rng: np.random.Generator) -> None:
    """One node of the cell goes through the opposite corner."""
    points[cell[0]] += rng.uniform(1.0, 2.0) * (points[cell[6]] - points[cell[0]])


def _part_mirrored(points: np.ndarray, cell: np.ndarray, rng: np.random.Generator) -> None:
    """What lies beyond a plane through the cell is reflected in it."""
    axis = int(rng.integers(3))
    beyond = points[:, axis] - points[cell, axis].mean()
    points[beyond > 0.2 * np.ptp(points[:, axis]), axis] -= 2 * beyond[beyond > 0.2 * np.ptp(points[:, axis])]


def _hexahedral_case(points: np.ndarray, cells: np.ndarray, traits: list[str], rng: np.random.Generator) -> Case:
    """The mesh perhaps twice, with loose points, in any order, size and place, and options for it."""
    if rng.random() < 0.2:
        size = np.ptp(points, axis=0).max()
        points, cells = np.concatenate([points, points + 3 * size]), np.concatenate([cells, cells + len(points)])
        traits.append("two pieces")
    if rng.random() < 0.3:
        points = np.concatenate([points, points.mean(axis=0) + rng.normal(size=(2, 3))])
        traits.append("loose points")
    order = rng.permutation(len(points))
    cells = np.argsort(order)[cells][rng.permutation(len(cells))]
    points = _placed(points[order], rng, traits)
    options = _options(
        rng,
        boundary=["fixed", "free", "slide"],
        hausdorff=[0.0, 0.001, 0.05],
        features=["keep", "soft"],
        target=["cube", "input", "1:1:2"],
        sizes=["free"],
        weight=["volume"],
        quadrature=["gauss", "corners"],
        method=["lbfgs", "newton"],
        emphasis=["worst", "mean"],
        conserve_volume=[True],
        max_iterations=[3, 200],
    )
    if rng.random() < 0.15:
        options |= {"energy": "quaternionic", "boundary": "fixed" if options.get("boundary") == "free" else "slide"}
        for name in ("emphasis", "sizes"):
            options.pop(name, None)
    if options.get("boundary") == "free":
        options.pop("conserve_volume", None)
    options["max_iterations"] = min(options.get("max_iterations", 40), 40)
    if rng.random() < 0.3:
        options["fixed"] = rng.random((len(points), 3) if rng.random() < 0.5 else len(points)) < 0.2
        traits.append("nodes held")
    return Case(points, cells, options, int(rng.integers(1, 12)) if rng.random() < 0.3 else None, traits)


def judge_hexahedra(case: Case, rng: np.random.Generator) -> list[str]:
    """What is broken of what is promised."""
    mesh = hc.HexMesh(case.points, case.cells)
    mesh = mesh.replaced(
        point_data={"kept": rng.random(len(case.points))}, cell_data={"kept": rng.integers(9, size=len(case.cells))}
    )
    grid = grid_from_arrays(mesh)
    sent = grid.copy(deep=True)
    meshes: list[np.ndarray] = []
    result = _left(hc.Regularization(grid, hc.Options(**case.options)), case.leave, meshes)
    again = _left(hc.Regularization(grid, hc.Options(**case.options)), case.leave)
    x, y, cells = case.points, result.points, case.cells
    nodes, order = rng.permutation(len(x)), rng.permutation(len(cells))
    fixed = case.options.get("fixed")
    options = case.options if fixed is None else case.options | {"fixed": fixed[nodes]}
    renumbered = hc.HexMesh(x[nodes], np.argsort(nodes)[cells[order]])
    other = _left(hc.Regularization(renumbered, hc.Options(**options)), case.leave)
    broken = []

    def hold(promise: str, kept: Any) -> None:
        if not kept:
            broken.append(promise)

    hold("the input is not changed", grid == sent)
    hold("twice the same", np.array_equal(y, again.points))
    # Of copies at one place it is the numbers that tell which is which.
    ways = [np.hstack([x, y])[nodes], np.hstack([x[nodes], other.points])]
    if "copied" in case.traits:
        ways = [rows[np.lexsort(rows.T)] for rows in ways]
    hold("in another order the same bits", np.array_equal(*ways))
    hold("finite", np.isfinite(y).all())
    valid = cells[surely_valid(x, cells)]
    hold("valid cells stay valid", not surely_invalid(y, valid).any())
    hold("in every iterate", not any(surely_invalid(points, valid).any() for points in meshes))
    quality = [corner_scaled_jacobian(points, cells) for points in (x, y)]
    inverted = [int((q <= 0).sum()) for q in quality]
    hold("no more cells are inverted", inverted[1] <= inverted[0])
    if (
        case.options.get("energy") != "quaternionic"
        and case.options.get("emphasis") != "mean"
        and inverted[0] == inverted[1]
    ):
        hold("the smallest is not lower", quality[1].min() >= quality[0].min() - LEVEL)
        hold("the mean is not lower", quality[1].mean() >= quality[0].mean() - ROUNDING)
    held = np.zeros(x.shape, dtype=bool)
    if fixed is not None:
        held |= fixed if fixed.ndim == 2 else fixed[:, None]
    quads = boundary_quads(cells)[0]
    if case.options.get("boundary") == "fixed":
        held[np.unique(quads)] = True
    held[np.setdiff1d(np.arange(len(x)), cells)] = True
    hold("what is held stays, bit for bit", np.array_equal(x[held], y[held]))
    kept = zip((result.mesh.point_data, result.mesh.cell_data), (grid.point_data, grid.cell_data), strict=True)
    hold("arrays are kept", all(np.array_equal(out["kept"], old["kept"]) for out, old in kept))
    if case.options.get("boundary", "slide") == "slide":
        diagonal = np.linalg.norm(np.ptp(x[np.unique(cells)], axis=0))
        bound = case.options.get("hausdorff", 0.005) * (1.0 + FINE) + 1e-6
        # Triangles a tenth of an edge wide are off by more where a bound is tight.
        far = finely_measured(y, x, quads, 10) / diagonal
        if far > bound:
            far = finely_measured(y, x, quads, 40) / diagonal
        hold("the surface stays within its bound", far <= bound)
        hold(
            "so does the distance of the report", result.report.hausdorff <= case.options.get("hausdorff", 0.005) + 1e-9
        )
    return broken


# ------------------------------------------------------------------------------------------- surfaces
def surfaces(rng: np.random.Generator) -> Case:
    """A sphere, torus, cube or sheet of triangles, quadrilaterals or both, deformed, in any order, size and place."""
    traits: list[str] = []
    kind = str(rng.choice(["sphere", "torus", "sheet", "cube"]))
    traits.append(kind)
    n = int(rng.integers(4, 10))
    points, quads = _cube(n // 2 + 1) if kind in ("sphere", "cube") else _grid(n, kind == "torus")
    points = points + rng.uniform(0, 0.25) / n * rng.normal(size=points.shape) * (kind != "cube")
    if kind == "sphere":
        points /= np.linalg.norm(points, axis=1, keepdims=True)
    points = points * rng.uniform(0.5, 2.0, 3)
    split = rng.random(len(quads)) < rng.choice([0.0, 0.5, 1.0])
    triangles = np.concatenate([quads[split][:, [0, 1, 2]], quads[split][:, [0, 2, 3]]])
    quads = quads[~split]
    traits.append("triangles" if not len(quads) else "mixed" if len(triangles) else "quadrilaterals")
    if rng.random() < 0.3:
        points = np.concatenate([points, rng.normal(size=(2, 3))])
        traits.append("loose points")
    order = rng.permutation(len(points))
    place = np.argsort(order)
    points = _placed(points[order], rng, traits)
    cells = [place[table][rng.permutation(len(table))] for table in (triangles, quads)]
    options = _options(
        rng,
        target=["flat", "input"],
        energy=["quaternionic"],
        emphasis=["worst"],
        hausdorff=[0.001, 0.05],
        feature_angle=[None, 30.0],
        boundary=["fixed"],
        normal=["middle", "simpson"],
        max_iterations=[3],
    )
    options.setdefault("max_iterations", 25)
    if rng.random() < 0.3:
        options["fixed"] = rng.random(len(points)) < 0.2
        traits.append("nodes held")
    return Case(points, cells, options, int(rng.integers(1, 8)) if rng.random() < 0.3 else None, traits)


def judge_surfaces(case: Case, rng: np.random.Generator) -> list[str]:
    """What is broken of what is promised."""
    triangles, quads = case.cells
    cells = Faces(triangles, quads)
    x, before = case.points, case.points.copy()
    source = (case.points, triangles, quads)
    result = _left(surface.Remeshing(source, surface.Options(**case.options)), case.leave)
    again = _left(surface.Remeshing(source, surface.Options(**case.options)), case.leave)
    y, broken = result.points, []

    def hold(promise: str, kept: Any) -> None:
        if not kept:
            broken.append(promise)

    hold("the input is not changed", np.array_equal(x, before))
    hold("twice the same", np.array_equal(y, again.points))
    hold("finite", np.isfinite(y).all())
    hold("no cell turns over", result.report.turned == 0 or result.report.turned <= result.history[0].turned)
    # A sheet that hangs nowhere over must not do so afterwards.
    up = [face_area_vectors(points, cells) @ face_area_vectors(x, cells).sum(axis=0) for points in (x, y)]
    hold("no cell of a sheet lies upside down", "sheet" not in case.traits or up[0].min() <= 0 or up[1].min() > 0)
    if case.options.get("target") == "input":  # regular cells are not what is wanted
        hold("the energy is not higher", result.report.energy_after <= result.report.energy_before)
    else:
        angles = [smallest_angles(points, cells) for points in (x, y)]
        hold("the smallest angle is hardly lower", angles[1].min() >= (1 - 1e-3) * angles[0].min() - LEVEL)
        hold("the mean angle is not lower", angles[1].mean() >= angles[0].mean() - LEVEL)
    hold("the surface stays within its bound", result.report.hausdorff <= case.options.get("hausdorff", 0.01) + 1e-9)
    held = np.zeros(len(x), dtype=bool) if case.options.get("fixed") is None else case.options["fixed"].copy()
    held[np.setdiff1d(np.arange(len(x)), cells.nodes())] = True
    hold("what is held stays, bit for bit", np.array_equal(x[held], y[held]))
    return broken


# ------------------------------------------------------------------------------------------- both
def _cube(n: int) -> tuple[np.ndarray, np.ndarray]:
    points, cells = box((n, n, n), (2, 2, 2), (-1, -1, -1))
    quads = boundary_quads(cells)[0]
    nodes, place = np.unique(quads, return_inverse=True)
    return points[nodes], place.reshape(-1, 4)


def _grid(n: int, closed: bool) -> tuple[np.ndarray, np.ndarray]:
    """A torus, or a wavy sheet."""
    m = n if closed else n + 1
    i, j = (part.ravel() for part in np.meshgrid(np.arange(m), np.arange(m), indexing="ij"))
    if closed:
        a, b = 2 * np.pi * i / n, 2 * np.pi * j / n
        points = np.stack([(2 + np.cos(b)) * np.cos(a), (2 + np.cos(b)) * np.sin(a), np.sin(b)], axis=1)
    else:
        points = np.stack([i / n, j / n, 0.1 * np.sin(4 * i / n)], axis=1)
    a, b = (part.ravel() for part in np.meshgrid(np.arange(n), np.arange(n), indexing="ij"))
    return points, np.stack(
        [a % m * m + b % m, (a + 1) % m * m + b % m, (a + 1) % m * m + (b + 1) % m, a % m * m + (b + 1) % m], axis=1
    )


def _placed(points: np.ndarray, rng: np.random.Generator, traits: list[str]) -> np.ndarray:
    """The points turned, in another unit of length, and far away."""
    if rng.random() < 0.5:
        points = points @ Rotation.random(rng=rng).as_matrix().T
    if rng.random() < 0.4:
        points = points * 10.0 ** rng.uniform(-6, 6)
        traits.append("other unit")
    if rng.random() < 0.3:
        points = points + np.ptp(points, axis=0).max() * 10.0 ** rng.uniform(0, 5) * rng.normal(size=3)
        traits.append("far away")
    return np.ascontiguousarray(points)


def _options(rng: np.random.Generator, **choices: list[Any]) -> dict[str, Any]:
    """Some of the options, the others as they are by default."""
    return {name: values[rng.integers(len(values))] for name, values in choices.items() if rng.random() < 0.25}


def _left(run: Any, leave: int | None, meshes: list[np.ndarray] | None = None) -> Any:
    """The result of the run, left after so many records; collects the points at every one of them."""
    for number, _ in enumerate(run):
        if meshes is not None:
            meshes.append(run.points)
        if number == leave:
            break
    return run.result()


KINDS: dict[str, tuple[Callable[..., Case], Callable[..., list[str]]]] = {
    "hexahedra": (hexahedra, judge_hexahedra),
    "tangled": (tangled, judge_hexahedra),
    "surfaces": (surfaces, judge_surfaces),
}


def verdict(kind: str, seed: int) -> tuple[str, Case, list[str]]:
    """("kept", "broken", "refused" or "died"), the case, and what is to be said."""
    rng = np.random.default_rng([seed, *kind.encode()])
    make, judge = KINDS[kind]
    case = make(rng)
    try:
        broken = judge(case, rng)
    except (hc.MeshError, hc.OptionError) as problem:
        return "refused", case, [str(problem)]
    except Exception:
        return "died", case, [traceback.format_exc()]
    return ("broken" if broken else "kept"), case, broken


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=100, help="cases of each kind")
    parser.add_argument("--seed", type=int, default=0, help="of the first case")
    parser.add_argument("--kind", choices=KINDS, help="only this one")
    arguments = parser.parse_args()
    load, began = os.getloadavg(), time.perf_counter()
    rows, failures = [], []
    for kind in [arguments.kind] if arguments.kind else KINDS:
        start = time.process_time()
        counts: Counter[str] = Counter()
        reasons: Counter[str] = Counter()
        for seed in range(arguments.seed, arguments.seed + arguments.count):
            what, case, said = verdict(kind, seed)
            counts[what] += 1
            if what == "refused":
                reasons[said[0][:60]] += 1
            if what in ("broken", "died"):
                options = {k: v if np.ndim(v) == 0 else "given" for k, v in case.options.items()}
                failures.append(
                    f"{kind} {seed} ({', '.join(case.traits)}; {options}; left {case.leave}): {'; '.join(said)}"
                )
                print(failures[-1], flush=True)
        seconds = time.process_time() - start
        figures = [counts[what] for what in ("kept", "refused", "broken", "died")]
        rows.append(f"| {kind} | {arguments.count} | {' | '.join(map(str, figures))} | {seconds:.0f} |")
        rows += [f"refused {number}: {reason}" for reason, number in reasons.most_common()]
    print("\n| kind | cases | kept | refused | broken | died | CPU s |\n|---|--:|--:|--:|--:|--:|--:|")
    print("\n".join(rows))
    print(f"\n{time.perf_counter() - began:.0f} s; {described(load)}")
    return int(bool(failures))


if __name__ == "__main__":
    sys.exit(main())
