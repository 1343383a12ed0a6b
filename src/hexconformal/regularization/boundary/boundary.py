"""The boundary of a run: what is held exactly, and the barrier that keeps the rest near the surface."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...common import MeshError
from ...formulation import Schedules
from ...geometry import (
    DistanceBarrier,
    Faces,
    InnerSheets,
    SurfaceLocator,
    fan_triangles,
    find_features,
    find_inner_sheets,
    joined_features,
    kept_edges,
    wire_features,
)
from ...io import read_surface
from ...mesh import NormalizedMesh
from ...solver import (
    AdmissibleDirections,
    boundary_directions,
    count_free_directions,
    coupled_nodes,
    fixed_components,
)
from ..options import Options
from .exact_parts import flat_normals, normals_of_curves, on_bent, planes_inside, wire_normals
from .kept_geometry import kept_geometry

__all__ = ["Boundary", "boundary_of"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

_APART = 0.2  # diagonals between the sides of the boxes of mesh and surface from which on they are strangers


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
    """

    admissible: AdmissibleDirections
    barrier: DistanceBarrier | None = None
    notes: tuple[str, ...] = ()
    quads: Ints = field(default_factory=lambda: np.empty((0, 4), np.int64))
    patches: Ints = field(default_factory=lambda: np.empty(0, np.int64))
    inner: InnerSheets | None = None


def boundary_of(normalized: NormalizedMesh, options: Options, schedules: Schedules | None = None) -> Boundary:
    """The boundary as the options ask for it.

    Flat patches are kept exactly: their nodes move in their planes, and so along straight edges between them.
    Everything else slides within a bound around the surface.

    Raises
    ------
    OptionError
        If masks or modes make no sense.
    MeshError
        If the surface to slide on is not that of the mesh.
    """
    schedules = Schedules() if schedules is None else schedules
    fixed = fixed_components(normalized.mesh, options.fixed)[normalized.node_ids]
    points, quads, cells = normalized.points, normalized.quads, normalized.cells
    kept = kept_geometry(normalized, options)
    fixed |= kept.held[:, None]
    coupled, told = coupled_nodes(normalized, options.couplings)
    notes = [*kept.notes, *told]
    wires = wire_features(points, kept.edges, kept.edge_kinds, schedules.features) if len(kept.edges) else None
    if options.boundary != "slide" or options.hausdorff == 0.0:
        edges = kept_edges(points, quads, cells, kept.tags) if options.boundary == "slide" else None
        exact = planes_inside(points, kept.quads) + (0.0 if wires is None else wire_normals(points, wires, False))
        labels, mode = normalized.node_labels, options.boundary
        admissible = boundary_directions(points, quads, mode, fixed, labels, edges, exact, coupled)
        if len(kept.quads):
            can = count_free_directions(exact)[np.unique(kept.quads)] > 0
            notes.insert(0, f"{can.sum()} nodes of faces inside slide in their planes, {(~can).sum()} stay")
        return Boundary(admissible, notes=tuple(notes))
    tolerance = options.hausdorff * normalized.diagonal
    reference = _given_surface(normalized, options.surface)
    how: dict[str, Any] = {"mode": options.features, "tolerance": tolerance, "schedule": schedules.features}
    features = find_features(points, quads, tags=kept.tags, cells=cells, **how)
    notes.insert(0, f"features: {features.reason}")
    flat_within = schedules.barrier.flat * tolerance
    sums = np.zeros((len(points), 3, 3))
    if not features.soft and reference is None:
        sums, flat = flat_normals(points, quads, features.patches, flat_within)
        sums += normals_of_curves(points, features, sums, flat)
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
    surface = _kept_near(points, quads if (sliding & free).any() else quads[:0], inner, leaving & free)
    if surface is None:
        return Boundary(admissible, None, tuple(notes), inner=inner)
    if reference is not None and surface.sheets is not None:
        reference = _with_sheets(reference, surface)
    if len(parts) > 1:
        features = joined_features(points, *parts)
    barrier = DistanceBarrier.around(surface, tolerance, features, reference, schedules.barrier)
    every = quads if inner is None else np.concatenate([quads, inner.quads])
    return Boundary(admissible, barrier, tuple(notes), every, features.patches, inner)


def _kept_near(points: Field, skin: Ints, inner: InnerSheets | None, moving: Mask) -> SurfaceLocator | None:
    """The surface to be kept near where it was: a skin, and the sheets that moving nodes (n,) may leave."""
    if inner is None:
        return SurfaceLocator(points, skin) if len(skin) else None
    curved = np.unique(inner.sheets[moving[inner.quads].any(axis=1)])
    which = np.isin(inner.sheets, curved)
    quads = np.concatenate([skin, inner.quads[which]])
    if len(quads) == 0:
        return None
    labels = np.concatenate([np.zeros(len(skin), np.int64), np.searchsorted(curved, inner.sheets[which]) + 1])
    return SurfaceLocator(points, quads, labels if len(curved) else None)


def _with_sheets(reference: SurfaceLocator, surface: SurfaceLocator) -> SurfaceLocator:
    """Another surface for the skin to slide on, and the sheets inside as they are."""
    sheets = np.asarray(surface.sheets)
    inside = sheets > 0
    points, fans, of = fan_triangles(surface.points, Faces.of(surface.faces[inside]))
    skin = Faces.of(reference.faces)
    there, faces, _ = fan_triangles(reference.points, skin)
    labels = np.concatenate([np.zeros(len(faces), np.int64), sheets[inside][of]])
    return SurfaceLocator(np.concatenate([there, points]), np.concatenate([faces, fans + len(there)]), labels)


def _given_surface(normalized: NormalizedMesh, surface: Any) -> SurfaceLocator | None:
    """The surface to slide on, if the user gives one, normalized as the mesh."""
    if surface is None:
        return None
    if isinstance(surface, str) or hasattr(surface, "__fspath__"):
        surface = read_surface(surface)
    given = SurfaceLocator.from_pyvista(surface)
    _require_near(normalized, given)
    return SurfaceLocator(normalized.from_user(given.points), given.faces)


def _require_near(normalized: NormalizedMesh, given: SurfaceLocator) -> None:
    """Refuse a surface that cannot be that of the mesh: boxes are no farther apart than what they are around."""
    there, here = (
        given.points[given.faces].reshape(-1, 3),
        normalized.mesh.points[normalized.node_ids[normalized.referenced]],
    )
    boxes = [(x.min(axis=0), x.max(axis=0)) for x in (there, here)]
    sizes = [float(np.linalg.norm(high - low)) for low, high in boxes]
    apart = max(float(np.abs(a - b).max()) for a, b in zip(*boxes, strict=True))
    if apart > _APART * sizes[1]:
        (low, high), (low_here, high_here) = (tuple(", ".join(f"{x:.4g}" for x in end) for end in box) for box in boxes)
        raise MeshError(
            f"the surface is not that of the mesh: it reaches from ({low}) to ({high}), diagonal {sizes[0]:.4g}, the "
            f"mesh from ({low_here}) to ({high_here}), diagonal {sizes[1]:.4g}, a ratio of "
            f"{sizes[0] / sizes[1]:.3g}; is it another unit of length, another origin, or another file?"
        )
