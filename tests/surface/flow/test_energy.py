"""Energies of discrete surfaces: exact gradients, and their values on spheres and tori."""

import numpy as np
import pytest
from meshes.surfaces import SHAKEN_SPHERES, icosphere, quad_torus

from surface.flow import Bending, Membrane, Tension
from surface.flow.discrete import DiscreteSurface, Elements
from surface.flow.energy import energy, energy_gradient

TERMS = {
    "area": [Tension(0.7)],
    "p1": [Bending(1)],
    "p2": [Bending(2)],
    "p3": [Bending(3)],
    "p4": [Bending(4)],
    "helfrich": [Membrane(2.0, 0.7, 0.3)],
    "sum": [Membrane(1.0, -0.5), Bending(3), Tension(2.0)],
}


@pytest.mark.parametrize("terms", TERMS.values(), ids=TERMS)
@pytest.mark.parametrize("surface", SHAKEN_SPHERES.values(), ids=SHAKEN_SPHERES)
def test_the_gradient_is_that_of_the_discrete_energy(surface, terms):
    points, cells = surface()
    elements = Elements(cells, len(points))
    ways = np.random.default_rng(1).standard_normal((8, *points.shape))
    gradient = energy_gradient(DiscreteSurface(elements, points), terms)
    slopes = (gradient * ways).sum(axis=(1, 2))

    def difference(h):
        values = [[energy(DiscreteSurface(elements, points + s * h * way), terms) for s in (1, -1)] for way in ways]
        return np.linalg.norm(np.diff(values, axis=1).ravel() / (-2 * h) - slopes) / np.linalg.norm(slopes)

    errors = [difference(h) for h in (1e-3, 1e-4)]
    assert errors[1] < 1e-3
    assert np.log10(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.15)


@pytest.mark.parametrize("p", [1, 2, 3, 4])
@pytest.mark.parametrize("surface", SHAKEN_SPHERES.values(), ids=SHAKEN_SPHERES)
def test_the_discrete_energy_is_homogeneous(surface, p):
    points, cells = surface()
    state = DiscreteSurface(Elements(cells, len(points)), points)
    value, terms = energy(state, [Bending(p)]), [Bending(p)]
    assert (energy_gradient(state, terms) * points).sum() == pytest.approx((2 - p) * value, abs=1e-12 * value)


def test_willmore_energy_of_icospheres_is_as_published():
    excess = []
    for level in (2, 3, 4):
        points, cells = icosphere(level)
        excess.append(energy(DiscreteSurface(Elements(cells, len(points)), points), [Bending(2)]) - 16 * np.pi)
    assert excess == pytest.approx([0.2976, 0.07366, 0.01824], rel=1e-3)


@pytest.mark.parametrize(("major", "exact"), [(2**0.5, 8 * np.pi**2), (3.0, 4 * np.pi**2 * 9 / 8**0.5)])
def test_willmore_energy_of_tori_converges_with_order_two(major, exact):
    errors = []
    for n in (16, 32):
        points, cells = quad_torus(major, 1.0, 3 * n, n)
        errors.append(energy(DiscreteSurface(Elements(cells, len(points)), points), [Bending(2)]) - exact)
    assert abs(errors[1]) < 0.01 * exact
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.2)
