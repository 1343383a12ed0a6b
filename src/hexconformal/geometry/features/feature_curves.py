"""Feature curves, corners and smooth patches of a surface."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...common import OptionError
from ...mesh import connected_components
from ..edges import EdgeTable, edge_table
from ..faces import Faces
from .chains import Chains, chains
from .crack_fronts import crack_fronts
from .dihedral_angles import dihedral_angles, filtered_normals, rounded_edges, stair_steps
from .schedules import FeatureSchedule

__all__ = ["CORNER", "CURVE", "SMOOTH", "Features", "find_features", "nonmanifold_nodes"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

SMOOTH, CURVE, CORNER = 0, 1, 2


@dataclass(frozen=True, eq=False)
class Features:
    """Feature curves and corners of a surface, and the smooth patches between them.

    Attributes
    ----------
    kind
        (n,) SMOOTH, CURVE, or CORNER, which belongs to no single curve or patch.
    edges
        (k, 2) nodes of the feature edges.
    curves
        (k,) curve of each feature edge; a curve runs from corner to corner, or is closed.
    patches
        (f,) smooth patch of each face.
    soft
        Whether curves and corners need not be kept: they are noise, stair steps, or smaller than how far the
        surface may move.
    reason
        What was found and decided, and why, in words.
    slack_curves
        (c,) numbers of curves that may go as far as the surface: where soft sheets meet.
    """

    kind: NDArray[np.int8]
    edges: Ints
    curves: Ints
    patches: Ints
    soft: bool = False
    reason: str = ""
    slack_curves: Ints = field(default_factory=lambda: np.empty(0, np.int64))

    @property
    def corners(self) -> Ints:
        """Nodes that are corners, ascending."""
        return np.flatnonzero(self.kind == CORNER)

    @property
    def slack(self) -> Mask:
        """(k,) feature edges that may go as far as the surface."""
        return np.isin(self.curves, self.slack_curves)

    @property
    def slack_corners(self) -> Mask:
        """(c,) corners all of whose edges may."""
        tied, all_tied = np.zeros(len(self.kind), dtype=bool), np.ones(len(self.kind), dtype=bool)
        tied[self.edges[~self.slack]] = True
        all_tied[self.edges[self.slack]] = False
        return ~(tied | all_tied)[self.corners]

    @classmethod
    def along(
        cls,
        points: Floats,
        faces: Faces,
        edges: EdgeTable,
        chosen: Ints,
        stops: Mask,
        turn: float = FeatureSchedule.turn,
    ) -> Features:
        """Features along chosen edges, ids of a table, with curves that end where they must, and at some nodes (n,)."""
        nodes = edges.nodes[chosen]
        curves = chains(points, nodes, stops, turn)
        free = np.ones(len(edges.nodes), dtype=bool)
        free[chosen] = False
        kind = np.full(len(points), SMOOTH, dtype=np.int8)
        kind[nodes] = CURVE
        kind[curves.corners | stops] = CORNER
        patches = connected_components(edges.sides[free[edges.manifold]], len(faces))
        return cls(kind, nodes, curves.labels, patches)


def find_features(
    points: Floats,
    faces: Faces | Ints,
    *,
    angle: float = 35.0,
    tags: ArrayLike | None = None,
    cells: Ints | None = None,
    mode: str = "auto",
    tolerance: float = 0.0,
    schedule: FeatureSchedule | None = None,
    curves: Ints | None = None,
) -> Features:
    """Find the smooth patches of a boundary, the curves between them, and the corners.

    Edges where tags change, crack fronts, and edges with other than two faces always belong to a curve. The others are
    found by their angle: a curve is a chain of edges with at least 0.6 `angle` between the (averaged) normals on both
    sides, at least half of them more than `angle` and clearly more than the edges beside. Chains that zigzag, and
    short ones that end anywhere but at other curves, are noise; beside curves that are kept, mode "auto" also leaves
    out longer ones that end like that.

    Parameters
    ----------
    points
        (n, 3) coordinates.
    faces
        Counter-clockwise seen from outside.
    angle
        Degrees between normals, 0 where the surface is flat.
    tags
        (f,) integers per face: curves are where they change, too, whatever the angle.
    cells
        (m, 8) the cells whose boundary this is; with them crack fronts are told from faces that are folded.
    mode
        "keep" and "soft" decide; "auto" lets curves be soft where most of them are stair steps or end in
        the middle of nowhere, and where the surface may move so far that they can be rounded off.
    tolerance
        How far the surface may move, in units of length.
    schedule
        Numbers by which features are told from noise.
    curves
        (k, 2) nodes of edges that belong to a curve, too, whatever the angle.

    Raises
    ------
    OptionError
        If an option makes no sense, or `tags` has another length than `faces`.

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> from hexconformal.mesh.topology import boundary_quads
    >>> points, cells = box((4, 4, 4))
    >>> features = find_features(points, boundary_quads(cells)[0])
    >>> len(features.edges), features.curves.max() + 1, len(features.corners), features.patches.max() + 1
    (48, np.int64(12), 8, np.int64(6))
    >>> features.reason
    '12 curves, 8 corners, 6 patches, kept: sharp'
    """
    if mode not in ("auto", "keep", "soft"):
        raise OptionError(f"features must be 'auto', 'keep' or 'soft', not {mode!r}")
    if not 0 < angle < 180:
        raise OptionError(f"the feature angle must lie between 0 and 180 degrees, not {angle}")
    if not tolerance >= 0:
        raise OptionError(f"tolerance must be 0 or more, not {tolerance}")
    schedule = FeatureSchedule() if schedule is None else schedule
    faces = Faces.of(faces)
    edges = edge_table(faces)
    nonmanifold = nonmanifold_nodes(faces, edges, len(points))
    fronts = np.zeros(len(edges.manifold), dtype=bool)
    if cells is not None:
        fronts = crack_fronts(points, faces, edges, cells, schedule.opening)
    given = np.zeros_like(fronts)
    if curves is not None:
        width = [len(points), 1]
        given = np.isin(edges.nodes[edges.manifold] @ width, np.sort(curves, axis=1) @ width)
    kept = fronts | given | (False if tags is None else _changes(tags, edges, len(faces)))
    # Where a crease comes to a curve that is there anyhow it does not end freely.
    stops = nonmanifold.copy()
    stops[edges.nodes[np.union1d(edges.manifold[kept], edges.nonmanifold)]] = True
    soft, chosen, why = _by_angle(points, faces, edges, fronts, stops, angle, mode, tolerance, schedule)
    if kept.any() and mode != "soft":
        by = [name for name, some in (("tags", kept & ~fronts & ~given), ("crack fronts", fronts)) if some.any()]
        by += ["lines"] if given.any() else []
        why = f"by {' and '.join(by)}, none by angle: {why}" if soft else f"by {', '.join(by)} and angle: {why}"
        soft, chosen = False, np.union1d(chosen[:0] if soft else chosen, edges.manifold[kept])
    chosen = np.union1d(chosen, edges.nonmanifold)
    found = Features.along(points, faces, edges, chosen, nonmanifold, schedule.turn)
    counts = [int(labels.max(initial=-1)) + 1 for labels in (found.curves, found.patches)]
    what = f"{counts[0]} curves, {len(found.corners)} corners, {counts[1]} patches"
    return replace(found, soft=soft, reason=f"{what}, {'soft' if soft else 'kept'}: {why}")


def nonmanifold_nodes(faces: Faces, edges: EdgeTable, count: int) -> Mask:
    """(n,) nodes where several sheets of the surface meet, other than along a curve of nonmanifold edges."""
    flat, corners, after = edges.of_corners, faces.corners, faces.around(1)
    order = np.argsort(flat, kind="stable")
    order = order[np.bincount(flat)[flat[order]] == 2]
    after = after[order]
    swap = corners[order] > corners[after]
    # The corners of a face at both ends of an edge; across it they continue in the other face.
    ends = np.stack([np.where(swap, after, order), np.where(swap, order, after)], axis=1)
    sheet = connected_components(np.stack([ends[0::2].ravel(), ends[1::2].ravel()], axis=1), len(corners))
    first = np.unique(sheet, return_index=True)[1]
    sheets = np.bincount(corners[first], minlength=count)
    uses = np.bincount(flat)[edges.nonmanifold]
    most = np.zeros(count, dtype=np.int64)
    np.maximum.at(most, edges.nodes[edges.nonmanifold], uses[:, None])
    meeting = np.bincount(edges.nodes[edges.nonmanifold].ravel(), minlength=count)
    return np.asarray(np.where(meeting > 0, (meeting != 2) | (sheets != most), sheets > 1))


def _changes(tags: ArrayLike, edges: EdgeTable, count: int) -> Mask:
    """(s,) edges with two faces where tags change."""
    labels = np.asarray(tags)
    if labels.shape != (count,):
        raise OptionError(f"tags must be one per boundary face, ({count},), not {labels.shape}")
    return np.asarray(labels[edges.sides[:, 0]] != labels[edges.sides[:, 1]])


def _by_angle(
    points: Floats,
    faces: Faces,
    edges: EdgeTable,
    fronts: Mask,
    stops: Mask,
    angle: float,
    mode: str,
    tolerance: float,
    schedule: FeatureSchedule,
) -> tuple[bool, Ints, str]:
    """Decide if curves found by their angle need not be kept; tell the edges of those that are found, and why."""
    angles = dihedral_angles(filtered_normals(points, faces, edges, fronts, schedule), edges)
    chosen = _creases(points, faces, edges, angles, angle, stops, schedule.shortest, schedule)
    if mode != "auto":
        return mode == "soft", chosen, f"{mode} as asked"
    both = np.union1d(chosen, edges.nonmanifold)
    soft, open_ends, why = _softness(points, faces, edges, both, stops, angle, tolerance, schedule)
    if open_ends and not soft:
        chosen = _creases(points, faces, edges, angles, angle, stops, schedule.shortest_beside, schedule)
    return soft, chosen, why


def _creases(
    points: Floats,
    faces: Faces,
    edges: EdgeTable,
    angles: Floats,
    angle: float,
    stops: Mask,
    shortest: int,
    schedule: FeatureSchedule,
) -> Ints:
    """Ids of the edges with two faces that belong to creases; those with a free end have `shortest` edges or more."""
    coarse = rounded_edges(angles, faces, edges, schedule)
    chosen = np.flatnonzero(angles > schedule.continued * angle)
    # Where a spur goes two chains become one, so that chains are looked at again until nothing goes.
    while len(chosen):
        nodes = edges.nodes[edges.manifold[chosen]]
        curves = chains(points, nodes, stops, schedule.turn)
        length = np.bincount(curves.labels)
        strong = np.bincount(curves.labels, (angles[chosen] > angle) & ~coarse[chosen])
        piece = connected_components(nodes, len(points))[nodes[:, 0]]
        small = np.bincount(piece)[piece] < schedule.shortest
        good = (strong >= schedule.strong * length) & (curves.zigzag < schedule.zigzag)
        good &= (length >= shortest) | ~_has_free_end(nodes, curves, stops)
        keep = good[curves.labels] & ~small
        if keep.all():
            break
        chosen = chosen[keep]
    return edges.manifold[chosen]


def _has_free_end(nodes: Ints, curves: Chains, stops: Mask) -> Mask:
    """(c,) chains that end where no other begins."""
    free = ((curves.degree[nodes] == 1) & ~stops[nodes]).any(axis=1)
    return np.asarray(np.bincount(curves.labels, free) > 0)


def _softness(
    points: Floats,
    faces: Faces,
    edges: EdgeTable,
    chosen: Ints,
    stops: Mask,
    angle: float,
    tolerance: float,
    schedule: FeatureSchedule,
) -> tuple[bool, bool, str]:
    """Decide if curves found by their angle need not be kept, and tell if some of them end freely, and why."""
    nodes = edges.nodes[chosen]
    lengths = np.linalg.norm(points[nodes[:, 0]] - points[nodes[:, 1]], axis=1)
    if not lengths.any():
        return True, False, "the surface is smooth"
    steps, sharp = stair_steps(points, faces, edges, angle)
    stepped = steps[edges.sides[sharp]].any(axis=1).mean() if sharp.any() else 0.0
    if stepped > schedule.stepped:
        return True, False, f"stair steps, {stepped:.0%} of the sharp edges bound a step of one cell"
    curves = chains(points, nodes, stops, schedule.turn)
    free = lengths[_has_free_end(nodes, curves, stops)[curves.labels]].sum() / lengths.sum()
    if free > schedule.open:
        return True, True, f"{free:.0%} of the sharp curves end in the middle of a smooth surface"
    edge = float(np.median(lengths[lengths > 0.0]))
    diagonal = float(np.linalg.norm(np.ptp(points[faces.nodes()], axis=0)))
    if tolerance > max(schedule.rounded[0] * edge, schedule.rounded[1] * diagonal):
        share = f"{tolerance / edge:.2g} edge lengths, {tolerance / diagonal:.2g} diagonals"
        return True, False, f"the surface may move by {share}, which rounds them off"
    return (
        False,
        free > 0,
        "sharp" + (", less short ones that end in the middle of a smooth surface" if free > 0 else ""),
    )
