"""Mesh quality along mean curvature flow: no remeshing, Barrett-Garcke-Nuernberg's tangential motion, ours.

    python benchmarks/flows.py            # writes benchmarks/flows.md; some minutes

All follow the same surface with the same fixed time steps. The area is compared with that of BGN on a mesh of
four times as many cells and a quarter of the step, extrapolated once (h^2 + tau).
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from machine import described
from scipy import sparse
from scipy.sparse.linalg import splu

from hexconformal.geometry import Faces, enclosed_volume, face_areas, nodal_area_vectors, nodal_areas
from surface.flow import MeanCurvature, evolve
from surface.mesh import Floats
from surface.quality.assessment import smallest_angles

HEADER = "| surface | flow | method | min angle on the way | min / mean angle at the end | area | volume | CPU s |"
NO_QUADS = np.empty((0, 4), dtype=np.int64)


def icosphere(level: int) -> tuple[Floats, np.ndarray]:
    import pyvista as pv

    sphere = pv.Icosphere(nsub=level)
    points = np.asarray(sphere.points, dtype=np.float64)
    return points / np.linalg.norm(points, axis=1, keepdims=True), sphere.regular_faces.astype(np.int64)


def dumbbell(level: int) -> tuple[Floats, np.ndarray]:
    points, triangles = icosphere(level)
    waist = 0.55 + 0.45 * np.minimum(np.abs(points[:, 0]) / 0.6, 1.0) ** 2
    return np.stack([2 * points[:, 0], waist * points[:, 1], waist * points[:, 2]], axis=1), triangles


def bumpy(level: int) -> tuple[Floats, np.ndarray]:
    points, triangles = icosphere(level)
    x, y, z = points.T
    return points * (1 + 0.35 * np.sin(4 * x) * np.cos(3 * y) * np.sin(2 * z + 1))[:, None], triangles


SURFACES = {"dumbbell": (dumbbell, 0.06), "bumpy sphere": (bumpy, 0.03)}


def tangential(points: Floats, triangles: np.ndarray, tau: float, steps: int, volume: bool) -> Iterator[Floats]:
    """Mean curvature flow of Barrett, Garcke & Nuernberg, J. Comput. Phys. 227 (2008): nodes move along the surface.

    Find X and kappa with <(X - X_old) / tau, chi w>_h - <kappa, chi>_h = 0 and <kappa w, eta>_h + <dX, d eta> = 0,
    w the nodal normals; with the mean of the old kappa taken off where the volume is kept (theirs, to first order).
    """
    cells = Faces(triangles, NO_QUADS)
    count = len(points)
    mean = 0.0
    for _ in range(steps):
        masses = nodal_areas(points, cells)
        w = nodal_area_vectors(points, cells)  # masses times normals
        x = points[triangles]
        edges = [x[:, (i + 2) % 3] - x[:, (i + 1) % 3] for i in range(3)]
        area = np.linalg.norm(np.cross(edges[0], edges[1]), axis=1) / 2
        rows, columns, values = [], [], []
        for i in range(3):
            for j in range(3):
                rows.append(triangles[:, i])
                columns.append(triangles[:, j])
                values.append((edges[i] * edges[j]).sum(axis=1) / (4 * area))
        flat = (np.concatenate(rows), np.concatenate(columns))
        stiffness = sparse.csr_matrix((np.concatenate(values), flat), shape=(count, count))
        normal = sparse.csr_matrix((w.T.ravel(), (np.tile(np.arange(count), 3), np.arange(3 * count))))
        matrix = sparse.bmat(
            [[normal / tau, -sparse.diags_array(masses)], [sparse.kron(np.eye(3), stiffness), normal.T]]
        )
        load = (w * points).sum(axis=1) / tau - (mean * masses if volume else 0.0)
        found = splu(matrix.tocsc()).solve(np.concatenate([load, np.zeros(3 * count)]))
        points, kappa = found[: 3 * count].reshape(3, count).T, found[3 * count :]
        mean = float((kappa * masses).sum() / masses.sum())
        yield points


def ours(remesh: bool) -> Callable[..., Iterator[Floats]]:
    def follow(points: Floats, triangles: np.ndarray, tau: float, steps: int, volume: bool) -> Iterator[Floats]:
        flow = MeanCurvature((points, triangles), "volume" if volume else ())
        moments = evolve(flow, steps=steps, tau=tau, growth=1.0, stall=0.0, remesh=remesh)
        next(moments)
        return (moment.points for moment in moments)

    return follow


METHODS = {"none": ours(False), "BGN": tangential, "ours": ours(True)}


@dataclass(frozen=True)
class Outcome:
    area: float
    volume: float
    lowest: float
    smallest: float
    mean: float
    cpu: float


def outcome(
    method: str, make: Callable[[int], tuple[Floats, np.ndarray]], level: int, end: float, steps: int, volume: bool
) -> Outcome:
    points, triangles = make(level)
    cells = Faces(triangles, NO_QUADS)
    start = enclosed_volume(points, cells)
    lowest = np.inf
    began = time.process_time()
    for points in METHODS[method](points, triangles, end / steps, steps, volume):
        lowest = min(lowest, float(smallest_angles(points, cells).min()))
    cpu = time.process_time() - began
    angles = smallest_angles(points, cells)
    area = float(face_areas(points, cells).sum())
    return Outcome(
        area, enclosed_volume(points, cells) / start - 1, lowest, float(angles.min()), float(angles.mean()), cpu
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--level", type=int, default=3, help="subdivisions of the icosahedron (default 3)")
    parser.add_argument("--steps", type=int, default=20)
    arguments = parser.parse_args()
    load = os.getloadavg()
    lines = [HEADER, "|" + "--|" * 3 + "--:|" * 5]
    for name, (make, end) in SURFACES.items():
        for volume in (False, True):
            fine = [outcome("BGN", make, arguments.level + k, end, arguments.steps * 4**k, volume).area for k in (0, 1)]
            exact = fine[1] + (fine[1] - fine[0]) / 3
            for method in METHODS:
                found = outcome(method, make, arguments.level, end, arguments.steps, volume)
                kept = f"{found.volume:+.1e}" if volume else ""
                lines.append(
                    f"| {name} | {'volume kept' if volume else 'free'} | {method} | {found.lowest:.1f} | "
                    f"{found.smallest:.1f} / {found.mean:.1f} | {found.area / exact - 1:+.2%} | {kept} | "
                    f"{found.cpu:.1f} |"
                )
                print(lines[-1], flush=True)
    table = "\n".join(lines)
    head = f"Icosahedron, {arguments.level} times subdivided, {arguments.steps} steps."
    Path(__file__).with_suffix(".md").write_text(f"{described(load)}\n\n{head}\n\n{table}\n")


if __name__ == "__main__":
    main()
