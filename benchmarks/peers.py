"""Other tools that install with pip, on the same mesh: each moves the inner nodes and leaves the boundary.

* MFEM's ``mesh-optimizer``, compiled inside the ``mfem`` wheel: target-matrix optimization of the shape metric
  303, corner quadrature (Gauss-Lobatto of two points a direction), ideal targets, Newton's method; tangled
  meshes first with its untangling metric 313, whose derivatives are differences there, and L-BFGS. The mesh is
  scaled to edges of unit length, as differences want it.
* gmsh: ``Relocate3D``.
* VTK: ``vtkConstrainedSmoothingFilter``, boundary points held by the constraint array.

They live in an environment of their own (``pip install mfem gmsh vtk``), whose interpreter is handed in.
"""

from __future__ import annotations

import json
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from machine import run
from numpy.typing import NDArray

from hexconformal.elements import corner_scaled_jacobian
from hexconformal.elements.hexahedron import EDGES

__all__ = ["PEERS", "Answer", "available"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]

_FIND_MFEM = """
import importlib.util, pathlib
folders = importlib.util.find_spec("mfem").submodule_search_locations
print(next((str(p) for f in folders for p in sorted(pathlib.Path(f).rglob("mesh-optimizer"))), ""))
"""

_GMSH = """
import sys, gmsh, numpy as np
data = np.load(sys.argv[1])
points, cells, quads = data["points"], data["cells"], data["quads"]
gmsh.initialize(interruptible=False)
gmsh.option.setNumber("General.Verbosity", 1)
gmsh.model.addDiscreteEntity(2, 1)
gmsh.model.addDiscreteEntity(3, 1, [1])
outer = np.zeros(len(points), bool)
outer[quads] = True
for dim, mask in ((2, outer), (3, ~outer)):
    gmsh.model.mesh.addNodes(dim, 1, np.flatnonzero(mask) + 1, points[mask].ravel())
gmsh.model.mesh.addElementsByType(1, 3, np.arange(len(quads)) + 1, (quads + 1).ravel())
gmsh.model.mesh.addElementsByType(1, 5, np.arange(len(cells)) + len(quads) + 1, (cells + 1).ravel())
gmsh.model.mesh.optimize("Relocate3D", niter=10)
points = points.copy()
for dim, mask in ((2, outer), (3, ~outer)):  # in their order within an entity: it numbers the nodes anew
    points[mask] = gmsh.model.mesh.getNodes(dim, 1)[1].reshape(-1, 3)
np.save(sys.argv[2], points)
"""

_VTK = """
import sys, numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import VTK_HEXAHEDRON, vtkCellArray, vtkUnstructuredGrid
from vtkmodules.vtkFiltersCore import vtkConstrainedSmoothingFilter
data = np.load(sys.argv[1])
points, cells, quads = data["points"], data["cells"], data["quads"]
places, array, grid = vtkPoints(), vtkCellArray(), vtkUnstructuredGrid()
places.SetData(numpy_to_vtk(points, deep=True))
array.SetData(8, numpy_to_vtkIdTypeArray(np.ascontiguousarray(cells).ravel(), deep=True))
grid.SetPoints(places)
grid.SetCells(VTK_HEXAHEDRON, array)
reach = np.full(len(points), np.linalg.norm(np.ptp(points, axis=0)))
reach[quads] = 0.0
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


def mfem(binary: str, points: Field, cells: Ints, quads: Ints, limit: float) -> Answer:
    """LaplacePreconditioner 303, after the untangling metric 313 where the mesh comes in tangled."""
    unit = np.linalg.norm(np.diff(points[cells[:, EDGES]], axis=2), axis=-1).mean()
    common = ["-o", "1", "-tid", "1", "-qt", "1", "-qo", "1", "-fix-bnd", "-no-vis", "-ni", "200", "-rtol", "1e-6"]
    points, best, spent = points / unit, None, 0.0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        source, made = folder / "in.mesh", folder / "optimized.mesh"
        untangle = ["313", "-fd", "-st", "1"]
        for metric in (["303"],) if _valid(points, cells) else (untangle, ["303"]):
            source.write_text(_mfem_mesh(points, cells, quads))
            ended = run([binary, "-m", str(source), "-mid", *metric, *common], max(limit - spent, 1.0), folder)
            spent += ended.cpu
            if ended.code != 0 or not made.exists():
                why = "over time" if ended.code is None else _last(ended.output)
                return Answer(best, spent, f"metric {metric[0]}: {why}")
            points = _mfem_points(made.read_text(), len(points))
            best = unit * points
            made.unlink()
            if not _valid(points, cells):
                return Answer(best, spent, "stays tangled")
    return Answer(best, spent)


def _valid(points: Field, cells: Ints) -> bool:
    return bool(corner_scaled_jacobian(points, cells).min() > 0)


def _last(text: str) -> str:
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    if any("IsFinite" in line for line in lines):
        return "not a number"
    said = next(
        (line for line in lines if "inverted" in line or "abort" in line.lower() or "error" in line.lower()), ""
    )
    return (said or (lines[-1] if lines else "no output"))[:60]


def _mfem_mesh(points: Field, cells: Ints, quads: Ints) -> str:
    def table(rows: Ints, kind: int) -> str:
        return "\n".join(f"1 {kind} " + " ".join(map(str, row)) for row in rows.tolist())

    places = "\n".join(" ".join(f"{value:.17g}" for value in row) for row in points.tolist())
    return (
        f"MFEM mesh v1.0\n\ndimension\n3\n\nelements\n{len(cells)}\n{table(cells, 5)}\n\n"
        f"boundary\n{len(quads)}\n{table(quads, 3)}\n\nvertices\n{len(points)}\n3\n{places}\n"
    )


def _mfem_points(text: str, count: int) -> Field:
    head, _, tail = text.partition("FiniteElementSpace")
    if not tail:
        return np.array(head.partition("vertices")[2].split()[2:], dtype=float).reshape(count, 3)
    words, values = tail.partition("Ordering:")[2].split(maxsplit=1)
    flat = np.array(values.split()[: 3 * count], dtype=float)
    return flat.reshape(3, count).T.copy() if words == "0" else flat.reshape(count, 3)


def _scripted(script: str) -> Callable[[str, Field, Ints, Ints, float], Answer]:
    """A peer that is a few lines of Python in its own interpreter."""

    def peer(python: str, points: Field, cells: Ints, quads: Ints, limit: float) -> Answer:
        with tempfile.TemporaryDirectory() as folder:
            source, made = Path(folder) / "in.npz", Path(folder) / "out.npy"
            np.savez(source, points=points, cells=cells, quads=quads)
            ended = run([python, "-c", script, str(source), str(made)], limit)
            if ended.code != 0 or not made.exists():
                return Answer(None, ended.cpu, "over time" if ended.code is None else _last(ended.output))
            return Answer(np.load(made), ended.cpu)

    return peer


PEERS: dict[str, Callable[[str, Field, Ints, Ints, float], Answer]] = {
    "mfem": mfem,
    "gmsh": _scripted(_GMSH),
    "vtk": _scripted(_VTK),
}

if __name__ == "__main__":
    print(json.dumps(available(sys.argv[1] if len(sys.argv) > 1 else sys.executable)))
