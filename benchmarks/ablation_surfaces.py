"""What each mechanism of remeshing does: switched off one at a time, real surfaces, the change of the angles.

    python benchmarks/ablation_surfaces.py statue.ply spot.ply ...    # writes benchmarks/ablation_surfaces.md

A row is named after a schedule of ``surface.remeshing.schedules`` and a number of it, with the value it has there. A
cell is the change of smallest and mean angle in degrees; "=" where not a single coordinate changes, and marked where
cells are turned over or the bound is not kept. The last column is the time of all, over that of the defaults.
"""

from __future__ import annotations

import argparse
import os
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from machine import described
from numpy.typing import NDArray

import surface
from surface.remeshing import Report, Schedules

LARGE = 1e300
# Values with which a mechanism does nothing, or as little as it can.
OFF: dict[str, dict[str, Any]] = {
    "problem": {
        "mean_m": LARGE, "mean_c": 0.0, "max_growth": LARGE, "max_force": LARGE, "max_curvature": LARGE,
        "area_reached": 1.0, "area_tolerance": 1.0, "projected_tolerance": 1e-3,
    },
    "step": {
        "uniform_tries": 0, "max_rises": 0, "max_damped": 1.0, "min_damping": 1.0, "max_damping": 1e6,
        "damping_decay": 0.0, "area_rounding": 1e-6,
    },
    "continuation": {
        "first_cap": 100.0, "final_cap": 1e4, "first_factor": 1.0, "slow_decrease": 0.5, "late_decrease": 0.0,
        "normals_rise": LARGE, "stalled_steps": 100, "stalled_energy": 1000,
    },
    "restart": {"restarts": 0, "first_patience": 1, "patience": 10},
    "pull_back": {"rings": (), "shares": ()},
    "approach": {"max_steps": 0, "knee": 1e6, "gain": 0.0, "emphasis": 1.0, "least_gain": 0.0},
    "acceptance": {"far_share": 1.0},
}  # fmt: skip


@dataclass(frozen=True)
class Outcome:
    """What came of one surface."""

    points: NDArray[np.float64]
    report: Report


def outcome(mesh: Any, schedules: Schedules) -> Outcome:
    """Remesh with other numbers."""
    run = surface.Remeshing(mesh, schedules=schedules)
    for _ in run:
        pass
    result = run.result()
    return Outcome(result.points, result.report)


def compared(now: Outcome, usual: Outcome) -> str:
    """One cell of the table."""
    if np.array_equal(now.points, usual.points):
        return "="
    after, before = now.report.after, usual.report.after
    text = f"{after.min_angle - before.min_angle:+.1f} / {after.mean_angle - before.mean_angle:+.2f}"
    text += f", {now.report.turned} turned" if now.report.turned else ""
    return text + (", too far" if now.report.hausdorff > surface.Options.hausdorff else "")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("meshes", type=Path, nargs="+")
    parser.add_argument("--only", nargs="+", help="schedules or schedule.number; prints instead of writing")
    arguments = parser.parse_args()
    load, meshes = os.getloadavg(), [surface.read(path) for path in arguments.meshes]
    surface.remesh((np.eye(4, 3), [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]), max_iterations=2)  # compiled first
    began = time.process_time()
    usual = [outcome(mesh, Schedules()) for mesh in meshes]
    whole = time.process_time() - began
    names = [path.stem for path in arguments.meshes]
    angles = [f"{x.report.after.min_angle:.1f} / {x.report.after.mean_angle:.2f}" for x in usual]
    lines = ["# Surfaces: each mechanism of remeshing switched off", "", described(load), ""]
    lines += ["Change of the smallest and the mean angle, degrees; = where nothing changes.", ""]
    lines += ["| schedule.number | off | " + " | ".join(names) + " | time |", "|--|--:|" + "--:|" * (len(names) + 1)]
    lines += ["| defaults | | " + " | ".join(angles) + f" | {whole:.0f} s |"]
    print(*lines, sep="\n", flush=True)
    for part, numbers in OFF.items():
        for name, value in numbers.items():
            if arguments.only and not {part, f"{part}.{name}"} & set(arguments.only):
                continue
            changed = replace(getattr(Schedules(), part), **{name: value})
            began = time.process_time()
            now = [outcome(mesh, replace(Schedules(), **{part: changed})) for mesh in meshes]
            spent = time.process_time() - began
            cells = " | ".join(compared(*both) for both in zip(now, usual, strict=True))
            shown = "none" if value in (LARGE, ()) else value
            lines.append(f"| {part}.{name} | {shown} | {cells} | {spent / whole:.1f} |")
            print(lines[-1], flush=True)
    if not arguments.only:
        Path(__file__).with_suffix(".md").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
