"""Switch the mechanisms of the volumes' stages off, or to another value, one at a time: what each is good for.

    python benchmarks/ablation.py MESHES                       # all of them: benchmarks/ablation.md
    python benchmarks/ablation.py MESHES --only worst_cells    # those of a schedule, printed
    python benchmarks/ablation.py MESHES --largest 2000        # meshes of up to so many cells

A mechanism is a number of a schedule (hexconformal.formulation.schedules); a value of `VALUES` that switches it off is
marked. Each run is one of defaults, but for that number. Beside the meshes of the folder (where some are called
``<name>_input.*``, those) there are generated ones of rare kinds: tangled, folded inside, thin, bounded tightly,
coarse and warped. Numbers for unfolding are tried where something is folded, others that act under an option where that
is set.

changed    cases in which any node ends elsewhere
min, mean  scaled Jacobian, its largest loss and its largest gain over the cases, and where
inverted   cells more, over all cases
H          largest Hausdorff distance in bounds
CPU        seconds of all cases over those with the defaults; noise of some percent
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from folder import meshes
from machine import described

import hexconformal as hc
from hexconformal.elements import is_valid
from hexconformal.formulation import Schedules
from hexconformal.generate import ball, bent_bar, box, cylinder, jittered, twisted_cube

TABLE = Path(__file__).with_suffix(".md")
OFF = "*"  # after a value that switches the mechanism off
HEADER = """| number | default | value | changed | min: loss | gain | mean: loss | gain | inverted | H | CPU |
|---|--:|--:|--:|---|---|---|---|--:|--:|--:|"""
PAGE = """# What each mechanism is good for

Numbers of the schedules (`hexconformal.formulation.schedules`), one at a time at another value, on real and
rare meshes: `ablation.py` says what the columns are. With the defaults:

| case | cells | min | mean | inverted | H | CPU s |
|---|--:|--:|--:|--:|--:|--:|
{defaults}

Losses and gains below .0005 are left out.

{table}

