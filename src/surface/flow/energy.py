"""The energy of a flow, a sum of terms, with the exact gradient of what is computed.

    E(x) = sum w e(Y, c),    M(x) Y = -z(x)

By the adjoint W, M W = sum w (de/dY) phi, the gradient needs no derivative of Y:

    dE = sum w <de/dc - <W, Y> N, dc> - <W, dz>

For e = |Y|^p |c| this is the weak form of p-Willmore flow, with |Y|^p - p <Y, W'> (W' = W / p) in front of div phi;
the published form has (1 - p) |Y|^p there, which is the discrete gradient only for p = 2. Equation (23) and
equation (24) of docs/mathematics.md.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..mesh import Floats
from .discrete import DiscreteSurface
from .terms import Term

__all__ = ["curvature_at_points", "energy", "energy_gradient"]


def energy(surface: DiscreteSurface, terms: Sequence[Term]) -> float:
    """The energy of a surface, the sum of the terms."""
    y = curvature_at_points(surface, terms)
    return float(sum((surface.elements.weights * term.density(y, surface.area_vectors)).sum() for term in terms))


def energy_gradient(surface: DiscreteSurface, terms: Sequence[Term]) -> Floats:
    """(n, 3) gradient of the energy with respect to the nodes."""
    y, c, elements = curvature_at_points(surface, terms), surface.area_vectors, surface.elements
    by_area = sum(term.by_area(y, c) for term in terms)
    if not any(term.curved for term in terms):
        return surface.area_vector_gradient(np.einsum("fr,frx->fx", elements.weights, by_area))
    w = surface.solve_mass(elements.load_vector(np.asarray(sum(term.by_curvature(y, c) for term in terms))))
    coupled = (elements.interpolate(w) * y).sum(axis=2)
    by_area = by_area - coupled[:, :, None] * surface.normals[:, None]
    return surface.area_vector_gradient(np.einsum("fr,frx->fx", elements.weights, by_area)) - surface.area_hessian(w)


def curvature_at_points(surface: DiscreteSurface, terms: Sequence[Term]) -> Floats:
    """(f, r, 3) Y at the points, zeros where no term needs it."""
    if any(term.curved for term in terms):
        return surface.elements.interpolate(surface.curvature)
    return np.zeros((*surface.elements.weights.shape, 3))
