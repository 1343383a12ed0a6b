"""How good the angles of a mesh can be that a flow takes to a surface of another conformal class.

    python benchmarks/conformal_class.py double_torus.ply ...   # after a thin torus made here

A mesh has a conformal class of its own, in which every cell is regular, and a map from there to the surface it is on
has dilatation K (ratio of the principal stretches, 1 for a regular cell). The Dirichlet energies E and E' of the
harmonic one-form of a cohomology class, on the regular cells and on the surface, bound it from below: the mean of K,
weighted by the density of the form, is at least E / E' (and E' / E); the largest such ratio over all classes is an
eigenvalue. Surfaces without handles have no such forms and no such bound.

Appends a table to benchmarks/flow_meshes.md: along a Willmore flow the angles it has, the best that remeshing alone
reaches from there, the bound of K, and the smallest angle of a regular triangle stretched by that, across an edge or
along one.
"""

from __future__ import annotations

import argparse
import os
from collections import deque
from pathlib import Path
from typing import Any

import numpy as np
from machine import described
from scipy import sparse
from scipy.linalg import eigh
from scipy.sparse.linalg import splu

import surface
from surface.flow import Evolution, Moment, Stepping, Willmore
from surface.mesh import Floats, Ints

HEADER = "| surface | step | time | energy | angles | by remeshing alone | K at least | a triangle stretched by K |"
REGULAR = {3: 1 / np.sqrt(3) * np.ones(3), 4: np.array([1.0, 0.0, 1.0])}  # cotangents; halves of squares


def thin_torus(n: int = 144, m: int = 24) -> tuple[Floats, Ints]:
    """A torus five times as wide as its tube, of triangles that are nearly regular; Willmore flow makes it stout."""
    i = np.arange(n * m).reshape(n, m)
    j, k, r = np.roll(i, -1, 0), np.roll(i, (-1, -1), (0, 1)), np.roll(i, -1, 1)
    u, v = 2 * np.pi * (i // m) / n, 2 * np.pi * (i % m + (i // m) / 2) / m
    ring = 5 + np.cos(v)
    points = np.stack([ring * np.cos(u), ring * np.sin(u), np.sin(v)], axis=2).reshape(-1, 3)
    return points, np.concatenate([np.stack(t, axis=2).reshape(-1, 3) for t in ((i, j, r), (j, k, r))])


def triangles_of(cells: Any) -> tuple[Ints, Floats]:
    """(t, 3) triangles, quadrilaterals halved, and the cotangents of their corners if the cells were regular."""
    halves = np.concatenate([cells.quads[:, [0, 1, 2]], cells.quads[:, [2, 3, 0]]])
    shapes = [np.tile(REGULAR[3], (len(cells.triangles), 1)), np.tile(REGULAR[4], (len(halves), 1))]
    return np.concatenate([cells.triangles, halves]), np.concatenate(shapes)


def cotangents(points: Floats, triangles: Ints) -> Floats:
    """(t, 3) cotangents of the corners."""
    x = points[triangles]
    a, b = np.roll(x, -1, axis=1) - x, np.roll(x, -2, axis=1) - x
    return np.asarray((a * b).sum(axis=2) / np.linalg.norm(np.cross(a, b), axis=2))


def edges_of(triangles: Ints) -> tuple[Ints, Ints, Ints]:
    """(e, 2) edges; (t, 3) of each triangle the edge from corner i to the next, and whether it goes along (1, -1)."""
    ends = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2)
    edges, place = np.unique(np.sort(ends, axis=2).reshape(-1, 2), axis=0, return_inverse=True)
    return edges, place.reshape(-1, 3), np.where(ends[..., 0] < ends[..., 1], 1, -1)


def spanning(count: int, links: list[tuple[int, int, int]]) -> dict[int, tuple[int, int]]:
    """Parent and edge of every node but the first, in a spanning tree; links are (node, node, edge)."""
    near: list[list[tuple[int, int]]] = [[] for _ in range(count)]
    for a, b, edge in links:
        near[a].append((b, edge))
        near[b].append((a, edge))
    parents, queue = {}, deque([0])
    while queue:
        a = queue.popleft()
        for b, edge in near[a]:
            if b != 0 and b not in parents:
                parents[b] = a, edge
                queue.append(b)
    return parents


