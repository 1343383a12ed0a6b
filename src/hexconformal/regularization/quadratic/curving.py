"""Quadratic hexahedra of linear ones, with the middles of their boundary on a surface that is given beside them."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...common import OptionError, first_ids
from ...elements import HEXAHEDRON20, HEXAHEDRON27, quadratic_shapes
from ...geometry import SurfaceLocator, face_area_vectors, nodal_area_vectors, unit_vectors
from ...io import as_hex_mesh, elevated
from ...mesh import HexMesh, MixedMesh, NormalizedMesh, boundary_quads, connected_components, same_rows
from ...quality import quality
from ..boundary import GivenSurface
from .cut_mesh import CutMesh
from .following import followed
from .schedule import CurvingSchedule

__all__ = ["Curved", "curved"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

_MIDDLES = quadratic_shapes(HEXAHEDRON27.ideal[20:], HEXAHEDRON20)  # of faces and cells, from edges and corners

# Along axes and between two or three of them: no normal is more than 28 degrees away from the nearest one.
_DIRECTIONS = unit_vectors(np.array([way for way in product((-1.0, 0.0, 1.0), repeat=3) if any(way)]))


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
        What could not be done.
    """

    mesh: MixedMesh
    distances: tuple[float, float]
    notes: tuple[str, ...]


