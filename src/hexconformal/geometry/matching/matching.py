"""Matching the skin of a mesh with a surface and its features, and putting it there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..closest_point import CurveLocator, SurfaceLocator
from ..features import CORNER, CURVE, SMOOTH, Features
from .patches import Sheets, matched_sheets
from .paths import Path, Skin, find_paths
from .pieces import curve_pieces
from .schedule import MatchingSchedule

__all__ = ["Matching", "match_features"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Matching:
    """A skin matched with a surface.

    Attributes
    ----------
    points
        (n, 3) points of the mesh, with its skin where it belongs: nodes of curves on these, the others on their sheet.
    features
        Curves and corners of the skin that are matched, with the numbers of those of the surface; its patches.
    curves
        The curves of the surface.
    sheets
        (q,) sheet of each boundary quad.
    reference
        The surface, with its sheets.
    """

    points: Floats
    features: Features
    curves: CurveLocator
    sheets: Ints
    reference: SurfaceLocator


def match_features(
    skin: Skin,
    surface: SurfaceLocator,
    features: Features,
    flat: float,
    schedule: MatchingSchedule | None = None,
    tags: Ints | None = None,
) -> Matching | None:
    """Match the skin of a mesh with a surface and its features.

    Parameters
    ----------
    skin
        The skin.
    surface
        Triangles, the same side out as the skin.
    features
        Curves and corners of the surface.
    flat
        Distance from its plane up to which a sheet is flat.
    schedule
        The numbers of it.
    tags
        (f,) of the faces of the surface; curves between two are those of the skin between the same ones.

    Returns
    -------
    What is matched with what, and where it belongs; None where no curve was found again.

    Examples
    --------
    A box that is a little too small, on a larger one.

    >>> from hexconformal.generate import box
    >>> from hexconformal.geometry import find_features
    >>> from hexconformal.mesh import boundary_quads
    >>> points, cells = box((3, 3, 3))
    >>> quads = boundary_quads(cells)[0]
    >>> larger = SurfaceLocator(1.1 * points - 0.05, quads)
    >>> matching = match_features(Skin(points, quads, cells), larger, find_features(larger.points, quads), 1e-9)
    >>> len(matching.features.corners), matching.points.min().round(9), matching.points.max().round(9)
    (8, np.float64(-0.05), np.float64(1.05))
    """
    schedule = MatchingSchedule() if schedule is None else schedule
    pieces = curve_pieces(surface, features, schedule.direct, tags)
    paths = find_paths(skin, surface.points, pieces, schedule) if pieces else []
    if not paths:
        return None
    found = matched_sheets(SurfaceLocator(skin.points, skin.quads), surface, paths)
    paths, sheets = found.paths, found.ours
    if not paths:
        return None
    own = _own_features(skin, found, features)
    there = np.concatenate([_links(path.piece.nodes) for path in paths])
    reference = SurfaceLocator(surface.points, surface.faces, found.theirs)
    points = _on_sheets(skin, sheets, np.flatnonzero(found.alike), reference, flat)
    for path in paths:
        points[path.nodes] = _on_piece(skin.points[path.nodes], surface.points[path.piece.nodes], schedule.close)
    points = _unfolded(skin, points, paths, sheets, reference, flat, schedule)
    numbers = np.concatenate([np.full(len(path.piece.nodes) - 1, path.piece.curve) for path in paths])
    return Matching(points, own, CurveLocator(surface.points, there, numbers), sheets, reference)


def _links(nodes: Ints) -> Ints:
    return np.column_stack([nodes[:-1], nodes[1:]])


def _own_features(skin: Skin, found: Sheets, features: Features) -> Features:
    """The paths as features of the skin."""
    paths = found.paths
    edges = np.concatenate([_links(path.nodes) for path in paths])
    curves = np.concatenate([np.full(len(path.nodes) - 1, path.piece.curve) for path in paths])
    kind = np.full(len(skin.points), SMOOTH, dtype=np.int8)
    kind[edges] = CURVE
    ends = np.array([path.nodes[[0, -1]] for path in paths])
    there = np.array([path.piece.ends for path in paths])
    kind[ends[features.kind[there] == CORNER]] = CORNER
    return Features(kind, edges, curves, found.patches)


def _on_sheets(skin: Skin, sheets: Ints, which: Ints, reference: SurfaceLocator, flat: float) -> Floats:
    """The points, with the nodes of some sheets on these."""
    points = skin.points.copy()
    for sheet in which.tolist():
        nodes = np.unique(skin.quads[sheets == sheet])
        points[nodes] = _on_sheet(points[nodes], sheet, reference, flat)
    return points


def _on_sheet(x: Floats, sheet: int, reference: SurfaceLocator, flat: float) -> Floats:
    """The closest points of a sheet, or those straight down on its plane."""
    faces = np.flatnonzero(np.asarray(reference.sheets) == sheet)
    plane = _plane(reference.points[np.unique(reference.faces[faces])], flat)
    if plane is None:
        return reference.closest(x, np.full(len(x), faces[0])).positions
    place, normal = plane
    return x - np.outer((x - place) @ normal, normal)


def _unfolded(
    skin: Skin, points: Floats, paths: list[Path], sheets: Ints, reference: SurfaceLocator, flat: float,
    schedule: MatchingSchedule,
) -> Floats:  # fmt: skip
    """The points, with nodes of folded sheets at the mean of their neighbours, and curves spread, if that helps."""
    best, folded = points, _folded_corners(points, skin.quads, sheets, reference)
    if not folded.any():
        return points
    spread = points.copy()
    for path in paths:
        if np.isin(path.nodes, skin.quads[folded > 0]).any():
            spread[path.nodes] = _on_piece(points[path.nodes], reference.points[path.piece.nodes], np.inf)
    on_curves = np.concatenate([path.nodes for path in paths])
    for start in (points, spread):
        trial, after = start, _folded_corners(start, skin.quads, sheets, reference)
        for sheet in np.unique(sheets[after > 0]).tolist():
            which = np.flatnonzero(sheets == sheet)
            trial = _smoothed(skin, trial, which, sheet, on_curves, reference, flat, schedule.smoothing)
        after = _folded_corners(trial, skin.quads, sheets, reference)
        if after.sum() < folded.sum():
            best, folded = trial, after
    return best


def _smoothed(
    skin: Skin, points: Floats, which: Ints, sheet: int, held: Ints, reference: SurfaceLocator, flat: float, rounds: int
) -> Floats:
    """The least folded of the points that come of putting nodes around folded quads to the mean of their neighbours."""
    quads = skin.quads[which]
    edges = np.unique(np.sort(np.stack([quads, np.roll(quads, 1, axis=1)], axis=2).reshape(-1, 2), axis=1), axis=0)
    of_sheet, best, fewest = np.full(len(which), sheet), points, np.inf
    for _ in range(rounds):
        folded = _folded_corners(points, quads, of_sheet, reference)
        if folded.sum() < fewest:
            best, fewest = points, folded.sum()
        around = np.isin(quads, quads[folded > 0]).any(axis=1)
        nodes = np.setdiff1d(quads[around], held)
        if fewest == 0 or len(nodes) == 0:
            break
        sums, degree = np.zeros_like(points), np.bincount(edges.ravel(), minlength=len(points))
        np.add.at(sums, edges[:, 0], points[edges[:, 1]])
        np.add.at(sums, edges[:, 1], points[edges[:, 0]])
        points = points.copy()
        points[nodes] = _on_sheet(sums[nodes] / degree[nodes, None], sheet, reference, flat)
    return best


def _folded_corners(points: Floats, quads: Ints, sheets: Ints, reference: SurfaceLocator) -> Ints:
    """(q,) corners of each quad whose normal is opposite to that of its sheet of a surface."""
    of_sheet = np.unique(np.asarray(reference.sheets), return_index=True)[1]
    x = points[quads]
    there = reference.closest(x.mean(axis=1), of_sheet[sheets]).faces
    y = reference.points[reference.faces[there]]
    normals = np.cross(y[:, 1] - y[:, 0], y[:, 2] - y[:, 0])
    areas = np.cross(np.roll(x, -1, axis=1) - x, np.roll(x, 1, axis=1) - x)
    return np.asarray((np.einsum("qki,qi->qk", areas, normals) <= 0.0).sum(axis=1))


def _plane(x: Floats, flat: float) -> tuple[Floats, Floats] | None:
    """A place in the plane that points lie in, and its normal; None where they lie in none."""
    place = x.mean(axis=0)
    normal = np.linalg.eigh((x - place).T @ (x - place))[1][:, 0]
    # Exact zeros and ones on the axes.
    normal[np.abs(normal) < 1e-9] = 0.0
    normal /= np.linalg.norm(normal)
    return (place, normal) if np.abs((x - place) @ normal).max() <= flat else None


def _on_piece(x: Floats, chain: Floats, close: float) -> Floats:
    """Places on a chain of points for the nodes of a path: the closest ones, or evenly spread where these fold over."""
    count = len(chain) - 1
    links = np.column_stack([np.arange(count), np.arange(1, count + 1)])
    along = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(chain, axis=0), axis=1)))
    there = CurveLocator(chain, links, np.zeros(count, np.int64)).closest(x, np.zeros(len(x), np.int64))
    s = along[there.faces] + there.weights[:, 1] * np.diff(along)[there.faces]
    s[0], s[-1] = 0.0, along[-1]
    if np.diff(s).min() < close * along[-1] / (len(x) - 1):
        s = np.linspace(0.0, along[-1], len(x))
    at = np.clip(np.searchsorted(along, s, side="right") - 1, 0, count - 1)
    share = (s - along[at]) / np.maximum(np.diff(along)[at], 1e-300)
    out = chain[at] + share[:, None] * (chain[at + 1] - chain[at])
    out[0], out[-1] = chain[0], chain[-1]
    return out
