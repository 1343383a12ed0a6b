"""Quadratic hexahedra of linear ones, with the middles of their boundary on a surface that is given beside them."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...common import OptionError, first_ids
from ...elements import HEXAHEDRON20, HEXAHEDRON27, determinant_bounds, quadratic_shapes
from ...formulation import Schedules
from ...io import as_hex_mesh, elevated
from ...mesh import MixedMesh, NormalizedMesh, boundary_quads
from ..boundary import GivenSurface, fit_to
from ..options import Options
from .cut_mesh import CutMesh

__all__ = ["Curved", "curved"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]

_SHARES = (1.0, 0.5, 0.25, 0.0)  # of the way from straight edges to the surface, where cells would be folded
_MIDDLES = quadratic_shapes(HEXAHEDRON27.ideal[20:], HEXAHEDRON20)  # of faces and cells, from edges and corners
_HALF_CIRCLE = 0.5  # lengths of an edge between its middle and that of the half of a circle over it
_ROUNDING = 1e-6
_SEEN = 4  # parts of an edge between whose nodes distances are measured


class Curved(NamedTuple):
    """A mesh of quadratic hexahedra on a surface.

    Attributes
    ----------
    mesh
        The mesh; the corners are where they were.
    distances
        Largest distance of its boundary from the surface while edges were straight, and now, in the mesh's unit; at
        places on the boundary, not from the surface.
    notes
        What was matched with what, and which cells could not be curved all the way.
    """

    mesh: MixedMesh
    distances: tuple[float, float]
    notes: tuple[str, ...]


def curved(mesh: Any, surface: Any, nodes: int = 20, features: str = "auto") -> Curved:
    """The mesh of quadratic hexahedra whose boundary follows a surface, through the corners that linear ones have.

    Nodes in the middle of edges and faces of the boundary go where they belong on the surface, on its sharp curves
    where an edge of the mesh is part of one: what follows what is found as for the option `surface` of
    :class:`hexconformal.Options`. Where a valid cell would be folded these nodes go a part of their way, or stay in the
    middle. Nodes inside are means of those on edges. Corners do not move: they should lie on the surface.

    Parameters
    ----------
    mesh
        Linear hexahedra, anything :func:`hexconformal.as_hex_mesh` takes.
    surface
        A path or a pyvista mesh, finer than the mesh.
    nodes
        Of a cell: 20 or 27.
    features
        Whether sharp curves are kept, as in :class:`hexconformal.Options`.

    Raises
    ------
    MeshError
        If there are cells of other types, or the surface is that of something else.
    OptionError
        If an option makes no sense.

    Examples
    --------
    A cylinder of 12 linear cells, on one of 64 facets.

    >>> import pyvista as pv
    >>> from hexconformal.generate import cylinder
    >>> points, cells = cylinder(2, 1, 1)
    >>> radius, height = np.linalg.norm(points[:, :2], axis=1).max(), points[:, 2].max()
    >>> size = {"radius": radius, "height": height, "resolution": 64}
    >>> surface = pv.Cylinder(center=(0, 0, height / 2), direction=(0, 0, 1), **size).triangulate()
    >>> found = curved((points, cells), surface, nodes=27)
    >>> before, after = found.distances
    >>> found.mesh, bool(after < 0.1 * before)
    (MixedMesh(171 points, 12 hexahedra of 27 nodes), True)
    """
    linear = as_hex_mesh(mesh)
    if surface is None:
        raise OptionError("surface must be given: elevated(mesh, nodes) is the mesh with straight edges")
    straight = elevated(linear, nodes)
    options, count = Options(surface=surface, features=features), len(linear.points)
    cut = CutMesh(straight, 2)
    normalized = NormalizedMesh(cut.linear())
    given, none = GivenSurface.of(normalized, surface), np.zeros(normalized.points.shape, dtype=bool)
    fit = fit_to(normalized, given, options, Schedules(), None, none)
    size = len(straight.points)
    places = [given.locator.closest(normalized.points).positions]
    if fit.matching is not None:
        places.insert(0, fit.matching.points)
    places = [normalized.to_user(place)[:size] for place in places]
    skin = np.zeros(cut.count, dtype=bool)
    skin[normalized.node_ids[np.unique(normalized.quads)]] = True
    corners, far, goal = skin[:count], skin[:size].copy(), straight.points.copy()
    far[:count] = False
    for place in places:
        near = far & (np.linalg.norm(place - straight.points, axis=1) <= _HALF_CIRCLE * _lengths(straight))
        goal[near], far = place[near], far & ~near
    points, less = _placed(straight, goal, count)
    result = straight.replaced(points)
    off, before, after = (
        float(given.locator.closest(normalized.from_user(x)).distances.max(initial=0.0)) * normalized.unit
        for x in (linear.points[corners], _on_faces(straight), _on_faces(result))
    )
    notes = [fit.note]
    if off > 0.5 * after and off > _ROUNDING * before:
        notes.append(f"corners are up to {off:.3g} away from the surface: regularize with it first, if that is too far")
    if far.any():
        notes.append(f"nodes that stay between their corners, as the surface is too far there: {int(far.sum())}")
    if len(less):
        notes.append(f"cells that cannot be curved all the way: {first_ids(less, linear.cell_labels)}")
    return Curved(result, (before, after), tuple(notes))


def _lengths(straight: MixedMesh) -> Field:
    """(n,) twice the way from each node in a middle to the nearest of its corners: the length of its edge."""
    out = np.zeros(len(straight.points))
    (block,) = straight.blocks
    ideal, x = HEXAHEDRON27.ideal, straight.points[block.cells]
    for node in range(8, x.shape[1]):
        apart = ((ideal[:8] - ideal[node]) ** 2).sum(axis=1)
        nearest = np.flatnonzero(apart < apart.min() + 0.1)
        ways = np.linalg.norm(x[:, nearest] - x[:, node, None], axis=2)
        out[block.cells[:, node]] = 2.0 * ways.min(axis=1)
    return out


def _placed(straight: MixedMesh, goal: Field, count: int) -> tuple[Field, Ints]:
    """The points with those behind the first `count` as far on their way as cells allow; cells that allow not all."""
    (block,) = straight.blocks
    cells, kind = block.cells, block.cell_type
    valid = determinant_bounds(straight.points, cells, kind)[0] > 0
    shares, tries = np.ones((len(goal), 1)), np.zeros(len(cells), dtype=np.int64)
    while True:
        points = _at(straight.points, goal, cells, shares)
        points[:count] = straight.points[:count]
        lost = valid & (tries < len(_SHARES) - 1) & ~(determinant_bounds(points, cells, kind)[0] > 0)
        if not lost.any():
            return points, np.flatnonzero(tries)
        tries[lost] += 1
        for number, share in enumerate(_SHARES):
            nodes = cells[tries == number]
            shares[nodes] = np.minimum(shares[nodes], share)


def _at(start: Field, goal: Field, cells: Ints, shares: Field) -> Field:
    """The points with nodes on edges by shares (n, 1) of the way to their goal; those of faces follow, cells' too."""
    points = start + shares * (goal - start)
    if cells.shape[1] == 27:
        on_surface = (goal != start).any(axis=1)
        on_surface[cells[:, :20]] = False
        points[cells[:, 20:]] = np.einsum("pk,mkc->mpc", _MIDDLES, points[cells[:, :20]])
        points[on_surface] += shares[on_surface] * (goal[on_surface] - points[on_surface])
    return points


def _on_faces(mesh: MixedMesh) -> Field:
    """Places on the boundary, between nodes too."""
    cut = CutMesh(mesh, _SEEN)
    return cut.places(mesh.points)[np.unique(cut.faces(boundary_quads(mesh.table)[0]).nodes)]