def curved(mesh: Any, surface: Any, nodes: int = 20, schedule: CurvingSchedule | None = None) -> Curved:
    """The mesh of quadratic hexahedra whose boundary follows a surface, through the corners that linear ones have.

    Nodes in the middle of edges and faces of the boundary go to the closest place on what of the surface looks the way
    their faces do, those of an edge to where this is so for both of its faces: to sharp curves where the mesh has them,
    and never to the other side of a wall. Where a valid cell would be folded, or nearly so, as in thin layers, its
    other edges follow; where that does not help its nodes go a part of their way, or stay in the middle. Nodes in the
    middle of faces and cells inside are means of those on edges. Corners do not move: they should lie on the surface.

    Parameters
    ----------
    mesh
        Linear hexahedra, anything :func:`hexconformal.as_hex_mesh` takes.
    surface
        A path or a pyvista mesh, finer than the mesh.
    nodes
        Of a cell: 20 or 27.
    schedule
        Other tuned numbers than those it was tried with.

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
    schedule = CurvingSchedule() if schedule is None else schedule
    straight, there = elevated(linear, nodes), _Surface(linear, surface, schedule)
    (block,) = straight.blocks
    sides = _Sides(straight)
    goal, far = straight.points.copy(), np.zeros(len(straight.points), dtype=bool)
    for turns in (sides.of_edges, sides.of_faces):
        # Those in the middle of faces begin where their edges, once these are curved, have taken them.
        start = _at(straight.points, goal, block.cells, np.ones((len(goal), 1)), np.zeros_like(goal))
        place = there.on_all(turns, start, straight.points, sides.lengths)
        moved = np.unique(np.concatenate([side.nodes for side in turns])) if turns else np.empty(0, dtype=np.int64)
        near = np.linalg.norm(place[moved] - start[moved], axis=1) <= schedule.reach * sides.lengths[moved]
        far[moved] = ~near
        goal[moved] = np.where(near[:, None], place[moved], start[moved])

    def behind() -> Field:
        return np.where(far[:, None], goal, there.following(straight, goal, sides))

    points, less = _placed(straight, goal, behind, [side.nodes for side in sides.of_faces], schedule)
    result = straight.replaced(points)
    before, after, off = there.farthest(straight), there.farthest(result), there.farthest_corner(linear)
    notes = []
    if off > max(schedule.told * before, there.rounding):
        notes.append(f"corners are up to {off:.3g} away from the surface: regularize with it first if that is much")
    if far.any():
        notes.append(f"nodes that stay between their corners, as the surface is too far there: {int(far.sum())}")
    if len(less):
        notes.append(f"cells that cannot be curved all the way: {first_ids(less, linear.cell_labels)}")
    return Curved(result, (before, after), tuple(notes))


class _Surface:
    """A surface, the outside out: places look for it where it looks the way they do, as a wall has two sides."""

    def __init__(self, linear: HexMesh, surface: Any, schedule: CurvingSchedule) -> None:
        self._normalized, self._schedule = NormalizedMesh(linear), schedule
        self._locator = GivenSurface.of(self._normalized, surface).outside_out

        self._found: dict[int, tuple[SurfaceLocator, SurfaceLocator] | None] = {}

    @cached_property
    def _normals(self) -> Field:
        return unit_vectors(face_area_vectors(self._locator.points, self._locator.faces))

    def _looking(self, direction: int) -> tuple[SurfaceLocator, SurfaceLocator] | None:
        """What of it looks in a direction, as a whole and in connected pieces; None if nothing does."""
        if direction not in self._found:
            points = self._locator.points
            faces = self._locator.faces[self._normals @ _DIRECTIONS[direction] > self._schedule.looks]
            self._found[direction] = None
            if len(faces):
                links = np.stack([faces, np.roll(faces, 1, axis=1)], axis=2).reshape(-1, 2)
                labels = connected_components(links, len(points))[faces[:, 0]]
                pieces = np.unique(labels, return_inverse=True)[1].astype(np.int64)
                self._found[direction] = SurfaceLocator(points, faces), SurfaceLocator(points, faces, pieces)
        return self._found[direction]

    def on_all(self, turns: list[_Side], start: Field, points: Field, lengths: Field) -> Field:
        """Points (n, 3) with nodes where the surface looks the way of all of their faces, from places (n, 3) on."""
        place = start.copy()
        for _ in range(self._schedule.projections):
            before = place.copy()
            for side in turns:
                place[side.nodes] = self.facing(place[side.nodes], side.normals, points[side.corners])[0]
            if (np.linalg.norm(place - before, axis=1) <= self._schedule.still * lengths).all():
                break
        return place

    def following(self, straight: MixedMesh, goal: Field, sides: _Sides) -> Field:
        """Goals (n, 3) with those of edges inside, and of others along their faces, behind those of the boundary."""
        (block,) = straight.blocks
        planes = [(side.nodes, unit_vectors(side.normals)) for side in sides.of_edges]
        behind = straight.points + followed(block.cells, straight.points, goal - straight.points, planes)
        return self.on_all(sides.of_edges, behind, straight.points, sides.lengths)

    def facing(self, places: Field, normals: Field, corners: Field | None = None) -> tuple[Field, Field]:
        """Closest points (k, 3) on what looks where normals (k, 3) do, and distances (k,), in the user's unit.

        With corners (k, 3) on that piece of it that is closest to these. Where there is nothing that looks there the
        places are returned, and infinite distances.
        """
        found, distances = np.array(places, dtype=np.float64), np.full(len(places), np.inf)
        directions = (normals @ _DIRECTIONS.T).argmax(axis=1)
        for direction in np.unique(directions).tolist():
            looking = self._looking(direction)
            if looking is not None:
                whole, pieces = looking
                some = np.flatnonzero(directions == direction)
                own = self._normalized.from_user(found[some])
                if corners is None:
                    closest = whole.closest(own)
                else:
                    near = whole.closest(self._normalized.from_user(corners[some])).faces
                    closest = pieces.closest(own, near)
                found[some] += self._normalized.unit * (closest.positions - own)
                distances[some] = self._normalized.unit * closest.distances
        return found, distances

    @property
    def rounding(self) -> float:
        """How far points are off in files that store them in single precision, as .stl does, in the user's unit."""
        return float(np.abs(self._normalized.mesh.points).max() * np.finfo(np.float32).eps)

    def farthest(self, mesh: MixedMesh) -> float:
        """Largest distance of the boundary of a mesh from it."""
        cut = CutMesh(mesh, self._schedule.parts)
        nodes, quads = np.unique(cut.faces(boundary_quads(mesh.table)[0]).nodes, return_inverse=True)
        places = cut.matrix(nodes) @ mesh.points
        return self._largest(places, nodal_area_vectors(places, quads.reshape(-1, 4)))

    def farthest_corner(self, linear: HexMesh) -> float:
        """Largest distance of the corners of the boundary from it."""
        quads = boundary_quads(linear.cells)[0]
        corners = np.unique(quads)
        return self._largest(linear.points[corners], nodal_area_vectors(linear.points, quads)[corners])

    def _largest(self, places: Field, normals: Field) -> float:
        distances = self.facing(places, normals)[1]
        return float(distances[np.isfinite(distances)].max(initial=0.0))


class _Side(NamedTuple):
    """Nodes (k,) in middles, a face of the boundary of each, by its normal (k, 3), and a corner (k,) of that."""

    nodes: Ints
    normals: Field
    corners: Ints


