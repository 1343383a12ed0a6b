"""Compiled loops over samples of a surface: where they are, which way distances grow, what they add to nodes."""

from __future__ import annotations

import numpy as np

from ..kernel import loop, strict_loop
from ..mesh import binary_search

__all__ = ["add_samples", "outward_projections", "sample_places"]


@strict_loop
def sample_places(first, last, nodes, weights, points, out):  # type: ignore[no-untyped-def]
    """Places (k, 3) of samples, from their nodes and the weights of these: to the last digit what numpy makes of it."""
    for k in range(first, last):
        for r in range(3):
            out[k, r] = 0.0
            for i in range(nodes.shape[1]):
                out[k, r] += weights[k, i] * points[nodes[k, i], r]


@loop
def outward_projections(first, last, residuals, distances, least, points, table, faces, out):  # type: ignore[no-untyped-def]
    """n n^T (k, 3, 3), n along the residual; the normal of the closest face where the distance is not above least."""
    n = np.empty(3)
    for k in range(first, last):
        if distances[k] > least:
            for r in range(3):
                n[r] = residuals[k, r]
        else:
            f, end = faces[k], table.shape[1] - 1
            a, b, c, d = table[f, 0], table[f, 1], table[f, 2], table[f, end]
            for r in range(3):
                s, t = (r + 1) % 3, (r + 2) % 3
                n[r] = (points[c, s] - points[a, s]) * (points[d, t] - points[b, t]) - (points[c, t] - points[a, t]) * (
                    points[d, s] - points[b, s]
                )
        length = max(np.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]), 1e-300)
        for r in range(3):
            n[r] /= length
        for r in range(3):
            for s in range(3):
                out[k, r, s] = n[r] * n[s]


@loop
def add_samples(  # type: ignore[no-untyped-def]
    first, last, nodes, weights, slopes, residuals, curvatures, directions, indptr, indices, data, gradient
):
    """Add slopes times residuals to the gradient, and curvatures times directions (if there are any) to the blocks.

    Those of nodes from first on and before last. Every range of nodes goes through all samples in their order, so that
    what it adds up does not depend on the others. Nodes beyond those of the gradient take no part.
    """
    for k in range(len(nodes)):
        for i in range(nodes.shape[1]):
            a, w = nodes[k, i], weights[k, i]
            if a < first or a >= last or w == 0.0:
                continue
            for r in range(3):
                gradient[a, r] += w * slopes[k] * residuals[k, r]
            for j in range(nodes.shape[1] if len(directions) > 0 else 0):
                b, share = nodes[k, j], w * weights[k, j] * curvatures[k]
                # The matrix holds its lower triangle, without the rows and columns of held nodes.
                if b > a or share == 0.0:
                    continue
                place = binary_search(indices, indptr[a], indptr[a + 1], b)
                if place >= indptr[a + 1] or indices[place] != b:
                    continue
                for r in range(3):
                    for c in range(3):
                        data[place, r, c] += share * directions[k, r, c]
