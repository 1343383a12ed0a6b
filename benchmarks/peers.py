"""Other tools that install with pip, on the same mesh of linear cells: each moves the inner nodes, not the boundary.

* MFEM's ``mesh-optimizer``, compiled inside the ``mfem`` wheel: target-matrix optimization of the shape metric
  303, corner quadrature (Gauss-Lobatto of two points a direction), ideal targets, Newton's method; tangled
  meshes first with its untangling metric 313, whose derivatives are differences there, and L-BFGS. The mesh is
  scaled to edges of unit length, as differences want it, or, where they fail, of length .03.
* gmsh: ``Relocate3D``.
* VTK: ``vtkConstrainedSmoothingFilter``, boundary points held by the constraint array.

They live in an environment of their own (``pip install mfem gmsh vtk``), whose interpreter is handed in.
"""

from __future__ import annotations

import json
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from machine import run
from numpy.typing import NDArray

import hexconformal as hc
from hexconformal.elements import CELL_TYPES

__all__ = ["PEERS", "Answer", "Cells", "available", "last_words"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]
Cells = dict[str, Ints]  # of a mesh or of its boundary, by the name of their type in meshio

_FIND_MFEM = """
import importlib.util, pathlib
folders = importlib.util.find_spec("mfem").submodule_search_locations
print(next((str(p) for f in folders for p in sorted(pathlib.Path(f).rglob("mesh-optimizer"))), ""))
"""

_GMSH = """
import sys, gmsh, numpy as np
data = np.load(sys.argv[1])
points = data["points"]
gmsh.initialize(interruptible=False)
gmsh.option.setNumber("General.Verbosity", 1)
gmsh.model.addDiscreteEntity(2, 1)
gmsh.model.addDiscreteEntity(3, 1, [1])
kinds = {"triangle": (2, 2), "quad": (2, 3), "tetra": (3, 4), "hexahedron": (3, 5), "wedge": (3, 6), "pyramid": (3, 7)}
outer, inner = np.zeros((2, len(points)), bool)
for name in data.keys() & kinds:
    (outer if kinds[name][0] == 2 else inner)[data[name]] = True
inner &= ~outer
for dim, mask in ((2, outer), (3, inner)):
    gmsh.model.mesh.addNodes(dim, 1, np.flatnonzero(mask) + 1, points[mask].ravel())
count = 1
for name in data.keys() & kinds:
    rows = data[name]
    gmsh.model.mesh.addElementsByType(1, kinds[name][1], np.arange(count, count + len(rows)), (rows + 1).ravel())
    count += len(rows)
gmsh.model.mesh.optimize("Relocate3D", niter=10)
points = points.copy()
for dim, mask in ((2, outer), (3, inner)):  # in their order within an entity: it numbers the nodes anew
    points[mask] = gmsh.model.mesh.getNodes(dim, 1)[1].reshape(-1, 3)
np.save(sys.argv[2], points)
"""

_VTK = """
import sys, numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkUnstructuredGrid
from vtkmodules.vtkFiltersCore import vtkConstrainedSmoothingFilter
data = np.load(sys.argv[1])
points = data["points"]
kinds = {"tetra": 10, "hexahedron": 12, "wedge": 13, "pyramid": 14}
names = [name for name in kinds if name in data]
sizes = np.repeat([data[name].shape[1] for name in names], [len(data[name]) for name in names])
types = np.repeat([kinds[name] for name in names], [len(data[name]) for name in names]).astype(np.uint8)
nodes, offsets = np.concatenate([data[name].ravel() for name in names]), np.append(0, np.cumsum(sizes))
places, array, grid = vtkPoints(), vtkCellArray(), vtkUnstructuredGrid()
places.SetData(numpy_to_vtk(points, deep=True))
array.SetData(numpy_to_vtkIdTypeArray(offsets, deep=True), numpy_to_vtkIdTypeArray(nodes, deep=True))
grid.SetPoints(places)
grid.SetCells(numpy_to_vtk(types, deep=True), array)
reach = np.full(len(points), np.linalg.norm(np.ptp(points, axis=0)))
for name in ("triangle", "quad"):
    if name in data:
        reach[data[name]] = 0.0
limits = numpy_to_vtk(reach, deep=True)
limits.SetName("SmoothingConstraints")
grid.GetPointData().AddArray(limits)
smoother = vtkConstrainedSmoothingFilter()
smoother.SetInputData(grid)
smoother.SetConstraintStrategyToConstraintArray()
smoother.SetNumberOfIterations(100)
smoother.SetRelaxationFactor(0.1)
smoother.Update()
np.save(sys.argv[2], vtk_to_numpy(smoother.GetOutput().GetPoints().GetData()).astype(float))
"""


@dataclass(frozen=True)
class Answer:
    """What a tool made of a mesh: points (n, 3), or None and why; CPU seconds of its whole processes."""

    points: Field | None
    cpu: float
    note: str = ""


def available(python: str) -> tuple[dict[str, str], list[str]]:
    """The peers that an interpreter has, by name, with what runs them; and notes about those it has not."""
    found = run([python, "-c", _FIND_MFEM], 60.0)
    binary = found.output.strip() if found.code == 0 else ""
    here = {"mfem": binary} if binary else {}
    for name, module in (("gmsh", "gmsh"), ("vtk", "vtkmodules")):
        if run([python, "-c", f"import {module}"], 120.0).code == 0:
            here[name] = python
    return here, [f"{name} is not installed there: skipped" for name in PEERS if name not in here]