{machine}
"""
FOR_FOLDED = {"untangling", "interior", "folded", "unfolding"}
VALUES: dict[str, dict[str, tuple[Any, ...]]] = {
    "barrier": {
        "attraction": (0.0, OFF),
        "thin": (1e6, OFF),
        "steepness": (20.0,),
        "onset": (0.5,),
        "room": (0.5,),
        "curve_bound": (1.0, OFF),
        "curve_attraction": (0.0, OFF),
        "curve_onset": (0.8,),
        "watched": (0.5,),
        "least_spacing": (2.0, OFF),
        "reach": (0.0, OFF),
    },
    "newton": {
        "tolerance": (0.01,),
        "iterations": (400,),
        "shifts": ((1e-5, 1e-5), OFF),
        "shift_factor": (1.0, OFF),
    },
    "search": {
        "patience": (40, OFF),
        "few": (1.0,),
    },
    "untangling": {
        "flat": (0.0, OFF),
        "hardly_folded": (0.0, OFF),
        "attraction": (1.0, OFF),
        "enough": (0.0, OFF),
        "many_folded": (1.0, OFF),
        "whole_steps": (0, OFF),
        "rounds": (1, OFF),
        "first_eps": ((1.0,), OFF),
        "starts": (1, OFF),
        "stuck": (0.0, OFF),
        "least_sigma": (0.0, OFF),
        "shares_back": ((1.0,), OFF),
    },
    "thin": {
        "thin": (0.0, OFF),
        "eps": (10.0,),
        "steep": (0.0, OFF),
        "steep_eps": (0.01,),
    },
    "interior": {
        "widths": ((0,), OFF),
        "rounds": (0, OFF),
        "patience": (100, OFF),
    },
    "folded": {
        "widths": ((), OFF, (0,)),
        "sharpness": ((64.0,), OFF),
        "floor": (0.0, OFF),
        "floor_weight": (0.0, OFF),
        "loss_weight": (0.0, OFF),
    },
    "unfolding": {
        "patience": (6, OFF),
        "wider_bounds": ((), OFF),
        "other_features": (0, OFF, 1),
        "return_steepness": (200.0, OFF),
    },
    "minimization": {
        "handover": (1000, OFF),
        "newton_gradient": (1e-3,),
        "stall": (0.0, OFF),
        "few_steps": (0, OFF),
        "rapid": (1.0, OFF),
        "proportion_weight": (0.0, OFF),
        "slender": (5.0, 10.0),
        "slenderest": (6.0, 24.0),
        "least_slender": (1.5, 3.0),
        "least_volume": (0.0, OFF),
        "volume_weight": (0.0, OFF),
        "sizes_weight": (0.0, OFF),
        "target_sizes_factor": (1.0, OFF),
    },
    "worst_cells": {
        "distortion_share": (0.0, OFF),
        "reopened": (0.0, OFF, 0.5),
        "opened": (0.05, 0.2),
        "reopenings": (0, OFF),
        "stiffness": (0.0, OFF),
        "angle_steps": (0, OFF),
        "stiff_steps": (0, OFF),
        "patch_steps": (1,),
        "patch_passes": (1,),
        "patch_rounds": (0, OFF),
        "margin": (0.0, OFF),
        "spared": (1.0, OFF),
        "rings": (1,),
        "poor": (0.0, OFF, 0.5),
        "worth": (1.0, OFF),
        "many_cells": (0, OFF),
    },
    "returning": {
        "rounds": (0, OFF),
        "watches": (0, OFF),
        "keeping": (0, OFF, 8),
        "slow": (0.0, OFF),
        "steeper": (1.0, OFF),
        "untightened": (0, 3),
        "tighter": (1.0, OFF),
        "rings_back": ((), OFF),
        "shares_back": ((), OFF),
    },
    "volume": {
        "drift": (1.0, OFF),
        "halvings": (0, OFF),
        "stiffness": (0.0, OFF),
        "shift": (0.0, OFF),
        "watches": (0, OFF),
    },
    "compatible": {
        "stall": (0.0, OFF),
        "nearly": (0.0, 1.0, OFF),
    },
}


@dataclass(frozen=True)
class Case:
    """A mesh and the options of its runs."""

    name: str
    mesh: Any
    options: hc.Options
    folded: bool


@dataclass(frozen=True)
class Figures:
    """What a run comes to; distances in bounds."""

    points: Any
    smallest: float
    mean: float
    inverted: int
    distance: float
    cpu: float


def rare() -> Iterator[tuple[str, Any, dict[str, Any]]]:
    """Names, meshes and options of generated inputs."""
    points, cells = box((3, 3, 3))
    noise = np.random.default_rng(4936).uniform(-0.45, 0.45, points.shape)
    yield "folded inside", (3 * points + noise, cells), {"boundary": "fixed"}
    tangled = jittered(*cylinder(2, 2, 3), 0.5, seed=1, keep_boundary=False, valid=False)
    yield "tangled", tangled, {}
    yield "tangled, tight", tangled, {"hausdorff": 1e-3}
    yield "tangled, fixed", tangled, {"boundary": "fixed"}
    yield "tangled ball", jittered(*ball(2, 2), 0.7, seed=4, keep_boundary=False, valid=False), {}
    yield "thin wall", pipe(0.06), {}
    yield "thin wall, wide", pipe(0.06), {"hausdorff": 0.05, "conserve_volume": True}
    yield "thin cells, fixed", jittered(*box((48, 48, 48)), 0.25, seed=2), {"boundary": "fixed"}
    rough = jittered(*ball(3, 2), 0.3, seed=1)
    yield "tight", rough, {"hausdorff": 2e-4}
    yield "tight, volume", rough, {"hausdorff": 1e-3, "conserve_volume": True}
    yield "warped", twisted_cube(2, 100.0), {"hausdorff": 0.02}
    yield "coarse", jittered(*cylinder(1, 1, 2), 0.3, seed=1, keep_boundary=False), {"hausdorff": 0.03}
    yield "mean", rough, {"emphasis": "mean"}
    yield "mean, fixed", jittered(*twisted_cube(8), 0.3, seed=1), {"emphasis": "mean", "boundary": "fixed"}
    graded = jittered(*cylinder(3, 2, 4), 0.3, seed=1)
    volumes = hc.quality(graded).volume.mean() * np.geomspace(0.5, 2.0, len(graded[1]))
    yield "sizes", graded, {"sizes": volumes}
    yield "majorized", rough, {"energy": "quaternionic", "method": "majorize"}
    bar = jittered(*bent_bar((16, 4, 4), 120), 0.3, seed=2)
    constrained = {"constraint": "compatible", "hausdorff": 0.02, "emphasis": "mean"}
    yield "constrained", bar, constrained
    yield "constrained, quaternionic", bar, constrained | {"energy": "quaternionic"}


def pipe(thickness: float) -> tuple[Any, Any]:
    """Half of a pipe, its wall thin and rough."""
    sizes = np.pi, thickness, 1.0
    points, cells = jittered(*box((16, 2, 6), sizes), 0.3, seed=1, keep_boundary=False)
    angle, radius = points[:, 0], 1.0 - points[:, 1]
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), points[:, 2]]), cells


def cases(folder: Path, largest: int) -> list[Case]:
    """Meshes of a folder, then the rare ones."""
    read: list[tuple[str, Any, dict[str, Any]]] = [(name, hc.read(source), {}) for name, source in meshes(folder)]
    found = [(name, mesh, options) for name, mesh, options in read if len(mesh.cells) <= largest]
    found += [(name, hc.as_hex_mesh(mesh), options) for name, mesh, options in rare()]
    return [
        Case(name, mesh, hc.Options(**options), not is_valid(mesh.points, mesh.cells).all())
        for name, mesh, options in found
    ]


def figures(case: Case, schedules: Schedules) -> Figures:
    """Run a case."""
    begun = time.process_time()
    run = hc.Regularization(case.mesh, case.options, schedules)
    for _ in run:
        pass
    result = run.result()
    seconds, after = time.process_time() - begun, result.report.after
    bound, reached = result.report.hausdorff_bound, result.report.hausdorff
    distance = reached / bound if bound and reached is not None else 0.0
    quality = after.scaled_jacobian
    return Figures(result.points, quality.min, quality.mean, after.inverted, distance, seconds)


def concerns(schedule: str, number: str, case: Case) -> bool:
    """True where a number of a schedule may matter to a case, and it is worth its time."""
    if schedule in FOR_FOLDED:
        return case.folded
    if schedule == "volume" and number == "drift":
        return case.options.boundary == "slide"
    if schedule in ("volume", "compatible"):
        return case.options.conserve_volume if schedule == "volume" else case.options.constraint == "compatible"
    return not case.name.startswith("tangled")


def row(schedule: str, number: str, value: Any, off: bool, default: dict[str, Figures], these: list[Case]) -> str:
    """A row of the table."""
    schedules = Schedules()
    stage = getattr(schedules, schedule)
    other = replace(schedules, **{schedule: replace(stage, **{number: value})})
    found = {case.name: figures(case, other) for case in these}
    changed = sum(not np.array_equal(found[name].points, default[name].points) for name in found)
    columns = [
        f"`{schedule}.{number}`",
        shown(getattr(stage, number)),
        shown(value) + " (off)" * off,
        f"{changed} of {len(found)}",
    ]
    for measure in ("smallest", "mean"):
        gains = {name: getattr(found[name], measure) - getattr(default[name], measure) for name in found}
        for pick, sign in ((min, -1.0), (max, 1.0)):
            name = pick(gains, key=gains.__getitem__)
            columns.append(f"{gains[name]:+.3f} {name}" if sign * gains[name] >= 5e-4 else "")
    more = sum(found[name].inverted - default[name].inverted for name in found)
    cpu = sum(one.cpu for one in found.values()) / sum(default[name].cpu for name in found)
    columns += [f"{more:+d}" if more else "", f"{max(one.distance for one in found.values()):.2f}", f"{cpu:.2f}"]
    return f"| {' | '.join(columns)} |"


def shown(value: Any) -> str:
    """A number, or a tuple of them."""
    return f"({', '.join(f'{x:g}' for x in value)})" if isinstance(value, tuple) else f"{value:g}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("meshes", type=Path, help="a folder of hexahedral meshes")
    parser.add_argument("--largest", type=int, default=3000, help="cells of the largest mesh that is taken (3000)")
    parser.add_argument("--only", nargs="*", help="schedules, or schedule.number")
    asked = parser.parse_args()
    load, these = os.getloadavg(), cases(asked.meshes, asked.largest)
    default, rows = {}, []
    for case in these:
        figures(case, Schedules())  # what it needs is compiled, or loaded
        default[case.name] = one = figures(case, Schedules())
        rows.append(
            f"| {case.name} | {len(case.mesh.cells)} | {one.smallest:.3f} | {one.mean:.3f} | {one.inverted} "
            f"| {one.distance:.2f} | {one.cpu:.1f} |"
        )
        print(rows[-1], flush=True)
    defaults, rows = "\n".join(rows), []
    for schedule, numbers in VALUES.items():
        for number, values in numbers.items():
            if asked.only and not {schedule, f"{schedule}.{number}"} & set(asked.only):
                continue
            concerned = [case for case in these if concerns(schedule, number, case)]
            for k, value in enumerate(values):
                if value != OFF:
                    rows.append(row(schedule, number, value, OFF in values[k + 1 : k + 2], default, concerned))
                    print(rows[-1], flush=True)
    if not asked.only:
        table = "\n".join([HEADER, *rows])
        TABLE.write_text(PAGE.format(defaults=defaults, table=table, machine=described(load)))


if __name__ == "__main__":
    main()
