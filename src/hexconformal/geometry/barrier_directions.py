"""The directions in which a distance grows, as projections (k, 3, 3): where a barrier on it bends."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .bilinear_surface import BilinearSurface
from .closest_point import SurfaceLocator

__all__ = ["distance_projectors", "identities", "normal_projectors"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]


def distance_projectors(
    residuals: Field, distances: Field, bound: float, surface: SurfaceLocator | BilinearSurface, faces: Ints
) -> Field:
    """n n^T of the direction in which the distance grows; the normal of the face where there is no distance."""
    x = surface.points[surface.faces[faces]]
    normals = np.cross(x[:, 2] - x[:, 0], x[:, -1] - x[:, 1])
    far = distances > 1e-9 * bound
    normals[far] = residuals[far]
    normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-300)[:, None]
    return np.einsum("ki,kj->kij", normals, normals)


def normal_projectors(ends: Field, weights: Field) -> Field:
    """1 - t t^T of straight edges (k, 2, 3); 1 where the closest point is one of the ends."""
    tangent = ends[:, 1] - ends[:, 0]
    tangent /= np.maximum(np.linalg.norm(tangent, axis=1), 1e-300)[:, None]
    inside = (weights.min(axis=1) > 0.0)[:, None, None]
    return np.asarray(np.eye(3) - inside * np.einsum("ki,kj->kij", tangent, tangent))


def identities(count: int) -> Field:
    return np.broadcast_to(np.eye(3), (count, 3, 3))
