"""Faces of a surface: triangles, quadrilaterals, or both."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["Faces", "corner_triangles", "fan_triangles"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Faces:
    """The faces of a surface, counter-clockwise seen from outside; they are numbered with the triangles first.

    Attributes
    ----------
    triangles
        (t, 3) node ids.
    quads
        (q, 4) node ids.

    Examples
    --------
    >>> faces = Faces(np.array([[0, 1, 2]]), np.array([[1, 3, 4, 2]]))
    >>> len(faces), faces.nodes().tolist(), faces.table.tolist()
    (2, [0, 1, 2, 3, 4], [[0, 1, 2, 2], [1, 3, 4, 2]])
    """

    triangles: Ints
    quads: Ints

    @classmethod
    def of(cls, faces: Faces | Ints) -> Faces:
        """Faces as they are, or of a table (f, 3) or (f, 4): triangles come first, with their last node twice."""
        if isinstance(faces, Faces):
            return faces
        if faces.shape[1] == 4 and (triangles := faces[:, 2] == faces[:, 3]).any():
            count = int(triangles.sum())
            if not triangles[:count].all():
                raise ValueError("triangles must come before quadrilaterals")
            return cls(np.ascontiguousarray(faces[:count, :3]), faces[count:])
        none = np.empty((0, 7 - faces.shape[1]), dtype=np.int64)
        return cls(faces, none) if faces.shape[1] == 3 else cls(none, faces)

    def __len__(self) -> int:
        return len(self.triangles) + len(self.quads)

    @property
    def tables(self) -> tuple[Ints, ...]:
        """The tables of node ids that are not empty."""
        return tuple(table for table in (self.triangles, self.quads) if len(table))

    @property
    def table(self) -> Ints:
        """(f, 3) nodes where all faces are triangles, else (f, 4): triangles have their last node twice."""
        return self.triangles if len(self.quads) == 0 else np.concatenate([self.triangles[:, [0, 1, 2, 2]], self.quads])

    @property
    def sizes(self) -> Ints:
        """(f,) number of corners of each face."""
        return np.repeat([3, 4], [len(self.triangles), len(self.quads)])

    @property
    def corners(self) -> Ints:
        """(c,) node at each corner, face by face."""
        return np.concatenate([self.triangles.ravel(), self.quads.ravel()])

    @property
    def owners(self) -> Ints:
        """(c,) face of each corner."""
        return np.repeat(np.arange(len(self)), self.sizes)

    def around(self, shift: int) -> Ints:
        """(c,) the corner that comes so many corners behind each in its face."""
        t, q = self.triangles.size, self.quads.size
        triangles = np.roll(np.arange(t).reshape(-1, 3), -shift, axis=1)
        return np.concatenate([triangles.ravel(), t + np.roll(np.arange(q).reshape(-1, 4), -shift, axis=1).ravel()])

    def over_corners(self, how: np.ufunc, values: NDArray[Any]) -> NDArray[Any]:
        """(f,) values (c,) at the corners of each face, reduced by a ufunc."""
        sizes = self.sizes
        return np.asarray(how.reduceat(values, np.cumsum(sizes) - sizes))

    def centres(self, points: Floats) -> Floats:
        """(f, 3) mean of the nodes of each face."""
        return np.concatenate([points[self.triangles].mean(axis=1), points[self.quads].mean(axis=1)])

    def where(self, holds: Callable[[Ints], ArrayLike]) -> Mask:
        """(f,) the faces whose rows of node ids have a property, which is told of each table."""
        return np.concatenate([np.asarray(holds(table)) for table in (self.triangles, self.quads)])

    def any_of(self, nodes: Mask) -> Mask:
        """(f,) faces with one of some nodes (n,)."""
        return self.where(lambda table: nodes[table].any(axis=1))

    def nodes(self) -> Ints:
        """Ids of the nodes that belong to a face, ascending."""
        return np.unique(self.corners)

    def corners_of(self, faces: Mask) -> Ints:
        """Node ids at the corners of some faces, (f,) booleans, one by one."""
        t = len(self.triangles)
        return np.concatenate([self.triangles[faces[:t]].ravel(), self.quads[faces[t:]].ravel()])


def corner_triangles(quads: Ints) -> Ints:
    """(4 q, 3) the corners of quadrilaterals as triangles (corner, next, previous), face by face."""
    return np.stack([quads, np.roll(quads, -1, axis=1), np.roll(quads, 1, axis=1)], axis=2).reshape(-1, 3)


def fan_triangles(points: Floats, faces: Faces) -> tuple[Floats, Ints, Ints]:
    """The surface in triangles (four around the centre of a quadrilateral), and the face each belongs to."""
    t, q = len(faces.triangles), len(faces.quads)
    centres = len(points) + np.arange(q)
    fans = [np.stack([faces.quads[:, i], faces.quads[:, (i + 1) % 4], centres], axis=1) for i in range(4)]
    return (
        np.concatenate([points, points[faces.quads].mean(axis=1)]),
        np.concatenate([faces.triangles, *fans]),
        np.concatenate([np.arange(t), *([t + np.arange(q)] * 4)]),
    )
