"""The boundary of a run: what is held exactly, and the barrier that keeps the rest near the surface."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from ...formulation import Schedules
from ...geometry import (
    CurveLocator,
    DistanceBarrier,
    Faces,
    Features,
    InnerSheets,
    SurfaceLocator,
    fan_triangles,
    find_features,
    find_inner_sheets,
    joined_features,
    kept_edges,
    wire_features,
)
from ...mesh import NormalizedMesh, boundary_depths
from ...solver import (
    AdmissibleDirections,
    boundary_directions,
    count_free_directions,
)
from ..options import Options
from .exact_parts import flat_normals, normals_inside, normals_of_curves, on_bent, wire_normals
from .given_surface import Fit, GivenSurface, fit_to
from .said import Said, what_is_said

__all__ = ["Boundary", "Measure", "Value", "boundary_of"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]
Value = TypeVar("Value")
Measure = Callable[[Field, NormalizedMesh, "Boundary"], Value]


@dataclass(frozen=True)
class Boundary:
    """Constraint and barrier that keep the boundary of a mesh.

    Attributes
    ----------
    admissible
        Directions nodes may go in, exactly: none, along a straight line, in a plane.
    barrier
        Keeps curved parts near the surface; None where there are none that may move.
    notes
        Decisions, in words.
    quads, patches
        (q, 4) faces of the boundary and of the sheets inside, and the smooth patch (q,) of each; empty where there is
        no barrier.
    inner
        The sheets inside; None where there are none, or they are held.
    reference
        Another surface to slide on; None where it is that of the mesh.
    start
        (n, 3) points with the skin where it belongs on that surface; None where nothing of it is matched.
    """

    admissible: AdmissibleDirections
    barrier: DistanceBarrier | None = None
    notes: tuple[str, ...] = ()
    quads: Ints = field(default_factory=lambda: np.empty((0, 4), np.int64))
    patches: Ints = field(default_factory=lambda: np.empty(0, np.int64))
    inner: InnerSheets | None = None
    reference: SurfaceLocator | None = None
    start: Field | None = None

    def measured(self, points: Field, normalized: NormalizedMesh, measure: Measure[Value]) -> Value:
        """What is measured of points (n, 3) of a mesh and its boundary, wherever all of this is."""
        return measure(points, normalized, self)

    def with_sheets_held(self, normalized: NormalizedMesh, options: Options, schedules: Schedules) -> Boundary:
        """The boundary with the nodes of the sheets inside held."""
        return boundary_of(normalized, options, schedules, held=self.on_sheets(len(normalized.points)))

    def on_sheets(self, count: int) -> Mask:
        """(count,) nodes of the sheets inside."""
        on = np.zeros(count, dtype=bool)
        if self.inner is not None:
            on[self.inner.quads] = True
        return on


def boundary_of(
    normalized: NormalizedMesh,
    options: Options,
    schedules: Schedules | None = None,
    *,
    matches: bool = True,
    held: Mask | None = None,
    said: Said | None = None,
) -> Boundary:
    """The boundary as the options ask for it.

    Flat patches are kept exactly: their nodes move in their planes, and so along straight edges between them.
    Everything else slides within a bound around the surface. On another surface that is so where its features are
    matched with the mesh's, if that is not turned off. Nodes (n,) may be held besides. What the mesh and the options
    say of nodes and faces may be known already.

    Raises
    ------
    OptionError
        If masks or modes make no sense.
    MeshError
        If the surface to slide on is not that of the mesh.
    """
    schedules = Schedules() if schedules is None else schedules
    near = schedules.barrier
    if options.feature_band is not None:
        near = replace(near, curve_bound=options.feature_band)
    points, quads, cells = normalized.points, normalized.quads, normalized.cells
    said = what_is_said(normalized, options) if said is None else said
    kept, coupled = said.kept, said.coupled
    fixed = said.fixed | (kept.held if held is None else kept.held | held)[:, None]
    notes = [*kept.notes, *said.notes]
    wires = wire_features(points, kept.edges, kept.edge_kinds, schedules.features) if len(kept.edges) else None
    if options.boundary != "slide" or options.hausdorff == 0.0:
        edges = kept_edges(points, quads, cells, kept.kinds_of_skin) if options.boundary == "slide" else None
        exact = normals_inside(points, kept.quads, kept.kinds, quads)
        exact += 0.0 if wires is None else wire_normals(points, wires, False)
        labels, mode = normalized.node_labels, options.boundary
        admissible = boundary_directions(points, quads, mode, fixed, labels, edges, exact, coupled)
        if len(kept.quads):
            held_back = np.eye(3) - admissible.all_projectors(len(points))
            can = count_free_directions(held_back)[np.unique(kept.quads)] > 0
            notes.insert(0, f"{can.sum()} nodes of faces inside slide in their planes, {(~can).sum()} stay")
        return Boundary(admissible, notes=tuple(notes))
    tolerance = options.hausdorff * normalized.diagonal
    given = None if options.surface is None else GivenSurface.of(normalized, options.surface)
    reference, fit = None if given is None else given.locator, Fit(None, "")
    if given is not None and matches:
        fit = fit_to(normalized, given, options, schedules, kept.tags, fixed)
    how: dict[str, Any] = {"mode": options.features, "tolerance": tolerance, "schedule": schedules.features}
    features = find_features(points, quads, tags=kept.kinds_of_skin, cells=cells, **how)
    flat_within = schedules.barrier.flat * tolerance
    sums, labels, there = np.zeros((len(points), 3, 3)), np.zeros(len(quads), np.int64), None
    if fit.matching is not None:
        features, labels, there = fit.matching.features, fit.matching.sheets, fit.matching.curves
        shift = fit.matching.points - points
        points = points + coupled.averaged(shift) if len(coupled.nodes) else fit.matching.points
        sums = flat_normals(points, quads, labels, flat_within)[0] + wire_normals(points, features, True)
    else:
        notes.insert(0, f"features: {features.reason}")
        if not features.soft and reference is None:
            sums, flat = flat_normals(points, quads, features.patches, flat_within)
            sums += normals_of_curves(points, features, sums, flat)
    if fit.note:
        notes.insert(0, fit.note)
    sliding = np.zeros(len(points), dtype=bool)
    sliding[quads] = True
    sliding &= count_free_directions(sums) == 3
    if not features.soft:
        # Straight edges between flat patches need no barrier, curved ones do.
        sliding |= on_bent(features, sums)
    inner, leaving, parts = None, np.zeros_like(sliding), [features]
    if len(kept.quads):
        inner = find_inner_sheets(points, kept.quads, kept.kinds, **how)
        own, flat = flat_normals(points, inner.quads, inner.features.patches, flat_within)
        sums = sums + own
        sums += normals_of_curves(points, inner.features, sums, flat)
        leaving = ~flat | on_bent(inner.features, sums)
        parts.append(inner.features)
        notes.append(f"faces inside: {inner.sheets.max() + 1} sheets, {inner.features.reason}")
    if wires is not None:
        sums = sums + wire_normals(points, wires, True)
        sliding |= on_bent(wires, sums)
        parts.append(wires)
    admissible = AdmissibleDirections.from_normal_sums(sums, fixed, coupled)
    free = admissible.free(len(points))
    moves = (sliding & free).any() or (reference is not None and (leaving & free).any())
    surface = _kept_near(points, quads if moves else quads[:0], labels, inner, leaving & free)
    start = None if fit.matching is None else points
    if surface is None:
        return Boundary(admissible, None, tuple(notes), inner=inner, reference=reference, start=start)
    beside = reference if fit.matching is None else fit.matching.reference
    if beside is not None and surface.sheets is not None:
        beside = _with_sheets(beside, surface, int(labels.max()) + 1)
    if len(parts) > 1:
        features = joined_features(points, *parts)
        there = None if there is None else _with_curves(there, points, parts[1:], features)
    depths = np.full(len(surface.faces), np.inf)
    if moves:
        valid = normalized.valid[normalized.skin[1]]
        depths[: len(quads)] = np.where(valid, boundary_depths(normalized.points, cells, *normalized.skin), np.inf)
    barrier = DistanceBarrier.around(surface, tolerance, features, beside, near, there, depths)
    every = quads if inner is None else np.concatenate([quads, inner.quads])
    return Boundary(admissible, barrier, tuple(notes), every, features.patches, inner, reference, start)


def _kept_near(
    points: Field, skin: Ints, sheets: Ints, inner: InnerSheets | None, moving: Mask
) -> SurfaceLocator | None:
    """The surface to be kept near where it was: a skin with its sheets, and those that moving nodes (n,) may leave."""
    own = sheets if sheets.any() else None
    if inner is None:
        return SurfaceLocator(points, skin, own) if len(skin) else None
    curved = np.unique(inner.sheets[moving[inner.quads].any(axis=1)])
    which = np.isin(inner.sheets, curved)
    quads = np.concatenate([skin, inner.quads[which]])
    if len(quads) == 0:
        return None
    first = int(sheets.max(initial=0)) + 1
    labels = np.concatenate([sheets[: len(skin)], np.searchsorted(curved, inner.sheets[which]) + first])
    return SurfaceLocator(points, quads, labels if len(curved) else own)


def _with_sheets(reference: SurfaceLocator, surface: SurfaceLocator, first: int) -> SurfaceLocator:
    """Another surface for the skin to slide on, and the sheets inside as they are, numbers from the first on."""
    sheets = np.asarray(surface.sheets)
    inside = sheets >= first
    if not inside.any():
        return reference
    points, fans, of = fan_triangles(surface.points, Faces.of(surface.faces[inside]))
    skin = Faces.of(reference.faces)
    there, faces, _ = fan_triangles(reference.points, skin)
    own = np.zeros(len(faces), np.int64) if reference.sheets is None else reference.sheets
    labels = np.concatenate([own, sheets[inside][of]])
    return SurfaceLocator(np.concatenate([there, points]), np.concatenate([faces, fans + len(there)]), labels)


def _with_curves(there: CurveLocator, points: Field, others: list[Features], joined: Features) -> CurveLocator:
    """Curves of another surface, and others inside as they are, by the numbers that joined features have."""
    edges = np.concatenate([other.edges for other in others])
    numbers = np.concatenate([there.curves, joined.curves[len(joined.curves) - len(edges) :]])
    return CurveLocator(
        np.concatenate([there.points, points]), np.concatenate([there.edges, edges + len(there.points)]), numbers
    )
