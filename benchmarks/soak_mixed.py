"""Random meshes of hexahedra, wedges, pyramids and tetrahedra: what is promised, held against what comes out.

    python benchmarks/soak_mixed.py                    # 100 cases, a table and every failure; some minutes
    python benchmarks/soak_mixed.py --count 1 --seed 17

A case is a seed. Validity is that of an independent measure: shape functions that the tests write out, at 343 places of
every cell. The exit code is 1 if a promise is broken.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
import traceback
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
from independent_distance import finely_measured
from machine import described
from soak import FINE, LEVEL, _left, _options, _placed

import hexconformal as hc
from hexconformal.elements import HEXAHEDRON
from hexconformal.elements import shape_gradients as hexahedral_gradients
from hexconformal.mesh import MixedMesh, boundary_quads, collapsed_mesh

sys.path.append(str(Path(__file__).parents[1] / "tests"))
from meshes.linear_cells import shape_gradients
from meshes.mixed import cut_block, four_types, jittered_inside, mixed_block

_SURELY = 1e-9  # of the largest determinant of a cell: what is negative beyond that is so, and not by rounding


def random_mesh(rng: np.random.Generator) -> tuple[MixedMesh, list[str]]:
    """A block of all types, or of some, jittered, in any order, size and place; wedges in either order."""
    amount = float(rng.choice([0.1, 0.3, 0.5]))
    kind = str(rng.choice(["block", "tetrahedra", "four types", "wedges"]))
    seed = int(rng.integers(1 << 30))
    if kind == "four types":
        mesh = four_types(amount, seed)
    else:
        mesh = cut_block(3) if kind == "tetrahedra" else mixed_block(2)
        mesh = jittered_inside(mesh, amount, seed)
    traits = [kind, f"jittered {amount}"]
    cells = {block.cell_type.name: rng.permutation(block.cells) for block in mesh.blocks}
    if kind == "wedges":
        cells = {"wedge": cells["wedge"]}
    if "wedge" in cells and rng.random() < 0.4:
        cells["wedge"] = cells["wedge"][:, [3, 4, 5, 0, 1, 2]]
        traits.append("reversed wedges")
    points = _placed(mesh.points, rng, traits)
    order = rng.permutation(len(points))
    place = np.argsort(order)
    return MixedMesh.of_types(points[order], {name: place[rows] for name, rows in cells.items()}), traits


def smallest_determinants(mesh: MixedMesh, per_side: int = 7) -> dict[str, np.ndarray]:
    """By type, smallest det J of each cell over its largest, at many places."""
    side = np.linspace(0.0, 1.0, per_side)
    cube = np.stack(np.meshgrid(side, side, side, indexing="ij"), -1).reshape(-1, 3)
    found = {}
    upright = collapsed_mesh(mesh)
    for block in mesh.blocks:
        own = next(one for one in _types(upright) if one[0] is block.cell_type)[1]
        xi = cube if block.cell_type.name in ("hexahedron", "pyramid") else cube[cube[:, 0] + cube[:, 1] <= 1 + 1e-12]
        gradients = hexahedral_gradients(xi) if block.cell_type is HEXAHEDRON else shape_gradients(block.cell_type, xi)
        # From the first node of each, so that nothing is lost far away.
        x = mesh.points[own] - mesh.points[own[:, :1]]
        determinants = np.linalg.det(np.einsum("qai,cak->cqki", gradients, x))
        found[block.cell_type.name] = determinants.min(axis=1) / np.abs(determinants).max(axis=1)
    return found


def _types(mesh: hc.HexMesh) -> list[tuple[Any, np.ndarray]]:
    from hexconformal.elements import rows_by_type

    return [(one.cell_type, one.own_nodes(mesh.cells)) for one in rows_by_type(mesh.cells)]


def broken_promises(seed: int) -> tuple[str, list[str], dict[str, Any], list[str]]:
    """("kept", "broken", "refused" or "died"), traits, options, and what is to be said."""
    rng = np.random.default_rng([seed, *b"mixed"])
    mesh, traits = random_mesh(rng)
    options = _options(
        rng,
        boundary=["fixed", "free", "slide"],
        hausdorff=[0.0, 0.001, 0.05],
        features=["keep", "soft"],
        sizes=["free"],
        weight=["volume"],
        method=["lbfgs", "newton"],
        emphasis=["worst", "mean"],
        conserve_volume=[True],
    )
    if options.get("boundary") == "free":
        options.pop("conserve_volume", None)
    options["max_iterations"] = 40
    leave = int(rng.integers(1, 12)) if rng.random() < 0.3 else None
    try:
        broken = _judged(mesh, options, leave, rng)
    except (hc.MeshError, hc.OptionError) as problem:
        return "refused", traits, options, [str(problem)]
    except Exception:
        return "died", traits, options, [traceback.format_exc()]
    return ("broken" if broken else "kept"), traits, options, broken


def _judged(mesh: MixedMesh, options: dict[str, Any], leave: int | None, rng: np.random.Generator) -> list[str]:
    result = _left(hc.Regularization(mesh, hc.Options(**options)), leave)
    order = rng.permutation(len(mesh.points))
    place = np.argsort(order)
    cells = {block.cell_type.name: place[rng.permutation(block.cells)] for block in mesh.blocks[::-1]}
    other = _left(hc.Regularization(MixedMesh.of_types(mesh.points[order], cells), hc.Options(**options)), leave)
    y, broken = result.points, []

    def hold(promise: str, kept: Any) -> None:
        if not kept:
            broken.append(promise)

    hold("in another order the same bits", np.array_equal(y[order], other.points))
    hold("finite", np.isfinite(y).all())
    before, after = smallest_determinants(mesh), smallest_determinants(mesh.replaced(points=y))
    for name in before:
        hold(f"valid {name} stays valid", not (after[name][before[name] > _SURELY] < -_SURELY).any())
    one, two = result.report.before, result.report.after
    hold("no more cells are inverted", two.inverted <= one.inverted)
    if options.get("emphasis") != "mean" and one.inverted == two.inverted:
        lower = [name for name in before if _minimum(two, name) < _minimum(one, name) - 2 * LEVEL]
        hold(f"no type is worse: {lower}", not lower)
    quads = boundary_quads(collapsed_mesh(mesh).cells)[0]
    if options.get("boundary") == "fixed":
        on = np.unique(quads)
        hold("the boundary stays, bit for bit", np.array_equal(mesh.points[on], y[on]))
    if options.get("boundary", "slide") == "slide":
        bound = options.get("hausdorff", 0.005)
        diagonal = np.linalg.norm(np.ptp(mesh.points, axis=0))
        far = finely_measured(y, mesh.points, quads, 20) / diagonal
        hold(f"the surface stays within its bound ({far:.3g})", far <= bound * (1 + FINE) + 1e-6)
    return broken


def _minimum(summary: Any, name: str) -> float:
    types = getattr(summary, "types", None)
    return float((summary if types is None else types[name]).scaled_jacobian.min)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0, help="of the first case")
    arguments = parser.parse_args()
    load, start = os.getloadavg(), time.process_time()
    counts: Counter[str] = Counter()
    for seed in range(arguments.seed, arguments.seed + arguments.count):
        what, traits, options, said = broken_promises(seed)
        counts[what] += 1
        if what in ("broken", "died", "refused"):
            print(f"{seed} {what} ({', '.join(traits)}; {options}): {'; '.join(said)}", flush=True)
    figures = " | ".join(str(counts[what]) for what in ("kept", "refused", "broken", "died"))
    print("\n| cases | kept | refused | broken | died | CPU s |\n|--:|--:|--:|--:|--:|--:|")
    print(f"| {arguments.count} | {figures} | {time.process_time() - start:.0f} |\n\n{described(load)}")
    return int(counts["broken"] + counts["died"] > 0)


if __name__ == "__main__":
    sys.exit(main())
