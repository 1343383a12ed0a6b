"""Surfaces are left alone unless enough is gained, and compared by what is asked for."""

from dataclasses import replace

import numpy as np
import pytest
from meshes.surfaces import grid, no_cells, scattered_sphere

import surface
from hexconformal.geometry import Faces
from surface.remeshing.acceptance import Acceptance
from surface.remeshing.options import Options, Record

INPUT = Record(0, 1.0, 0.0, 0.0, 20.0, 50.0, 0, 0, 0.0)
TRIANGLES = Faces(np.array([[0, 1, 2]]), no_cells(4))
QUADS = Faces(no_cells(3), np.array([[0, 1, 2, 3]]))


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({"energy": 0.89, "min_angle": 22.1}, True),
        ({"energy": 0.91, "min_angle": 22.1}, False),
        ({"energy": 0.89, "min_angle": 21.9}, False),
        ({"energy": 0.89, "mean_angle": 51.1}, True),
        ({"energy": 0.89, "mean_angle": 50.9}, False),
    ],
)
def test_nodes_are_moved_for_a_tenth(change, expected):
    assert Acceptance(Options(), TRIANGLES, INPUT).is_worthwhile(replace(INPUT, **change)) is expected


def test_right_angles_are_what_quadrilaterals_miss():
    best = replace(INPUT, energy=0.5, mean_angle=53.9)
    assert not Acceptance(Options(), QUADS, INPUT).is_worthwhile(best)
    assert Acceptance(Options(), QUADS, INPUT).is_worthwhile(replace(best, mean_angle=54.1))


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({"min_angle": 25.9, "mean_angle": 51.4}, False),
        ({"min_angle": 26.1}, True),
        ({"mean_angle": 51.6}, True),
    ],
)
def test_more_must_be_gained_to_take_the_surface_far_from_its_place(change, expected):
    best = replace(INPUT, energy=0.5, **change)
    assert Acceptance(Options(), TRIANGLES, INPUT, largest_distance=0.0051).is_worthwhile(best) is expected
    assert Acceptance(Options(), TRIANGLES, INPUT, largest_distance=0.0049).is_worthwhile(best)
    assert Acceptance(Options(hausdorff=0.02), TRIANGLES, INPUT, largest_distance=0.0099).is_worthwhile(best)


def test_far_from_the_input_no_less_is_enough_where_angles_are_good():
    first = replace(INPUT, min_angle=45.0)
    best = replace(first, energy=0.5, min_angle=48.0, mean_angle=50.5)
    assert not Acceptance(Options(), TRIANGLES, first, largest_distance=0.009).is_worthwhile(best)


def test_less_is_enough_for_the_worst_or_to_turn_cells_back():
    best = replace(INPUT, energy=0.99, min_angle=20.5)
    assert not Acceptance(Options(), TRIANGLES, INPUT).is_worthwhile(best)
    assert Acceptance(Options(emphasis="worst"), TRIANGLES, INPUT).is_worthwhile(best)
    assert Acceptance(Options(), TRIANGLES, replace(INPUT, turned=1)).is_worthwhile(best)


def test_no_angle_may_get_worse_and_no_cell_turn_over():
    acceptance = Acceptance(Options(), TRIANGLES, INPUT)
    assert acceptance.no_worse(INPUT)
    for change in ({"min_angle": 19.9}, {"mean_angle": 49.9}, {"turned": 1}):
        assert not acceptance.no_worse(replace(INPUT, energy=0.1, **change))


def test_results_are_ranked_by_whether_they_are_worth_it_then_by_what_is_emphasized():
    little, mean, least = (
        replace(INPUT, energy=0.5, mean_angle=m, min_angle=a) for m, a in ((50.5, 20.0), (55.0, 21.0), (54.0, 30.0))
    )
    usual, worst = (Acceptance(Options(emphasis=e), TRIANGLES, INPUT) for e in ("mean", "worst"))
    assert usual.is_better(mean, least)
    assert worst.is_better(least, mean)
    # A gain of the mean that is not worthwhile.
    assert usual.is_better(replace(little, min_angle=30.0), replace(little, mean_angle=50.9))
    folded = Acceptance(Options(), TRIANGLES, replace(INPUT, turned=2))
    assert folded.is_better(replace(least, turned=0), replace(mean, turned=1))


def test_cells_that_shall_not_be_regular_are_compared_by_their_energy():
    # Equal cells of a square are to become graded ones: their angles get worse, as was asked for.
    points, cells, _ = grid(12)
    graded = points.copy()
    graded[:, 0] = 0.5 * (points[:, 0] + points[:, 0] ** 2)
    result = surface.remesh((points, cells.triangles), target=graded)
    assert np.abs(result.points - graded).max() < 2e-3
    assert result.report.after.mean_angle < result.report.before.mean_angle - 1.0
    assert result.report.energy_after < 1e-3 * result.report.energy_before


@pytest.mark.parametrize("energy", ["barrier", "quaternionic"])
def test_cells_that_have_the_shape_they_shall_have_stay_to_the_last_bit(energy):
    points, cells, _ = grid(6, 0.3)
    for unit in (1.0, 1e6):
        start = unit * points
        result = surface.remesh((start, cells.triangles), target="input", energy=energy, max_iterations=3)
        assert np.array_equal(result.points, start)


@pytest.mark.long
def test_a_result_is_left_alone():
    # Bounds on area and distance count from the surface that comes in: there always is a little to gain again.
    points, triangles = scattered_sphere(700, seed=3)
    a, b, c = points.T
    lumps = 1 + 0.075 * np.sin(3 * a + 1) * np.cos(3 * b) + 0.06 * np.sin(4 * c + a)
    first = surface.remesh((points * lumps[:, None] * [1.0, 1.2, 1.6], triangles))
    assert first.report.after.mean_angle > first.report.before.mean_angle + 5
    again = surface.remesh((first.points, triangles))
    assert np.array_equal(again.points, first.points)
    assert "the input is about as good already" in again.report.reason


def test_a_run_at_its_limit_of_iterations_moves_nodes_for_a_tenth_only():
    points, cells, _ = grid(12, 0.15)
    whole = surface.remesh((points, cells.triangles))
    near = surface.remesh((whole.points + 0.03 * (points - whole.points), cells.triangles), max_iterations=1)
    assert near.report.iterations == 1
    assert near.report.largest_displacement == 0
    assert "too little was gained" in near.report.reason
