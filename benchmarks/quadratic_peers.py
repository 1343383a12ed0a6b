"""Other tools that install with pip, on the same mesh of quadratic hexahedra: each moves inner nodes of all kinds.

* MFEM's ``mesh-optimizer``, order 2: the shape metric 303 with Newton's method, ideal targets, Gauss-Lobatto quadrature
  of order 4 (64 points a cell); where det J <= 0 somewhere, its untangling metric 313 first, by L-BFGS. 313 has no
  derivatives there, and the differences that stand for them fail on meshes of unit edges: edges of length .03 are what
  it needs (of .28, .1, .03 and .01 that length alone came to an end on the ball). It knows hexahedra of 27 nodes alone:
  those of 20 are handed over, and measured, as such.
* gmsh's optimizers of order 2 with ``Mesh.HighOrderFixBoundaryNodes``: ``HighOrder``, the smallest scaled Jacobian that
  it is content with raised from .1 to .6, which helps; ``HighOrderElastic``; both, one after the other;
  ``HighOrderFastCurving``, which has little to go by without a geometry behind the mesh.

They live in an environment of their own (``pip install mfem gmsh``), whose interpreter is handed in.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from machine import run
from numpy.typing import NDArray
from peers import Answer, available, last_words

import hexconformal as hc
from hexconformal.elements import FACES, LATTICE, from_nodes
from hexconformal.mesh import CellBlock, boundary_quads

__all__ = ["QUADRATIC_PEERS", "quality_of"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]

_MFEM = """
import sys, numpy as np, mfem.ser as mf
data = np.load(sys.argv[2])

def dofs(space):
    nodes = space.GetFE(0).GetNodes()
    places = np.array([[nodes.IntPoint(i).x, nodes.IntPoint(i).y, nodes.IntPoint(i).z] for i in range(27)])
    order = [int(np.abs(places - place / 2).sum(axis=1).argmin()) for place in data["lattice"]]
    return np.array([np.array(space.GetElementDofs(c))[order] for c in range(space.GetNE())])

if sys.argv[1] == "to":
    cells, quads = data["cells"], data["quads"]
    mesh = mf.Mesh(3, int(cells.max()) + 1, len(cells), len(quads), 3)
    for place in data["corners"].tolist():
        mesh.AddVertex(*place)
    for row in cells.tolist():
        mesh.AddHex(row, 1)
    for row in quads.tolist():
        mesh.AddBdrQuad(row, 1)
    mesh.FinalizeHexMesh(1, 0, False)
    mesh.SetCurvature(2, False, 3, mf.Ordering.byVDIM)
    nodes = mesh.GetNodes()
    flat = np.array(nodes.GetDataArray()).reshape(-1, 3).copy()
    flat[dofs(nodes.FESpace())] = data["x"]
    nodes.Assign(mf.Vector(flat.ravel()))
    mesh.Print(sys.argv[3], 17)
else:
    mesh = mf.Mesh(sys.argv[3], 1, 0, False)
    nodes = mesh.GetNodes()
    flat, space = np.array(nodes.GetDataArray()), nodes.FESpace()
    flat = flat.reshape(-1, 3) if space.GetOrdering() == mf.Ordering.byVDIM else flat.reshape(3, -1).T
    np.save(sys.argv[4], flat[dofs(space)])
"""

_GMSH = """
import sys, gmsh, numpy as np
data = np.load(sys.argv[1])
points, cells, faces, lattice = (data[name] for name in ("points", "cells", "faces", "lattice"))
gmsh.initialize(interruptible=False)
for name, value in (("General.Verbosity", 1), ("General.NumThreads", 1), ("Mesh.ElementOrder", 2)):
    gmsh.option.setNumber(name, value)
gmsh.option.setNumber("Mesh.HighOrderFixBoundaryNodes", 1)
gmsh.option.setNumber("Mesh.HighOrderThresholdMin", 0.6)

def order(kind, lattice):
    places = np.reshape(gmsh.model.mesh.getElementProperties(kind)[4], (-1, lattice.shape[1]))
    return [int(np.flatnonzero((lattice == place).all(axis=1))[0]) for place in np.rint(places + 1)]

solid, flat = (12, 10) if cells.shape[1] == 27 else (17, 16)
rows, square = order(solid, lattice[: cells.shape[1]]), data["square"][: faces.shape[1]]
gmsh.model.addDiscreteEntity(2, 1)
gmsh.model.addDiscreteEntity(3, 1, [1])
outer, inner = np.zeros((2, len(points)), bool)
outer[faces], inner[cells] = True, True
for dim, mask in ((2, outer), (3, inner & ~outer)):
    gmsh.model.mesh.addNodes(dim, 1, np.flatnonzero(mask) + 1, points[mask].ravel())
numbers = np.arange(len(faces)) + 1
gmsh.model.mesh.addElementsByType(1, flat, numbers, (faces[:, order(flat, square)] + 1).ravel())
gmsh.model.mesh.addElementsByType(1, solid, np.arange(len(cells)) + len(faces) + 1, (cells[:, rows] + 1).ravel())
for method in sys.argv[3].split("+"):
    gmsh.model.mesh.optimize(method, force=True)
