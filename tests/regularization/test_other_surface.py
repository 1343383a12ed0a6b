"""Meshes whose boundary is to lie on a surface given beside them."""

import numpy as np
import pytest
import pyvista as pv

import hexconformal as hc
from hexconformal import generate


def sphere(radius=1.0, center=(0.0, 0.0, 0.0)):
    return pv.Sphere(radius=radius, center=center, theta_resolution=60, phi_resolution=60)


def test_cells_too_coarse_to_follow_a_surface_are_told_with_the_distance_they_reach():
    # Eight cells around the equator: chords of 45 degrees stay 1 - cos(22.5 degrees) inside the sphere at best.
    mesh = generate.ball(2, 1)
    close = hc.regularize(mesh, surface=sphere(), hausdorff=0.005).report
    away = hc.regularize(mesh, surface=sphere(), max_iterations=0).report
    told = [note for note in close.notes if "not followed" in note]
    assert len(told) == 1
    assert f"within the bound of 0.005 diagonals, the largest distance is {close.hausdorff:.4g}" in told[0]
    assert 0.005 < close.hausdorff < away.hausdorff
    enough = hc.regularize(mesh, surface=sphere(), hausdorff=0.1).report
    assert enough.hausdorff <= 0.1
    assert not any("not followed" in note for note in enough.notes)


def test_the_distance_from_a_surface_is_measured_where_nothing_moved_too():
    points, cells = generate.ball(4, 2)
    report = hc.regularize((points, cells), surface=sphere(1.02), max_iterations=0).report
    assert report.largest_displacement == 0.0
    assert report.hausdorff * report.diagonal > 0.02 * 0.99


def test_to_come_to_another_surface_may_cost_quality_but_no_cell():
    points, cells = generate.box((6, 6, 6), (2.0, 2.0, 2.0))
    result = hc.regularize((points - 1.0, cells), surface=sphere(1.25), hausdorff=0.15)
    assert result.report.after.scaled_jacobian.min < 1.0
    assert result.report.after.invalid == 0
    assert result.report.hausdorff < 0.15
    assert np.linalg.norm(result.points, axis=1).max() < 3**0.5 - 0.1


@pytest.mark.parametrize(
    ("surface", "words"),
    [
        (sphere(1000.0), r"diagonal 3463, the mesh from .* a ratio of 1\.07e\+03; is it another unit of length"),
        (sphere(2.0), r"a ratio of 2\.14;"),
        (sphere(0.001), r"a ratio of 0\.00107;"),
        (sphere(center=(3.0, 0.0, 0.0)), r"it reaches from \(2, -0.9996, -1\) to \(4, 0.9996, 1\)"),
    ],
)
def test_a_surface_that_is_not_that_of_the_mesh_is_refused_with_figures(surface, words):
    with pytest.raises(hc.MeshError, match=words):
        hc.regularize(generate.ball(3, 2), surface=surface)
