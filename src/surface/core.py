"""Descent on a surface: the loop, free of files and reports, in units of the mean edge length."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from .energy import Barrier, Distortion
from .features import CORNER, SMOOTH, Features, edge_table, holding
from .geometry import (
    Cells,
    Floats,
    Ints,
    area_gradient,
    cell_areas,
    nodal_areas,
    nodal_vectors,
    transport_vectors,
    unit_vectors,
)
from .guard import Shape
from .step import Linear
from .target import Target

__all__ = ["Iterate", "Outcome", "Surface", "descend"]

_LONGEST = 0.5  # step of a node, in lengths of its edges
_TRIES = 16
_FEW = 30  # nodes
_BLAMES = 4  # times that cells are blamed for a rise of the energy, before everybody is
_SHORTER = 0.25  # factor of the step of nodes in trouble
_HELD = 0.1  # share of its step below which a node stays
_CAP = 10.0  # of the density at first; it is raised whenever the decrease is below the next
_SETTLED = 0.05
_WIDE = 100.0
_GROWTH = 2.0  # of a cell's density in one step
_STALL = 5  # iterations in a row that gain little
_AREA = 0.008  # relative change of the area
_SLACK = 1e-4  # beyond that range
_USUAL = 10.0  # times the median
_KNOWN = 0.3  # length of a sum of normals that says something
_SHARPEST = 2.0  # curvature that counts, per mean edge length
_LOOSE, _TIGHT = 0.03, 1e-8  # of the linear systems: with nodes put back onto the surface, and without


@dataclass(frozen=True)
class Iterate:
    """One accepted surface."""

    points: Floats
    energy: float
    decrease: float
    step: float
    held: int


@dataclass
class Outcome:
    """Why the descent ended."""

    reason: str = "interrupted"
    converged: bool = False


@dataclass(eq=False)
class Surface:
    """What the loop works on.

    Attributes
    ----------
    start, cells, features
        The input.
    energy
        What is lowered.
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
        self.edges = self.cells.edges()
        self._degree = np.maximum(np.bincount(self.edges.ravel(), minlength=count), 1)
        self.moving = self.features.kind != CORNER
        self._smooth = self.features.kind == SMOOTH
        self._pieces = _closed_pieces(self.cells, count)
        self._volumes = self._piece_volumes(self.start, nodal_vectors(self.start, self.cells))
        self.area = float(cell_areas(self.start, self.cells).sum())
        self.shape = Shape(self.start, self.cells)
        self.precision = _TIGHT if self.bound is None else _LOOSE
        self.target = None if self.bound is None else Target(self.start, self.cells, self.features)

    def edge_lengths(self, points: Floats) -> Floats:
        """(n,) mean length of the edges at each node."""
        lengths = np.linalg.norm(points[self.edges[:, 1]] - points[self.edges[:, 0]], axis=1)
        return np.bincount(self.edges.ravel(), np.repeat(lengths, 2), len(points)) / self._degree

    def retracted(self, base: Floats, step: Floats) -> tuple[Floats, Floats, Ints | None]:
        """A step from points on the input, back onto it; then the surface with its old volume and area.

        Returns
        -------
        (n, 3) points, a little off the input, those on it, and where they are there.
        """
        if self.target is None:
            return base + step, base + step, None
        still = ~step.any(axis=1)
        moved, places, _ = self.target.project(base + step)
        # Where the input is rough a projection may not stay where it is: no step has to mean no change.
        moved += base - self.target.project(base)[0]
        moved[still], places[still] = base[still], self.target.places[still]
        result = moved
        for _ in range(2):
            result = self._with_volume(self._with_area(result))
        return result, moved, places

    def _with_volume(self, points: Floats) -> Floats:
        """Every closed piece shifted along its normals until it encloses its old volume."""
        vectors = nodal_vectors(points, self.cells)
        areas = np.linalg.norm(vectors, axis=1) * self._smooth
        inside = self._pieces >= 0
        total = np.bincount(self._pieces[inside], areas[inside], len(self._volumes))
        missing = self._volumes - self._piece_volumes(points, vectors)
        offset = np.where(total > 0, missing / np.where(total > 0, total, 1.0), 0.0)
        shift = np.zeros(len(points))
        shift[inside] = offset[self._pieces[inside]]
        return np.asarray(points + (shift * self._smooth)[:, None] * unit_vectors(vectors))

    def _with_area(self, points: Floats) -> Floats:
        """What is cut off where the surface is curved, given back there: shifted in proportion to the curvature."""
        excess = self.area_excess(points)
        if excess == 0.0:
            return points
        bend, pull, upward = self._bending(points)
        rate = float((bend * pull).sum())
        if not rate > 0:
            return points
        return np.asarray(points - (excess * self.area / rate) * bend[:, None] * upward)

    def _bending(self, points: Floats) -> tuple[Floats, Floats, Floats]:
        """Curvature at the nodes less its mean, the derivative of the area along the normals, and these."""
        vectors = nodal_vectors(points, self.cells)
        upward, areas = unit_vectors(vectors), np.linalg.norm(vectors, axis=1) * self._smooth
        pull = (area_gradient(points, self.cells) * upward).sum(axis=1) * self._smooth
        bend = np.clip(pull / np.maximum(areas, 1e-3), -_SHARPEST, _SHARPEST) * self._smooth
        mean = float((bend * areas).sum()) / max(float(areas.sum()), 1e-300)
        return (bend - mean) * self._smooth, pull, upward

    def _piece_volumes(self, points: Floats, vectors: Floats) -> Floats:
        inside = self._pieces >= 0
        moments = (points * vectors).sum(axis=1) / 3
        count = int(self._pieces.max(initial=-1)) + 1
        return np.bincount(self._pieces[inside], moments[inside], count).astype(np.float64)

    def slope(self, points: Floats) -> Floats:
        """(n, 3) derivative of the energy of the surface that has got its volume and area back."""
        gradient = self.energy.gradient(points)
        size = np.linalg.norm(gradient, axis=1)
        # A few bad cells must not move all others through volume and area.
        usual = gradient * np.minimum(1.0, _USUAL * np.median(size) / np.maximum(size, 1e-300))[:, None]
        change = float(cell_areas(points, self.cells).sum()) / self.area - 1
        if abs(change) > 0.98 * _AREA:
            bend, pull, upward = self._bending(points)
            force = float((bend[:, None] * upward * usual).sum()) / max(float((bend * pull).sum()), 1e-300)
            # Only a multiplier of the right sign: the energy would have the area leave its range.
            if force * change < 0:
                by_area = force * area_gradient(points, self.cells)
                gradient, usual = gradient - by_area, usual - by_area
        vectors = nodal_vectors(points, self.cells)
        upward, areas = unit_vectors(vectors), np.linalg.norm(vectors, axis=1)
        whole = self._pieces >= 0
        inside = whole & self._smooth
        piece, count = self._pieces[inside], len(self._volumes)
        total = np.maximum(np.bincount(piece, areas[inside], count), 1e-300)
        pressure = np.bincount(piece, (upward * usual).sum(axis=1)[inside], count) / total
        gradient[whole] -= pressure[self._pieces[whole], None] * vectors[whole]
        return gradient

    def area_excess(self, points: Floats) -> float:
        """How far the area is out of its range, relatively; negative where it is too small, 0 within."""
        if self.bound is None:
            return 0.0
        change = float(cell_areas(points, self.cells).sum()) / self.area - 1
        return change - float(np.clip(change, -_AREA, _AREA))

    def in_trouble(self, y: Floats, before: Floats, after: Floats, s: Floats) -> NDArray[np.bool_]:
        """(n,) nodes of cells that a step to y spoils, turns over, or takes away from the input.

        Energies of the cells are given, and the share s of its step that each node goes.
        """
        still = np.concatenate([(s[table] == 0).all(axis=1) for table in (self.cells.triangles, self.cells.quads)])
        mask = self.nodes_of(~(after <= _GROWTH * before + before.mean())) & (s > 0)
        if self.bound is None or mask.any():
            return mask
        bad = self.shape.strays(y, self.bound, still)
        t = len(self.cells.triangles)
        mask[self.cells.triangles[bad[:t]]] = True
        mask[self.cells.quads[bad[t:]]] = True
        return mask

    def nodes_of(self, frames: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """(n,) nodes of some frames."""
        mask = np.zeros(len(self.start), dtype=bool)
        mask[self.energy.frames.nodes[frames]] = True
        return mask

    def frame_normals(self, points: Floats, normals: Floats | None) -> Floats:
        """(f, 3) unit normal each frame is measured against: the mean of the surface's at its smooth nodes."""
        frames = self.energy.frames
        f1, f2 = (np.stack(f, axis=1) for f in frames.derivatives(points))
        own = unit_vectors(np.cross(f1, f2))
        if normals is None:
            return own
        mean = (unit_vectors(normals) * self._smooth[:, None])[frames.nodes].sum(axis=1)
        known = np.linalg.norm(mean, axis=1) > _KNOWN
        return np.where(known[:, None], unit_vectors(mean), own)

    def around(self, nodes: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """(n,) the nodes and all that share an edge with one of them."""
        result = nodes.copy()
        result[self.edges[nodes[self.edges].any(axis=1)]] = True
        return result


def descend(surface: Surface, tolerance: float, outcome: Outcome) -> Iterator[Iterate]:
    """Lower the energy until a step would gain less than `tolerance` of it; yields every accepted surface.

    Newton steps along the surface, put back onto it. A node goes as far as the cells around it allow: each has a
    share of its step, which shrinks where a cell would be spoiled, turn over, or leave the input, and recovers.
    The barrier is measured against the normals of the input, which are taken anew in every iteration; within one
    the energy falls.
    """
    energy, target = surface.energy, surface.target
    x = base = surface.start
    share = np.ones(len(x))
    damping, cap, slow = 1.0, _CAP, 0
    decrease = step = 0.0
    held = 0
    while True:
        normals = None if target is None else target.project(base)[2]
        if isinstance(energy, Barrier):
            energy.damping, energy.normals = damping, surface.frame_normals(x, normals)
            energy.cap = cap
            energy.settle(x)
        value = energy.value(x)
        yield Iterate(x, value, decrease, step, held)
        gradient, linear = _system(surface, x, normals)
        v = linear.solve(-gradient, surface.precision)
        if not -(gradient * v).sum() > tolerance * value:
            outcome.reason, outcome.converged = "no step lowers the energy further", True
            return
        found = _search(surface, x, base, linear, -gradient, v, share)
        cautious = False
        while found is None and damping < 64.0 and isinstance(energy, Barrier):
            damping = energy.damping = 8 * damping
            gradient, linear = _system(surface, x, normals)
            v = linear.solve(-gradient, surface.precision)
            found = _search(surface, x, base, linear, -gradient, v, np.ones(len(x)))
            cautious = True
        if found is None:
            outcome.reason = "every step that lowers the energy spoils a cell or the shape"
            return
        x_before = x
        x, base, places, new, s, failures = found
        decrease = (value - new) / value
        step = float(np.linalg.norm(x - x_before, axis=1).max())
        held = int((s[surface.moving] == 0).sum())
        damping = min(damping * 2, 16.0) if failures else max(damping * (0.9 if cautious else 0.5), 1 / 8)
        share = np.minimum(1.0, np.maximum(s / s.max(), _HELD / 2) / _SHORTER)
        if decrease < _SETTLED:
            cap = min(2 * cap, _WIDE)
        surface.shape.accept()
        if target is not None and places is not None:
            target.places = places
        slow = slow + 1 if decrease < tolerance and cap == _WIDE else 0
        if slow == _STALL:
            outcome.reason, outcome.converged = "iterations hardly lower the energy any more", True
            if held:
                outcome.reason += f"; {held} nodes are held at the limits of the shape"
            return


def _system(surface: Surface, x: Floats, normals: Floats | None) -> tuple[Floats, Linear]:
    """The derivative of the energy, and the linear system of a Newton step along the surface."""
    energy = surface.energy
    hessian = energy.hessian(x)
    if normals is not None:
        # Nodes are put back onto the surface: the limit eps = 0, and the normal is that of where they are.
        return surface.slope(x), Linear(hessian, holding(normals, x, surface.features), None, surface.moving)
    stiffness = nodal_areas(x, surface.cells) / surface.eps
    gradient = energy.gradient(x)
    vectors = nodal_vectors(x, surface.cells)
    linear = Linear(hessian, holding(vectors, x, surface.features), stiffness, surface.moving)
    for _ in range(0 if surface.normal == "linear" else 3):
        v = linear.solve(-gradient, surface.precision)
        vectors = transport_vectors(x, x + v, surface.cells, surface.normal)
        linear = Linear(hessian, holding(vectors, x, surface.features), stiffness, surface.moving)
    return gradient, linear


def _search(  # type: ignore[no-untyped-def]
    surface: Surface, x: Floats, base: Floats, linear: Linear, force: Floats, v: Floats, share: Floats
):
    """Shorten or hold the steps of nodes whose cells are in trouble; where the energy does not fall, all of them."""
    energy = surface.energy
    before = energy.densities(x)
    value = float(before.sum())
    longest = _LONGEST * surface.edge_lengths(x)
    free = share > _HELD
    failures, shortened = 0, not free.all()
    if shortened:
        v = linear.solve(force, surface.precision, free)
    s = np.minimum(share, longest / np.maximum(np.linalg.norm(v, axis=1), 1e-300)) * free
    counts: list[int] = []
    for tries in range(_TRIES):
        y, moved, places = surface.retracted(base, s[:, None] * v)
        after = energy.densities(y)
        trouble = surface.in_trouble(y, before, after, s)
        if trouble.any():
            counts.append(int(trouble.sum()))
            if len(counts) > 3 and counts[-1] > 2 * counts[0] > 2 * _FEW:
                return None  # what is held brings the next into trouble: the step is too long for all
            # Who is held already is not to blame: the neighbours are in the way, or else everybody.
            blamed = (trouble | surface.around(trouble & (s == 0))) & (s > 0)
            shortened = True
            s[blamed] *= _SHORTER if tries < 2 else 0.0
            if not blamed.any():
                failures += 1
                s *= 0.5
            continue
        new = float(after.sum())
        if new < value and abs(surface.area_excess(y)) <= _SLACK:
            return y, moved, places, new, s, failures
        if shortened and (s < _HELD).any():
            # Steps of unequal length need not descend: those of the others follow from who is held.
            shortened = False
            free = s >= _HELD
            v = linear.solve(force, surface.precision, free)
            s = np.minimum(s, longest / np.maximum(np.linalg.norm(v, axis=1), 1e-300)) * free
            continue
        failures += 1
        rise = after - before
        if failures <= _BLAMES and not new < value:
            # Mostly a few cells raise it, where the surface is too rough to follow.
            s[surface.nodes_of(rise > 0.3 * rise.max())] *= 0.0 if failures > 1 else _SHORTER
            shortened = True
        else:
            s *= 0.5
    return None


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
