"""Majorize-minimize on a surface: the loop, free of files and reports, in units of the mean edge length."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from .energy import Barrier, Distortion, Frames, corner_frames
from .features import CORNER, SMOOTH, Features, edge_table, holding
from .geometry import Cells, Floats, nodal_areas, nodal_vectors, transport_vectors, unit_vectors
from .guard import Shape, turned_frames
from .step import solve_constrained
from .target import Target

__all__ = ["Iterate", "Surface", "majorize"]

_LONGEST = 0.5  # step of a node, in lengths of its edges
_REFUSALS = 6  # in a row that end the run
_RELEASE = 4  # iterations after which nodes that were held may try again
_TRIES = 18
_LOCAL = 12  # tries that shorten steps where the trouble is, before nodes are stopped
_GROWTH = 2.0  # of a frame's density that counts as trouble


@dataclass(frozen=True)
class Iterate:
    """One accepted surface."""

    points: Floats
    energy: float
    decrease: float
    step: float
    held: int


@dataclass(eq=False)
class Surface:
    """What the loop works on.

    Attributes
    ----------
    start, cells, features
        The input.
    energy
        What is lowered; a quaternionic one has its metric of its own choice.
    eps
        Relaxation of the constraint, in squares of the mean edge length.
    normal
        Where its normal is taken.
    bound
        Largest distance from the input; None lets the surface go (no projection, no bound).
    """

    start: Floats
    cells: Cells
    features: Features
    energy: Distortion
    eps: float
    normal: str
    bound: float | None

    def __post_init__(self) -> None:
        count = len(self.start)
        self.frames: Frames = self.energy.frames
        if not isinstance(self.energy, Barrier):
            shapes = (np.zeros((len(self.cells.triangles), 3, 2)), np.zeros((len(self.cells.quads), 4, 2)))
            shapes[0][:, 1, 0] = shapes[0][:, 2, 1] = 1.0
            shapes[1][:] = [[0, 0], [1, 0], [1, 1], [0, 1]]
            self.frames = corner_frames(self.cells, shapes)
        self._edges = self.cells.edges()
        self._degree = np.maximum(np.bincount(self._edges.ravel(), minlength=count), 1)
        self.moving = self.features.kind != CORNER
        self._smooth = self.features.kind == SMOOTH
        self._pieces = _closed_pieces(self.cells, count)
        self._volumes = self._piece_volumes(self.start)
        self.target = None if self.bound is None else Target(self.start, self.cells, self.features)
        self.shape = None if self.bound is None else Shape(self.start, self.cells)
        # An input may touch itself: what is wrong from the start is nobody's fault.
        self._tolerated = np.zeros(len(self.cells), dtype=bool)
        if self.shape is not None and self.bound is not None:
            self._tolerated = self.shape.offenders(self.start, self.bound)

    def edge_lengths(self, points: Floats) -> Floats:
        """(n,) mean length of the edges at each node."""
        lengths = np.linalg.norm(points[self._edges[:, 1]] - points[self._edges[:, 0]], axis=1)
        return np.bincount(self._edges.ravel(), np.repeat(lengths, 2), len(points)) / self._degree

    def stiffness(self, points: Floats) -> Floats:
        """(n,) lumped mass over eps, in the unit of the energy's second derivative."""
        return nodal_areas(points, self.cells) / self.eps

    def retracted(self, points: Floats, still: NDArray[np.bool_]) -> tuple[Floats, NDArray[np.int64] | None]:
        """Back onto the input, every closed piece with its old volume; nodes that are still stay exactly."""
        if self.target is None:
            return points, None
        result, places = self.target.project(points)
        result[still], places[still] = points[still], self.target.places[still]
        for _ in range(2):
            result = self._with_volume(result, self._smooth & ~still)
        return result, places

    def _with_volume(self, points: Floats, movable: NDArray[np.bool_]) -> Floats:
        vectors = nodal_vectors(points, self.cells)
        areas = np.linalg.norm(vectors, axis=1) * movable
        count = len(self._volumes)
        inside = self._pieces >= 0
        total = np.bincount(self._pieces[inside], areas[inside], count)
        missing = self._volumes - self._piece_volumes(points)
        offset = np.where(total > 0, missing / np.where(total > 0, total, 1.0), 0.0)
        shift = np.zeros(len(points))
        shift[inside] = offset[self._pieces[inside]]
        return np.asarray(points + (shift * movable)[:, None] * unit_vectors(vectors))

    def _piece_volumes(self, points: Floats) -> Floats:
        inside = self._pieces >= 0
        moments = (points * nodal_vectors(points, self.cells)).sum(axis=1) / 3
        count = int(self._pieces.max(initial=-1)) + 1
        return np.bincount(self._pieces[inside], moments[inside], count).astype(np.float64)

    def around(self, nodes: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """(n,) the nodes and all that share an edge with one of them."""
        result = nodes.copy()
        result[self._edges[nodes[self._edges].any(axis=1)]] = True
        return result

    def offending_nodes(self, points: Floats) -> NDArray[np.bool_]:
        """(n,) nodes of cells that stray from the input's shape."""
        mask = np.zeros(len(points), dtype=bool)
        if self.shape is not None and self.bound is not None:
            cells = self.shape.offenders(points, self.bound) & ~self._tolerated
            t = len(self.cells.triangles)
            mask[self.cells.triangles[cells[:t]]] = True
            mask[self.cells.quads[cells[t:]]] = True
        return mask


def majorize(surface: Surface, tolerance: float) -> Iterator[Iterate]:
    """Lower the energy until an iteration gains less than `tolerance` of it; yields every accepted surface.

    Each iteration solves the constrained problem of :mod:`surface.step`, puts the nodes back, and shortens the step
    of those nodes whose cells turn over, are spoiled, or leave the input; the energy never rises.
    """
    energy, x = surface.energy, surface.start
    value = energy.value(x)
    damping = 1.0
    rest = np.zeros(len(x), dtype=bool)
    refused = rounds = 0
    yield Iterate(x, value, 0.0, 0.0, 0)
    while value > 0:
        v = _direction(surface, x, damping, rest)
        lengths = surface.edge_lengths(x)
        size = np.linalg.norm(v, axis=1)
        s = np.minimum(1.0, _LONGEST * lengths / np.maximum(size, 1e-300))
        predicted = -float((energy.gradient(x) * v).sum())
        if predicted <= tolerance * value or size.max() <= 1e-9:
            return
        found, blamed = _search(surface, x, value, v, s)
        if found is None:
            refused += 1
            if refused > _REFUSALS:
                return
            if blamed.any():
                # Who cannot go is held, and the others find their way around.
                for _ in range(refused - 1):
                    blamed = surface.around(blamed)
                rest |= blamed
            else:
                damping *= 4
            continue
        y, places, new, failures = found
        decrease = (value - new) / value
        step = float(np.linalg.norm(y - x, axis=1).max())
        damping = min(damping * 2, 16.0) if failures else max(damping / 2, 1 / 8)
        x, value, refused = y, new, 0
        if surface.target is not None and places is not None:
            surface.target.places = places
        yield Iterate(x, value, decrease, step, int(rest.sum()))
        rounds += 1
        if decrease < tolerance:
            return
        if rounds % _RELEASE == 0:
            rest[:] = False


def _direction(surface: Surface, x: Floats, damping: float, rest: NDArray[np.bool_]) -> Floats:
    energy = surface.energy
    if isinstance(energy, Barrier):
        energy.damping = damping
    gradient, hessian = energy.gradient(x), energy.hessian(x)
    stiffness = surface.stiffness(x)
    v = np.zeros_like(x)
    for _ in range(1 if surface.normal == "linear" else 4):
        vectors = transport_vectors(x, x + v, surface.cells, surface.normal)
        held = holding(vectors, x, surface.features)
        held[rest] = np.eye(3)
        v = solve_constrained(hessian, -gradient, held, stiffness)
    v[~surface.moving | rest] = 0.0
    return v


def _search(surface: Surface, x: Floats, value: float, v: Floats, s: Floats):  # type: ignore[no-untyped-def]
    """Shorten steps until the surface is acceptable: where the trouble is, and everywhere if there is none to blame."""
    energy, frames = surface.energy, surface.frames
    before = energy.densities(x)
    nobody = np.zeros(len(x), dtype=bool)
    size = np.abs(v).max(axis=1)
    failures = blamed = 0
    for tries in range(_TRIES):
        factor = 0.5 if tries < _LOCAL else 0.0
        y, places = surface.retracted(x + s[:, None] * v, (s == 0) | (size == 0))
        turned = turned_frames(frames, x, y, surface.cells)
        if turned.any():
            s[frames.nodes[turned]] *= factor
            continue
        after = energy.densities(y)
        new = float(after.sum())
        if not new < value:
            failures += 1
            worse = after > _GROWTH * before + 0.05 * value / len(before)
            if worse.any() and tries < _LOCAL:
                s[energy.frames.nodes[worse]] *= 0.5
            else:
                s *= 0.5
            continue
        offending = surface.offending_nodes(y)
        if not offending.any():
            return (y, places, new, failures), nobody
        blamed += 1
        if blamed > 2 or not s[offending].any():
            return None, offending
        s[offending] *= 0.25
    return None, nobody


def _closed_pieces(cells: Cells, count: int) -> NDArray[np.int64]:
    """(n,) number of the closed connected piece each node lies in, -1 in open ones."""
    table = edge_table(cells)
    a, b = table.nodes.T
    links = sparse.coo_matrix((np.ones(len(a)), (a, b)), shape=(count, count))
    labels = connected_components(links, directed=False)[1]
    open_pieces = np.unique(labels[table.nodes[table.uses != 2]])
    used = np.zeros(count, dtype=bool)
    used[table.nodes] = True
    closed = used & ~np.isin(labels, open_pieces)
    result = np.full(count, -1)
    result[closed] = np.unique(labels[closed], return_inverse=True)[1].ravel()
    return result