class _Sides:
    """The nodes in the middles of edges and of faces of the boundary, with their faces.

    Attributes
    ----------
    of_edges, of_faces
        One face of each; the second has other faces of the same edges.
    lengths
        (n,) length of the edge of each node in a middle; of a face of its shorter diagonal.
    """

    def __init__(self, straight: MixedMesh) -> None:
        (block,) = straight.blocks
        cells, points = block.cells, straight.points
        quads = boundary_quads(straight.table)[0]
        normals = face_area_vectors(points, quads)
        self.lengths = _lengths(straight)
        ends = np.stack([quads, np.roll(quads, -1, axis=1)], axis=2).reshape(-1, 2)
        known = cells[:, [_corners_of(node) for node in range(8, 20)]].reshape(-1, 2)
        which = same_rows(np.concatenate([known, ends]))[len(known) :]
        self.of_edges = _in_turn(_Side(cells[:, 8:20].ravel()[which], np.repeat(normals, 4, axis=0), ends[:, 0]))
        self.of_faces = list[_Side]()
        if cells.shape[1] == 27:
            self.of_faces = [_Side(CutMesh(straight, 2).faces(quads).grids[:, 1, 1], normals, quads[:, 0])]


def _in_turn(all_sides: _Side) -> list[_Side]:
    """The nodes, the first time that each is there, the second time, and so on."""
    order = np.argsort(all_sides.nodes, kind="stable")
    nodes = all_sides.nodes[order]
    times = np.arange(len(nodes)) - np.searchsorted(nodes, nodes)
    chosen = [order[times == time] for time in range(int(times.max(initial=-1)) + 1)]
    return [_Side(*(one[some] for one in all_sides)) for some in chosen]


def _lengths(straight: MixedMesh) -> Field:
    """(n,) twice the way from each node in a middle to the nearest of its corners."""
    out = np.zeros(len(straight.points))
    (block,) = straight.blocks
    x = straight.points[block.cells]
    for node in range(8, x.shape[1]):
        ways = np.linalg.norm(x[:, _corners_of(node)] - x[:, node, None], axis=2)
        out[block.cells[:, node]] = 2.0 * ways.min(axis=1)
    return out


def _corners_of(node: int) -> list[int]:
    """The corners that a node is in the middle of."""
    apart = ((HEXAHEDRON27.ideal[:8] - HEXAHEDRON27.ideal[node]) ** 2).sum(axis=1)
    return np.flatnonzero(apart < apart.min() + 0.1).tolist()


def _placed(
    straight: MixedMesh, goal: Field, behind: Callable[[], Field], of_faces: list[Ints], schedule: CurvingSchedule
) -> tuple[Field, Ints]:
    """The points, as far on their way as cells allow, those of outer faces too; cells that allow not all.

    Nodes of cells that would be folded take the goals where other edges are behind those of the boundary, and if that
    does not help shares of the way there.
    """
    (block,) = straight.blocks
    cells, first = block.cells, quality(straight)
    along, beside = _at(straight.points, goal, cells, np.ones((len(goal), 1)), np.zeros_like(goal)), np.zeros_like(goal)
    for some in of_faces:
        beside[some] = goal[some] - along[some]
    tries, goals = np.zeros(len(cells), dtype=np.int64), [goal]
    while True:
        tried = np.zeros(len(goal), dtype=np.int64)
        np.maximum.at(tried, cells, tries[:, None])
        shares = np.asarray(schedule.shares)[np.maximum(tried - 1, 0), None]
        points = _at(straight.points, np.where(tried[:, None] == 0, goals[0], goals[-1]), cells, shares, beside)
        now = quality(straight.replaced(points))
        poor = ~now.valid | (now.minimum_jacobian < schedule.kept * first.minimum_jacobian)
        lost = first.valid & poor & (tries < len(schedule.shares))
        if not lost.any():
            return points, np.flatnonzero(tries > 1)
        tries[lost] += 1
        if len(goals) == 1:
            goals.append(behind())


def _at(start: Field, goal: Field, cells: Ints, shares: Field, beside: Field) -> Field:
    """The points with nodes on edges by shares (n, 1) of the way to their goal.

    Those of faces and cells follow, and go by their shares of a way (n, 3) beside that.
    """
    points = start + shares * (goal - start)
    if cells.shape[1] == 27:
        points[cells[:, 20:]] = np.einsum("pk,mkc->mpc", _MIDDLES, points[cells[:, :20]])
        points += shares * beside
    return points
