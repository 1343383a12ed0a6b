"""The length of sharp edges: what a user sees go where edges are dulled."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..area_vectors import face_area_vectors
from ..edges import edge_table
from ..faces import Faces
from .dihedral_angles import dihedral_angles

__all__ = ["SHARP", "sharp_length"]

SHARP = 45.0  # degrees between normals from which on an edge counts as sharp


def sharp_length(points: NDArray[np.float64], faces: Faces | NDArray[np.int64], angle: float = SHARP) -> float:
    """Length of the edges of a surface at which its normals turn by more than an angle, in degrees.

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> from hexconformal.mesh import boundary_quads
    >>> points, cells = box((2, 2, 2), (1.0, 2.0, 3.0))
    >>> sharp_length(points, boundary_quads(cells)[0])  # four of each
    24.0
    """
    faces = Faces.of(faces)
    edges = edge_table(faces)
    area = face_area_vectors(points, faces)
    normals = area / np.maximum(np.linalg.norm(area, axis=1), 1e-300)[:, None]
    ends = points[edges.nodes[edges.manifold[dihedral_angles(normals, edges) > angle]]]
    return float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum())
