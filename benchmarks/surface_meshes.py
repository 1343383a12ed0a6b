"""Remeshing of real surfaces with the defaults: angles, what turned over, how well the shape is kept, and the cost.

    python benchmarks/surface_meshes.py spot.ply cow.obj ...    # writes benchmarks/surface_meshes.md

"Again" is how much farther the nodes go if the result is remeshed once more, at the most, in mean edge lengths: its
bounds on area and distance then count from the result, so where they held nodes there may be a second gain.
"""

from __future__ import annotations

import argparse
import os
import time
from pathlib import Path

import numpy as np
from machine import described

import surface
from hexconformal.geometry import mean_edge_length

HEADER = (
    "| surface | cells | min / mean angle: input | result | turned over | area by | volume by | distance: largest | "
    "mean | iterations | CPU s / iteration | again | ended |"
)


def line(path: Path) -> str:
    """One line of the table."""
    mesh = surface.read(path)
    began = time.process_time()
    result = surface.remesh(mesh)
    cpu = time.process_time() - began
    report = result.report
    again = surface.remesh(result.mesh).points - result.points
    farther = np.linalg.norm(again, axis=1).max() / mean_edge_length(result.points, mesh.cells)
    volume = "open" if report.volume_change is None else f"{report.volume_change:+.0e}"
    angles = [f"{part.min_angle:.1f} / {part.mean_angle:.1f}" for part in (report.before, report.after)]
    return (
        f"| {path.stem} | {report.before.count} | {angles[0]} | {angles[1]} | {report.turned} | "
        f"{report.area_change:+.2%} | {volume} | {report.hausdorff:.2%} | {report.mean_distance:.1e} | "
        f"{report.iterations} | {cpu / max(report.iterations, 1):.2f} | {farther:.1g} | {report.reason} |"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("meshes", type=Path, nargs="+")
    arguments = parser.parse_args()
    load = os.getloadavg()
    surface.remesh((np.eye(4, 3), [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]), max_iterations=2)  # compiled first
    lines = ["# Surfaces: real meshes, defaults", "", described(load), "", HEADER, "|--|" + "--:|" * 11 + "--|"]
    for path in arguments.meshes:
        lines.append(line(path))
        print(lines[-1], flush=True)
    Path(__file__).with_suffix(".md").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
