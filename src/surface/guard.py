"""What a step may not do: turn a cell over, leave the input surface, or cut off a part of it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hexconformal import closest

from .energy import Frames
from .geometry import Cells, Floats, Ints, area_vectors, nodal_vectors

_UPRIGHT = 0.5  # cosine to the normals of its nodes from which a corner lies well

__all__ = ["Shape", "turned_frames", "two_sided_distance"]


def turned_frames(
    frames: Frames, before: Floats, after: Floats, cells: Cells, cosine: float = 0.3
) -> NDArray[np.bool_]:
    """(f,) corners that turned over in one step, or vanished.

    A corner may turn a little against its old normal; or it may come nearer to the normals of its nodes, which a
    sliver that was folded has to.
    """
    a, b = (_normals(frames, points) for points in (before, after))
    around = nodal_vectors(before, cells)[frames.nodes].sum(axis=1)
    length = np.linalg.norm(b, axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        kept = (a * b).sum(axis=1) / (np.linalg.norm(a, axis=1) * length) > cosine
        righted = (around * b).sum(axis=1) / (np.linalg.norm(around, axis=1) * length) > _UPRIGHT
    return np.asarray(~(kept | righted))


def _normals(frames: Frames, points: Floats) -> Floats:
    f1, f2 = frames.derivatives(points)
    return np.cross(np.stack(f1, axis=1), np.stack(f2, axis=1))


class Shape:
    """The input surface, to measure others against.

    Parameters
    ----------
    points, cells
        The input.
    """

    def __init__(self, points: Floats, cells: Cells) -> None:
        self._cells = cells
        vertices, self._faces, self._owners = fanned(points, cells)
        self._surface = closest.Surface(vertices, self._faces)
        self._vectors = area_vectors(vertices, Cells(self._faces, _NO_QUADS))
        self._nodes = points[cells.nodes()]
        self._samples = samples(points, cells)

    def distances(self, points: Floats) -> tuple[Floats, Floats]:
        """From samples (vertices, edge midpoints, centres) of a surface to the input, and from the input's to it."""
        there = self._surface.closest(samples(points, self._cells)).distances
        back = self._moved(points).closest(self._samples).distances
        return there, back

    def hausdorff(self, points: Floats) -> float:
        """Symmetric Hausdorff distance of the samples."""
        there, back = self.distances(points)
        return float(max(there.max(initial=0.0), back.max(initial=0.0)))

    def offenders(self, points: Floats, bound: float) -> NDArray[np.bool_]:
        """(m,) cells that stray from the input, turn over against it, or miss a part of it by more than `bound`.

        Parameters
        ----------
        points
            (n, 3) the surface in question.
        bound
            Largest distance.
        """
        bad, distance = self._against(points)
        bad |= distance > bound
        # Parts of the input that no cell comes near blame the cell that comes nearest.
        back = self._moved(points).closest(self._nodes)
        bad[self._owners[back.faces[back.distances > bound]]] = True
        return bad

    def turned_over(self, points: Floats) -> NDArray[np.bool_]:
        """(m,) cells whose normal points against the input's below their centre."""
        return self._against(points)[0]

    def _against(self, points: Floats) -> tuple[NDArray[np.bool_], Floats]:
        centres = np.concatenate([points[table].mean(axis=1) for table in self._cells.groups()])
        found = self._surface.closest(centres)
        below = self._vectors[found.faces]
        return np.asarray((area_vectors(points, self._cells) * below).sum(axis=1) <= 0), found.distances

    def _moved(self, points: Floats) -> closest.Surface:
        return closest.Surface(fanned(points, self._cells)[0], self._faces)


def two_sided_distance(points: Floats, reference: Floats, cells: Cells) -> float:
    """Symmetric Hausdorff distance of two surfaces with the same cells, sampled at vertices, edges and centres."""
    return Shape(reference, cells).hausdorff(points)


def samples(points: Floats, cells: Cells) -> Floats:
    """Nodes, edge midpoints and cell centres of a surface."""
    edges = cells.edges()
    centres = [points[table].mean(axis=1) for table in cells.groups()]
    return np.concatenate([points[cells.nodes()], points[edges].mean(axis=1), *centres])


_NO_QUADS = np.empty((0, 4), dtype=np.int64)


def fanned(points: Floats, cells: Cells) -> tuple[Floats, Ints, Ints]:
    """The surface in triangles (four around the centre of a quadrilateral), and the cell each belongs to."""
    t, q = len(cells.triangles), len(cells.quads)
    centres = len(points) + np.arange(q)
    fans = [np.stack([cells.quads[:, i], cells.quads[:, (i + 1) % 4], centres], axis=1) for i in range(4)]
    return (
        np.concatenate([points, points[cells.quads].mean(axis=1)]),
        np.concatenate([cells.triangles, *fans]),
        np.concatenate([np.arange(t), *([t + np.arange(q)] * 4)]),
    )
