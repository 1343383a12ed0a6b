"""The boundary of a run: what is held exactly, and the barrier that keeps the rest near the surface."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common import MeshError, first_names
from ..formulation import Schedules
from ..geometry import (
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
from ..io import read_surface
from ..mesh import NormalizedMesh, find_interfaces, find_regions
from ..solver import (
    AdmissibleDirections,
    boundary_directions,
    count_free_directions,
    coupled_nodes,
    fixed_components,
    line_normal_sums,
    planar_normal_sums,
)
from .options import Options

__all__ = ["Boundary", "boundary_of", "flat_normals"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

_AXIS = 1e-9  # components of a unit normal below this are rounding
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
    tags = surface_tags(normalized.mesh, normalized.node_ids[quads])
    faces = _inner_faces(normalized, options)
    coupled, told = coupled_nodes(normalized, options.couplings)
    if options.boundary != "slide" or options.hausdorff == 0.0:
        edges = kept_edges(points, quads, cells, tags) if options.boundary == "slide" else None
        labels, planes = normalized.node_labels, _planar_normals(points, faces.quads)
        admissible = boundary_directions(points, quads, options.boundary, fixed, labels, edges, planes, coupled)
        if len(faces.quads) == 0:
            return Boundary(admissible, notes=told)
        can = count_free_directions(planes)[np.unique(faces.quads)] > 0
        slide = f"{faces.note}: {can.sum()} nodes slide in them, {(~can).sum()} stay"
        return Boundary(admissible, notes=(slide, *told))
    tolerance = options.hausdorff * normalized.diagonal
    reference = _given_surface(normalized, options.surface)
    how: dict[str, Any] = {"mode": options.features, "tolerance": tolerance, "schedule": schedules.features}
    features = find_features(points, quads, tags=tags, cells=cells, **how)
    flat_within = schedules.barrier.flat * tolerance
    sums, nowhere = np.zeros((len(points), 3, 3)), np.zeros(len(points), dtype=bool)
    if not features.soft and reference is None:
        sums, flat = flat_normals(points, quads, features.patches, flat_within)
        sums += _normals_of_curves(points, features, sums, flat)
    skin, sliding = sums, nowhere.copy()
    sliding[quads] = True
    sliding &= count_free_directions(skin) == 3
    if not features.soft:
        # Straight edges between flat patches need no barrier, curved ones do.
        sliding |= _on_bent(features, skin)
    notes = [f"features: {features.reason}", *told]
    inner, bent = None, nowhere
    if len(faces.quads):
        inner = find_inner_sheets(points, faces.quads, faces.kinds, **how)
        own, flat = flat_normals(points, inner.quads, inner.features.patches, flat_within)
        sums = skin + own
        sums += _normals_of_curves(points, inner.features, sums, flat)
        bent = ~flat | _on_bent(inner.features, sums)
        features = joined_features(points, features, inner.features)
        notes.append(f"{faces.note} in {inner.sheets.max() + 1} sheets: {inner.features.reason}")
    admissible = AdmissibleDirections.from_normal_sums(sums, fixed, coupled)
    free = admissible.free(len(points))
    surface = _kept_near(points, quads if (sliding & free).any() else quads[:0], inner, bent & free)
    if surface is None:
        return Boundary(admissible, None, tuple(notes), inner=inner)
    if reference is not None and surface.sheets is not None:
        reference = _with_sheets(reference, surface)
    barrier = DistanceBarrier.around(surface, tolerance, features, reference, schedules.barrier)
    every = quads if inner is None else np.concatenate([quads, inner.quads])
    return Boundary(admissible, barrier, tuple(notes), every, features.patches, inner)


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
    found = find_interfaces(normalized.cells, regions.labels[normalized.cell_ids])
    quads, kinds = found.quads, found.owners
    what = f"{len(regions.names)} regions ({regions.source}: {first_names(list(regions.names))})"
    return _InnerFaces(quads, kinds, f"interfaces: {what}, {len(quads)} faces between them are kept")


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