tags, places, _ = gmsh.model.mesh.getNodes()
where = np.zeros(int(tags.max()) + 1, int)
where[tags.astype(int)] = np.arange(len(tags))
nodes = gmsh.model.mesh.getElementsByType(solid)[1].astype(int).reshape(cells.shape)
x = np.empty((*cells.shape, 3))
x[:, rows] = places.reshape(-1, 3)[where[nodes]]
np.save(sys.argv[2], x)
"""

_EDGE = 0.03  # median length of an edge for MFEM

# Twice the reference coordinates of the nodes of a quadratic quadrilateral.
_SQUARE = np.array([[0, 0], [2, 0], [2, 2], [0, 2], [1, 0], [2, 1], [1, 2], [0, 1], [1, 1]])


def _boundary(block: CellBlock) -> Ints:
    """(f, 8 or 9) nodes of the faces that belong to one cell."""
    corners, owners = boundary_quads(block.cells[:, :8])
    found = np.empty((len(corners), 9 if block.cells.shape[1] == 27 else 8), dtype=np.int64)
    around = block.cells[owners]
    for face in FACES:
        one, other = LATTICE[face[1]] - LATTICE[face[0]], LATTICE[face[3]] - LATTICE[face[0]]
        places = LATTICE[face[0]] + (_SQUARE[:, :1] * one + _SQUARE[:, 1:] * other) // 2
        nodes = [int(np.flatnonzero((place == LATTICE).all(axis=1))[0]) for place in places]
        mine = (around[:, face] == corners).all(axis=1)
        found[mine] = around[mine][:, nodes[: found.shape[1]]]
    return found


def mfem(python: str, points: Field, block: CellBlock, limit: float) -> Answer:
    """Metric 303, after the untangling metric 313 where the mesh comes in tangled."""
    binary = available(python)[0].get("mfem")
    if binary is None:
        return Answer(None, 0.0, "not installed")
    edge = np.median(np.linalg.norm(points[block.cells[:, 1]] - points[block.cells[:, 0]], axis=1))
    common = ["-o", "2", "-tid", "1", "-qt", "1", "-qo", "4", "-fix-bnd", "-no-vis", "-ni", "200", "-rtol", "1e-6"]
    scale, spent, best = _EDGE / edge, 0.0, None
    corners, cells = np.unique(block.cells[:, :8], return_inverse=True)
    x = scale * np.einsum("ab,cbi->cai", from_nodes(block.cell_type), points[block.cells])
    quads = np.searchsorted(corners, _boundary(block)[:, :4])
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        arrays, source, made, out = (folder / file for file in ("in.npz", "in.mesh", "optimized.mesh", "out.npy"))
        places = scale * points[corners]
        np.savez(arrays, x=x, corners=places, cells=cells.reshape(-1, 8), quads=quads, lattice=LATTICE)
        converted = run([python, "-c", _MFEM, "to", str(arrays), str(source)], limit)
        if converted.code != 0:
            return Answer(None, 0.0, last_words(converted.output))
        tangled = quality_of(x).scaled_jacobian.min() <= 0.0
        for metric in [["313", "-fd", "-st", "1"], ["303"]] if tangled else [["303"]]:
            ended = run([binary, "-m", str(source), "-mid", *metric, *common], max(limit - spent, 1.0), folder)
            spent += ended.cpu
            if ended.code != 0 or not made.exists():
                why = "over time" if ended.code is None else last_words(ended.output)
                return Answer(best, spent, f"metric {metric[0]}: {why}")
            run([python, "-c", _MFEM, "from", str(arrays), str(made), str(out)], limit)
            best = np.load(out) / scale
            made.rename(source)
    return Answer(best, spent)


def gmsh(method: str, python: str, points: Field, block: CellBlock, limit: float) -> Answer:
    """One of gmsh's methods, or several with a plus between them."""
    with tempfile.TemporaryDirectory() as folder:
        source, made = Path(folder) / "in.npz", Path(folder) / "out.npy"
        np.savez(source, points=points, cells=block.cells, faces=_boundary(block), lattice=LATTICE, square=_SQUARE)
        ended = run([python, "-c", _GMSH, str(source), str(made), method], limit)
        if ended.code != 0 or not made.exists():
            return Answer(None, ended.cpu, "over time" if ended.code is None else last_words(ended.output))
        return Answer(np.load(made), ended.cpu)


def quality_of(x: Field) -> hc.Quality:
    """The measures of cells (m, 20 or 27, 3) by the places of their nodes."""
    cells = np.arange(x.shape[0] * x.shape[1]).reshape(x.shape[:2])
    return hc.quality((x.reshape(-1, 3), {f"hexahedron{x.shape[1]}": cells}))


# By name: the places (m, 20 or 27, 3) of the nodes of the cells of a block are in the points of the answer.
QUADRATIC_PEERS: dict[str, Callable[[str, Field, CellBlock, float], Answer]] = {
    "MFEM 303": mfem,
    "gmsh HighOrder": partial(gmsh, "HighOrder"),
    "gmsh Elastic": partial(gmsh, "HighOrderElastic"),
    "gmsh Elastic, HighOrder": partial(gmsh, "HighOrderElastic+HighOrder"),
    "gmsh FastCurving": partial(gmsh, "HighOrderFastCurving"),
}