def closed_forms(triangles: Ints, count: int) -> Floats:
    """(2 g, e) closed forms that span the cohomology: each counts crossings with a loop of triangles."""
    edges, place, along = edges_of(triangles)
    order = np.argsort(place.ravel(), kind="stable")
    sides = np.stack([order[::2] // 3, order[1::2] // 3], axis=1)  # the two triangles of each edge
    signs = along.ravel()[order].reshape(-1, 2)
    tree = {edge for _, edge in spanning(count, [(a, b, k) for k, (a, b) in enumerate(edges.tolist())]).values()}
    links = [(a, b, k) for k, (a, b) in enumerate(sides.tolist()) if k not in tree]
    parents = spanning(len(triangles), links)
    cotree = {edge for _, edge in parents.values()}
    forms = []
    for start in (k for *_, k in links if k not in cotree):
        form = np.zeros(len(edges))
        form[start] += signs[start, 0]
        for triangle, sense in ((int(sides[start, 1]), 1), (int(sides[start, 0]), -1)):
            while triangle in parents:
                parent, edge = parents[triangle]
                form[edge] += sense * signs[edge, 0 if sides[edge, 0] == triangle else 1]
                triangle = parent
        forms.append(form)
    return np.array(forms)


def energies(forms: Floats, triangles: Ints, cotangent: Floats, count: int) -> Floats:
    """(2 g, 2 g) inner products of the harmonic forms, linear elements."""
    edges, place, _ = edges_of(triangles)
    weights = np.bincount(place.ravel(), np.roll(cotangent, -2, axis=1).ravel() / 2, len(edges))
    rows = np.repeat(np.arange(len(edges)), 2)
    derivative = sparse.csr_matrix((np.tile([-1.0, 1.0], len(edges)), (rows, edges.ravel())), (len(edges), count))
    star = sparse.diags_array(weights)
    laplacian = (derivative.T @ star @ derivative).tolil()
    laplacian[0, 0] += 1.0  # one value is free
    exact = derivative @ splu(laplacian.tocsc()).solve(derivative.T @ star @ forms.T)
    harmonic = forms.T - exact
    return np.asarray(harmonic.T @ star @ harmonic)


def least_dilatation(points: Floats, cells: Any) -> float:
    """K that no mesh with these cells falls below in the mean on this surface, with the form that says most."""
    triangles, regular = triangles_of(cells)
    forms = closed_forms(triangles, len(points))
    ours = energies(forms, triangles, regular, len(points))
    surfaces = energies(forms, triangles, cotangents(points, triangles), len(points))
    ratios = eigh(ours, surfaces, eigvals_only=True)
    return float(max(ratios.max(), 1 / ratios.min()))


def reached(mesh: Any) -> str:
    """Angles that remeshing alone comes to."""
    means = [
        surface.remesh(mesh, emphasis=e, feature_angle=None, energy_tolerance=1e-6).history for e in ("mean", "worst")
    ]
    best = max(max(record.mean_angle for record in history) for history in means)
    smallest = max(max(record.min_angle for record in history) for history in means)
    return f"{smallest:.1f} / {best:.1f}"


def row(name: str, run: Evolution, moment: Moment) -> str:
    """A line of the table."""
    record, dilatation = moment.record, least_dilatation(moment.points, run.mesh.cells)
    across, along = np.degrees([2 * np.arctan(1 / np.sqrt(3) / dilatation), np.arctan(np.sqrt(3) / dilatation)])
    stretched = f"{across:.1f} to {along:.1f}" if len(run.mesh.cells.triangles) else ""
    return (
        f"| {name} | {record.step} | {record.time:.2g} | {record.energy:.4g} | "
        f"{record.min_angle:.1f} / {record.mean_angle:.1f} | {reached(run.mesh.replaced(moment.points))} | "
        f"{dilatation:.2f} | {stretched} |"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("meshes", type=Path, nargs="*", help="closed surfaces with handles")
    parser.add_argument("--steps", type=int, default=100)
    parser.add_argument("--every", type=int, default=10)
    arguments = parser.parse_args()
    lines = ["## Conformal class along Willmore flow", "", described(os.getloadavg()), "", HEADER, "|--|" + "--:|" * 7]
    surfaces: dict[str, Any] = {"thin torus": thin_torus(), **{path.stem: path for path in arguments.meshes}}
    for name, mesh in surfaces.items():
        run = Evolution(Willmore(mesh), Stepping(steps=arguments.steps, remesh=True))
        for moment in run:
            if moment.record.step % arguments.every == 0:
                lines.append(row(name, run, moment))
                print(lines[-1], flush=True)
        if moment.record.step % arguments.every:
            lines.append(row(name, run, moment))
    with Path(__file__).with_name("flow_meshes.md").open("a") as table:
        table.write("\n".join(lines) + "\n\n")


if __name__ == "__main__":
    main()
