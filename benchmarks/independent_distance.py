"""The distance between two positions of bilinear quads, from many samples to many small triangles."""

from __future__ import annotations

import numpy as np

from hexconformal.geometry import SurfaceLocator


def fine_triangles(points: np.ndarray, quads: np.ndarray, parts: int) -> tuple[np.ndarray, np.ndarray]:
    """Places on bilinear quads, so many along a side and one more, and the triangles between them."""
    s = np.linspace(0.0, 1.0, parts + 1)
    u, v = (side.ravel() for side in np.meshgrid(s, s))
    weights = np.stack([(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v], axis=1)
    number = np.arange((parts + 1) ** 2).reshape(parts + 1, -1)
    a, b, c, d = (x.ravel() for x in (number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]))
    triangles = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    triangles = triangles + (len(weights) * np.arange(len(quads)))[:, None, None]
    return np.einsum("sj,qji->qsi", weights, points[quads]).reshape(-1, 3), triangles.reshape(-1, 3)


def finely_measured(points: np.ndarray, reference: np.ndarray, quads: np.ndarray, parts: int = 24) -> float:
    """Hausdorff distance, of quads cut into so many parts along a side.

    Only the closest points on triangles are the library's, not how quads are followed or where they are looked at.
    """
    center = reference[np.unique(quads)].mean(axis=0)
    one, other = (fine_triangles(x - center, quads, parts) for x in (points, reference))
    ways = (one, other), (other, one)
    return float(max(SurfaceLocator(*here).closest(there[0]).distances.max() for here, there in ways))
