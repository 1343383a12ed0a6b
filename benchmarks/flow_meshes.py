"""Flows of real meshes, with remeshing: energy, angles, what is conserved, and the cost of a step.

    python benchmarks/flow_meshes.py --flow willmore spot.ply cow.obj ...   # and meshes made here
    python benchmarks/flow_meshes.py --flow mean-curvature --conserve volume --steps 110 head.ply --both

Appends a table to benchmarks/flow_meshes.md. "Rises" counts the steps that raised the energy (there must be none),
"turned" cells whose normal points against those around, in the input and the most at any step; "remeshing" is the sum
of its jumps of the energy.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
from machine import described

import surface
from hexconformal.geometry import Faces, face_area_vectors, nodal_area_vectors, unit_vectors
from surface.flow import Evolution, Flow, MeanCurvature, Stepping, Willmore
from surface.mesh import Floats

sys.path.append(str(Path(__file__).parents[1] / "tests"))
from meshes.surfaces import scattered_sphere

FLOWS: dict[str, type[Flow]] = {"willmore": Willmore, "mean-curvature": MeanCurvature}
HEADER = (
    "| surface | cells | energy | remeshing | rises | turned | min / mean angle: input | step 1 | step 10 | end | "
    "kept to | CPU s a step: first | mean | largest | ended |"
)


def potato(n: int = 2000, seed: int = 3) -> Any:
    """A lumpy ball of points at random: valences from 3 to 11, and slivers."""
    points, triangles = scattered_sphere(n, seed)
    a, b, c = points.T
    lumps = 1 + 0.25 * np.sin(3 * a + 1) * np.cos(3 * b) + 0.2 * np.sin(4 * c + a)
    return points * lumps[:, None] * [1.0, 1.2, 1.6], triangles


def sheared_torus(n: int = 72, m: int = 28, seed: int = 0) -> Any:
    """A torus of quadrilaterals with a wavy tube, sheared along itself, its nodes shaken."""
    rng = np.random.default_rng(seed)
    u, v = np.meshgrid(2 * np.pi * np.arange(n) / n, 2 * np.pi * np.arange(m) / m, indexing="ij")
    r = 1 + 0.25 * np.cos(3 * u)
    v = v + 0.8 * np.sin(u) + 0.4 * np.pi / m * rng.uniform(-1, 1, v.shape)
    u = u + 0.4 * np.pi / n * rng.uniform(-1, 1, u.shape)
    ring = 2.6 + r * np.cos(v)
    points = np.stack([ring * np.cos(u), ring * np.sin(u), r * np.sin(v)], axis=2).reshape(-1, 3)
    i = np.arange(n * m).reshape(n, m)
    j, k, s = np.roll(i, -1, 0), np.roll(i, (-1, -1), (0, 1)), np.roll(i, -1, 1)
    return points, np.stack([i, j, k, s], axis=2).reshape(-1, 4)


MADE = {"potato": potato, "sheared torus": sheared_torus}


def upside_down(points: Floats, cells: Faces) -> int:
    """Number of cells whose normal points against the sum of those at its nodes."""
    normals = unit_vectors(nodal_area_vectors(points, cells))
    around = np.concatenate([normals[table].sum(axis=1) for table in (cells.triangles, cells.quads)])
    return int(((face_area_vectors(points, cells) * around).sum(axis=1) <= 0).sum())


def followed(name: str, flow: Flow, stepping: Stepping) -> str:
    """A row of the table."""
    run = Evolution(flow, stepping)
    records, costs, turned, rises = [], [], 0, 0
    began = time.process_time()
    for moment in run:
        costs.append(time.process_time() - began)
        if records:
            turned = max(turned, upside_down(moment.points, run.mesh.cells))
            jump = np.nan_to_num(moment.record.remesh_jump)
            rises += moment.record.energy > (records[-1].energy + jump) * (1 + 1e-12)
        records.append(moment.record)
        began = time.process_time()
    first, last = records[0], records[-1]
    angles = [f"{r.min_angle:.1f} / {r.mean_angle:.1f}" for r in (first, records[1], records[min(10, last.step)], last)]
    jumps = np.nansum([record.remesh_jump for record in records])
    kept = f"{max(record.conserved_error for record in records):.0e}" if flow.conserve else ""
    over = upside_down(run.mesh.points, run.mesh.cells)
    ended = "" if run.reason.startswith("reached") else f"step {last.step}: {run.reason}"
    return (
        f"| {name} | {len(run.mesh.cells)} | {first.energy:.5g} to {last.energy:.5g} | {jumps:+.2g} | {rises} | "
        f"{over}, {turned} | {' | '.join(angles)} | {kept} | {costs[1]:.1f} | {np.mean(costs[2:]):.2f} | "
        f"{max(costs[2:]):.2f} | {ended} |"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("meshes", type=Path, nargs="*", help="closed surfaces; those made here come without any")
    parser.add_argument("--flow", choices=sorted(FLOWS), default="willmore")
    parser.add_argument("--conserve", nargs="*", default=(), choices=("area", "volume"))
    parser.add_argument("--steps", type=int, default=100)
    parser.add_argument("--tau-max", type=float, default=float("inf"))
    parser.add_argument("--both", action="store_true", help="without remeshing as well")
    parser.add_argument("--made", action="store_true", help="the meshes made here as well")
    arguments = parser.parse_args()
    load = os.getloadavg()
    surfaces: dict[str, Any] = {path.stem: path for path in arguments.meshes}
    if arguments.made or not surfaces:
        surfaces.update({name: make() for name, make in MADE.items()})
    surface.remesh(potato(200), max_iterations=2)  # compiled before anything is timed
    kept = f" of constant {' and '.join(arguments.conserve)}" if arguments.conserve else ""
    capped = f", time step at most {arguments.tau_max:g}" if np.isfinite(arguments.tau_max) else ""
    lines = [f"## {arguments.flow} flow{kept}, {arguments.steps} steps{capped}", "", described(load), ""]
    lines += [HEADER, "|--|" + "--:|" * 13 + "--|"]
    for name, mesh in surfaces.items():
        for remesh in (True, False) if arguments.both else (True,):
            flow = FLOWS[arguments.flow](mesh, conserve=arguments.conserve)
            stepping = Stepping(steps=arguments.steps, stall=0.0, remesh=remesh, tau_max=arguments.tau_max)
            lines.append(followed(name if remesh else f"{name}, not remeshed", flow, stepping))
            print(lines[-1], flush=True)
    with Path(__file__).with_suffix(".md").open("a") as table:
        table.write("\n".join(lines) + "\n\n")


if __name__ == "__main__":
    main()
