"""Compiled loop that adds forces and curvatures at samples of a surface to its nodes."""

from __future__ import annotations

from ..kernel import loop
from ..mesh import binary_search

__all__ = ["add_samples"]


@loop
def add_samples(nodes, weights, force, curvature, indptr, indices, data, gradient):  # type: ignore[no-untyped-def]
    """Add the forces and curvatures of samples to their nodes; nodes below zero take no part."""
    for k in range(len(nodes)):
        for i in range(nodes.shape[1]):
            a, w = nodes[k, i], weights[k, i]
            if a < 0 or w == 0.0:
                continue
            for r in range(3):
                gradient[a, r] += w * force[k, r]
            for j in range(nodes.shape[1]):
                b, share = nodes[k, j], w * weights[k, j]
                # The matrix holds its lower triangle, without the rows and columns of held nodes.
                if b < 0 or b > a or share == 0.0:
                    continue
                place = binary_search(indices, indptr[a], indptr[a + 1], b)
                if place >= indptr[a + 1] or indices[place] != b:
                    continue
                for r in range(3):
                    for c in range(3):
                        data[place, r, c] += share * curvature[k, r, c]