def mfem(binary: str, points: Field, cells: Cells, faces: Cells, limit: float) -> Answer:
    """Metric 303, after the untangling metric 313 where the mesh comes in tangled."""
    unit = float(np.mean(np.concatenate([_edge_lengths(points, name, rows) for name, rows in cells.items()])))
    answer = Answer(points, 0.0)
    if not _valid(points, cells):
        for edge in (1.0, 0.03):
            left = limit - answer.cpu
            tried = _optimized(binary, ["313", "-fd", "-st", "1"], edge / unit, points, cells, faces, left)
            answer = replace(tried, cpu=answer.cpu + tried.cpu)
            if answer.points is not None:
                break
        if answer.points is None:
            return answer
        if not _valid(answer.points, cells):
            return replace(answer, note="stays tangled")
    last = _optimized(binary, ["303"], 1.0 / unit, answer.points, cells, faces, limit - answer.cpu)
    return Answer(answer.points if last.points is None else last.points, answer.cpu + last.cpu, last.note)


def _optimized(
    binary: str, metric: list[str], scale: float, points: Field, cells: Cells, faces: Cells, limit: float
) -> Answer:
    """What a metric makes of the mesh, whose coordinates are scaled for that."""
    settings = ["-o", "1", "-tid", "1", "-qt", "1", "-qo", "1", "-fix-bnd", "-no-vis", "-ni", "200", "-rtol", "1e-6"]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        source, made = folder / "in.mesh", folder / "optimized.mesh"
        source.write_text(_mfem_mesh(scale * points, cells, faces))
        ended = run([binary, "-m", str(source), "-mid", *metric, *settings], max(limit, 1.0), folder)
        if ended.code != 0 or not made.exists():
            why = "over time" if ended.code is None else last_words(ended.output)
            return Answer(None, ended.cpu, f"metric {metric[0]}: {why}")
        return Answer(_mfem_points(made.read_text(), len(points)) / scale, ended.cpu)


def _edge_lengths(points: Field, name: str, cells: Ints) -> Field:
    ends = points[cells[:, CELL_TYPES[name].edges]]
    return np.linalg.norm(ends[:, :, 1] - ends[:, :, 0], axis=-1).ravel()


def _valid(points: Field, cells: Cells) -> bool:
    return bool(hc.quality((points, cells)).scaled_jacobian.min() > 0)


def last_words(text: str) -> str:
    """What a program said of its failure, in one line."""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    if any("IsFinite" in line for line in lines):
        return "not a number"
    said = next(
        (line for line in lines if "inverted" in line or "abort" in line.lower() or "error" in line.lower()), ""
    )
    return (said or (lines[-1] if lines else "no output"))[:60]


def _mfem_mesh(points: Field, cells: Cells, faces: Cells) -> str:
    kinds = {"triangle": 2, "quad": 3, "tetra": 4, "hexahedron": 5, "wedge": 6, "pyramid": 7}

    def table(blocks: Cells) -> str:
        rows = [f"1 {kinds[name]} " + " ".join(map(str, row)) for name in blocks for row in blocks[name].tolist()]
        return "\n".join([str(len(rows)), *rows])

    places = "\n".join(" ".join(f"{value:.17g}" for value in row) for row in points.tolist())
    return (
        f"MFEM mesh v1.0\n\ndimension\n3\n\nelements\n{table(cells)}\n\n"
        f"boundary\n{table(faces)}\n\nvertices\n{len(points)}\n3\n{places}\n"
    )


def _mfem_points(text: str, count: int) -> Field:
    head, _, tail = text.partition("FiniteElementSpace")
    if not tail:
        return np.array(head.partition("vertices")[2].split()[2:], dtype=float).reshape(count, 3)
    words, values = tail.partition("Ordering:")[2].split(maxsplit=1)
    flat = np.array(values.split()[: 3 * count], dtype=float)
    return flat.reshape(3, count).T.copy() if words == "0" else flat.reshape(count, 3)


def _scripted(script: str) -> Callable[[str, Field, Cells, Cells, float], Answer]:
    """A peer that is a few lines of Python in its own interpreter."""

    def peer(python: str, points: Field, cells: Cells, faces: Cells, limit: float) -> Answer:
        with tempfile.TemporaryDirectory() as folder:
            source, made = Path(folder) / "in.npz", Path(folder) / "out.npy"
            arrays: dict[str, Any] = {"points": points, **cells, **faces}
            np.savez(source, **arrays)
            ended = run([python, "-c", script, str(source), str(made)], limit)
            if ended.code != 0 or not made.exists():
                return Answer(None, ended.cpu, "over time" if ended.code is None else last_words(ended.output))
            return Answer(np.load(made), ended.cpu)

    return peer


PEERS: dict[str, Callable[[str, Field, Cells, Cells, float], Answer]] = {
    "mfem": mfem,
    "gmsh": _scripted(_GMSH),
    "vtk": _scripted(_VTK),
}

if __name__ == "__main__":
    print(json.dumps(available(sys.argv[1] if len(sys.argv) > 1 else sys.executable)))
