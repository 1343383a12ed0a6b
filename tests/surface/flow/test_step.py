"""One step of a flow: nodes that stay, and multipliers of constraints, also where these say the same."""

import numpy as np
import pytest
from meshes.surfaces import grid, icosphere

from surface.flow import MeanCurvature, Willmore, evolve
from surface.flow.discrete import DiscreteSurface, Elements
from surface.flow.step import Conserved, restore_conserved


def hill(height=0.3):
    """An open surface over the unit square, and which nodes lie inside."""
    points, cells, inner = grid(8, jitter=0.2)
    x, y = points[:, 0], points[:, 1]
    points[:, 2] = height * np.sin(np.pi * x) * np.sin(2 * y) * inner
    return points, cells, inner


@pytest.mark.parametrize("kind", [MeanCurvature, Willmore])
def test_the_boundary_of_an_open_surface_stays_while_the_energy_falls(kind):
    points, cells, inner = hill()
    moments = list(evolve(kind((points, cells.triangles)), steps=5, stall=0.0))
    assert np.array_equal(moments[-1].points[~inner], points[~inner])
    assert np.abs(moments[-1].points - points)[inner].max() > 1e-3
    assert (np.diff([moment.record.energy for moment in moments]) < 0).all()


def test_what_restores_the_area_moves_no_node_that_stays():
    points, cells, inner = hill()
    elements = Elements(cells, len(points))
    conserved = Conserved(("area",), DiscreteSurface(elements, points))
    spoiled = DiscreteSurface(elements, hill(height=0.35)[0])
    assert conserved.error(spoiled) > 1e-2
    state = restore_conserved(spoiled, conserved, ~inner)
    assert conserved.error(state) < 1e-12
    assert np.array_equal(state.points[~inner], points[~inner])


def test_an_area_that_no_surface_with_this_boundary_has_is_not_reached():
    points, cells, inner = hill()
    state = DiscreteSurface(Elements(cells, len(points)), points)
    conserved = Conserved(("area",), state)
    conserved.values = np.array([0.8])  # the flat square has 1
    assert restore_conserved(state, conserved, ~inner) is None


def test_on_a_sphere_where_area_and_volume_say_the_same_both_are_kept():
    points, cells = icosphere(2)
    moments = list(evolve(Willmore((points, cells.triangles), ("area", "volume")), steps=5, stall=0.0))
    assert max(moment.record.conserved_error for moment in moments) < 1e-10
    assert np.abs(np.linalg.norm(moments[-1].points, axis=1) - 1).max() < 0.02
