"""The boundary of a run: what is held exactly, and the barrier that keeps the rest near the surface."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common import first_names
from ..formulation import Schedules
from ..geometry import (
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
    surface_tags,
)
from ..mesh import NormalizedMesh, find_regions, interface_quads
from ..solver import (
    AdmissibleDirections,
    boundary_directions,
    count_free_directions,
    fixed_components,
    line_normal_sums,
    planar_normal_sums,
)
from .given_surface import Fit, GivenSurface, fit_to
from .options import Options

__all__ = ["Boundary", "boundary_of", "flat_normals"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

_AXIS = 1e-9  # components of a unit normal below this are rounding


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
        Another surface to slide on; None where there is none.
    start
        (n, 3) points with the skin where it belongs on that; None where no features are matched.
    """

    admissible: AdmissibleDirections
    barrier: DistanceBarrier | None = None
    notes: tuple[str, ...] = ()
    quads: Ints = field(default_factory=lambda: np.empty((0, 4), np.int64))
    patches: Ints = field(default_factory=lambda: np.empty(0, np.int64))
    inner: InnerSheets | None = None
    reference: SurfaceLocator | None = None
    start: Field | None = None


def boundary_of(
    normalized: NormalizedMesh, options: Options, schedules: Schedules | None = None, matches: bool = True
) -> Boundary:
    """The boundary as the options ask for it.

    Flat patches are kept exactly: their nodes move in their planes, and so along straight edges between them.
    Everything else slides within a bound around the surface. On another surface that is so where its features are
    matched with the mesh's, if that is not turned off.

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
    tags = surface_tags(normalized.mesh, normalized.node_ids[quads])
    faces = _inner_faces(normalized, options)
    if options.boundary != "slide" or options.hausdorff == 0.0:
        edges = kept_edges(points, quads, cells, tags) if options.boundary == "slide" else None
        labels, planes = normalized.node_labels, _planar_normals(points, faces.quads)
        admissible = boundary_directions(points, quads, options.boundary, fixed, labels, edges, planes)
        if len(faces.quads) == 0:
            return Boundary(admissible)
        can = count_free_directions(planes)[np.unique(faces.quads)] > 0
        return Boundary(admissible, notes=(f"{faces.note}: {can.sum()} nodes slide in them, {(~can).sum()} stay",))
    tolerance = options.hausdorff * normalized.diagonal
    given = None if options.surface is None else GivenSurface.of(normalized, options.surface)
    reference, fit = None if given is None else given.locator, Fit(None, "")
    if given is not None and matches:
        fit = fit_to(normalized, given, options, schedules, tags, fixed)
    how: dict[str, Any] = {"mode": options.features, "tolerance": tolerance, "schedule": schedules.features}
    features = find_features(points, quads, tags=tags, cells=cells, **how)
    flat_within = schedules.barrier.flat * tolerance
    notes = [f"features: {features.reason}"]
    sums, nowhere = np.zeros((len(points), 3, 3)), np.zeros(len(points), dtype=bool)
    matching, labels = fit.matching, np.zeros(len(quads), np.int64)
    if matching is not None:
        points, features, labels = matching.points, matching.features, matching.sheets
        notes = [fit.note]
        sums = flat_normals(points, quads, labels, flat_within)[0] + _normals_of_matched(points, features)
    elif not features.soft and reference is None:
        sums, flat = flat_normals(points, quads, features.patches, flat_within)
        sums += _normals_of_curves(points, features, sums, flat)
    else:
        notes += [fit.note] if fit.note else []
    skin, sliding = sums, nowhere.copy()
    sliding[quads] = True
    sliding &= count_free_directions(skin) == 3
    if not features.soft:
        # Straight edges between flat patches need no barrier, curved ones do.
        sliding |= _on_bent(features, skin)
    inner, bent, there = None, nowhere, None if matching is None else matching.curves
    if len(faces.quads):
        inner = find_inner_sheets(points, faces.quads, faces.kinds, **how)
        own, flat = flat_normals(points, inner.quads, inner.features.patches, flat_within)
        sums = skin + own
        sums += _normals_of_curves(points, inner.features, sums, flat)
        bent = ~flat | _on_bent(inner.features, sums)
        there = None if there is None else _with_curves(there, points, features, inner.features)
        features = joined_features(points, features, inner.features)
        notes.append(f"{faces.note} in {inner.sheets.max() + 1} sheets: {inner.features.reason}")
    admissible = AdmissibleDirections.from_normal_sums(sums, fixed)
    free = admissible.free(len(points))
    moves = (sliding & free).any() or (reference is not None and (bent & free).any())
    surface = _kept_near(points, quads if moves else quads[:0], labels, inner, bent & free)
    start = None if matching is None else points
    if surface is None:
        return Boundary(admissible, None, tuple(notes), inner=inner, reference=reference, start=start)
    beside = reference if matching is None else matching.reference
    if beside is not None and surface.sheets is not None:
        beside = _with_sheets(beside, surface, int(labels.max()) + 1)
    barrier = DistanceBarrier.around(surface, tolerance, features, beside, schedules.barrier, there)
    every = quads if inner is None else np.concatenate([quads, inner.quads])
    return Boundary(admissible, barrier, tuple(notes), every, features.patches, inner, reference, start)


@dataclass(frozen=True, eq=False)
class _InnerFaces:
    """Faces (k, 4) inside the mesh that are kept, what kind each is (k,), and what is told of them."""

    quads: Ints
    kinds: Ints
    note: str = ""


def _inner_faces(normalized: NormalizedMesh, options: Options) -> _InnerFaces:
    """The faces between regions."""
    regions = find_regions(normalized.mesh, options.interfaces)
    if regions is None:
        return _InnerFaces(np.empty((0, 4), np.int64), np.empty(0, np.int64))
    quads, kinds = interface_quads(normalized.cells, regions.labels[normalized.cell_ids])
    what = f"{len(regions.names)} regions ({regions.source}: {first_names(list(regions.names))})"
    return _InnerFaces(quads, kinds, f"interfaces: {what}, {len(quads)} faces between them are kept")


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


def _with_curves(there: CurveLocator, points: Field, skin: Features, inner: Features) -> CurveLocator:
    """Curves of another surface, and those inside as they are, by the numbers that joined features have."""
    offset = int(skin.curves.max(initial=-1)) + 1
    edges = np.concatenate([there.edges, inner.edges + len(there.points)])
    numbers = np.concatenate([there.curves, inner.curves + offset])
    return CurveLocator(np.concatenate([there.points, points]), edges, numbers)


def _normals_of_matched(points: Field, features: Features) -> Field:
    """(n, 3, 3) normals of straight curves, and all directions at corners: these are where they belong."""
    lines = line_normal_sums(points, features.edges)
    lines[count_free_directions(lines) != 1] = 0.0
    lines[features.corners] = np.eye(3)
    return lines


def _on_bent(features: Features, sums: Field) -> Mask:
    """(n,) nodes of feature edges at an end of which more than one direction is free."""
    on = np.zeros(len(sums), dtype=bool)
    on[features.edges[count_free_directions(sums)[features.edges].max(axis=1) > 1]] = True
    return on


def _planar_normals(points: Field, quads: Ints) -> Field:
    """Sums (n, 3, 3) of n n^T over faces inside: nodes slide where all lie in one plane, or along where two meet."""
    if len(quads) == 0:
        return np.zeros((len(points), 3, 3))
    # A quad with an edge of no length, in a tangled mesh, is no obstacle: the others around its nodes have planes.
    x = points[quads]
    edges = np.linalg.norm(x - np.roll(x, 1, axis=1), axis=2)
    return planar_normal_sums(points, quads[(edges > 0.0).all(axis=1)])


def flat_normals(points: Field, quads: Ints, patches: Ints, tolerance: float) -> tuple[Field, Mask]:
    """Find the flat patches of a boundary, and the normals of their planes.

    Parameters
    ----------
    points
        (n, 3) coordinates.
    quads
        (k, 4) boundary quads.
    patches
        (k,) patch of each.
    tolerance
        Distance from its plane up to which a patch is flat.

    Returns
    -------
    (n, 3, 3) sums of n n^T over the planes of the flat patches around every node;
    (n,) the nodes around which all patches are flat.
    """
    sums, flat = np.zeros((len(points), 3, 3)), np.ones(len(points), dtype=bool)
    order = np.argsort(patches, kind="stable")
    for part in np.split(order, np.flatnonzero(np.diff(patches[order])) + 1):
        nodes = np.unique(quads[part])
        x = points[nodes] - points[nodes].mean(axis=0)
        normal = np.linalg.eigh(x.T @ x)[1][:, 0]
        if np.abs(x @ normal).max() <= tolerance:
            # Exact zeros and ones on the axes: a cube's faces stay flat to the last bit.
            normal[np.abs(normal) < _AXIS] = 0.0
            sums[nodes] += np.outer(normal, normal) / (normal @ normal)
        else:
            flat[nodes] = False
    return sums, flat


def _normals_of_curves(points: Field, features: Features, sums: Field, flat: Mask) -> Field:
    """(n, 3, 3) normals that the sums lack to keep straight curves that lie in planes, and their ends: fronts, tags."""
    lines, free = line_normal_sums(points, features.edges), count_free_directions(sums)
    ends = np.zeros(len(points), dtype=bool)
    ends[features.corners] = True
    straight = (free == 2) & (count_free_directions(lines) == 1)
    lines[~flat | ~(straight | ends)] = 0.0
    return lines
