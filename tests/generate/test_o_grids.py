"""Cylinders and balls."""

import numpy as np
import pytest

from hexconformal import OptionError, as_volume_mesh, generate
from hexconformal.mesh.topology import boundary_quads
from hexconformal.quality.assessment import quality


def test_cylinder_and_ball_are_round():
    points, cells = generate.cylinder(core=8, layers=4, axial=6, radius=2.0, length=3.0)
    quads, _ = boundary_quads(cells)
    outside = np.unique(quads)
    radius = np.hypot(points[outside, 0], points[outside, 1])
    on_top = np.isin(points[outside, 2], [0.0, 3.0])
    np.testing.assert_allclose(radius[~on_top], 2)
    n = 32  # nodes around the circle, whose polygon the cells fill, equally spaced
    assert quality((points, cells)).volume.sum() == pytest.approx(3 * 2**2 * n / 2 * np.sin(2 * np.pi / n))

    points, cells = generate.ball(core=10, layers=4, radius=2.0)
    quads, _ = boundary_quads(cells)
    np.testing.assert_allclose(np.linalg.norm(points[np.unique(quads)], axis=1), 2)
    assert quality((points, cells)).volume.sum() == pytest.approx(4 / 3 * np.pi * 8, rel=0.02)
    assert quality((points, cells)).scaled_jacobian.min() > 0.5


def test_grading_thins_the_outermost_layer():
    points, _ = generate.ball(4, 6, grading=0.05)
    ray = np.sort(np.linalg.norm(points[(np.abs(points[:, :2]) < 1e-12).all(axis=1) & (points[:, 2] >= 0)], axis=1))
    steps = np.diff(ray)[-6:]
    assert steps[-1] / steps[0] == pytest.approx(0.05)
    np.testing.assert_allclose(steps[1:] / steps[:-1], 0.05 ** (1 / 5))


# Core, layers, axial, and the rest of the parameters.
CURVED = [(1, 1, 1, {}), (2, 1, 3, {"core_size": 0.8}), (2, 3, 2, {"grading": 0.01}), (5, 2, 1, {"core_size": 0.1})]


@pytest.mark.parametrize("nodes", [20, 27])
@pytest.mark.parametrize(("core", "layers", "axial", "more"), CURVED, ids=str)
def test_a_curved_cylinder_is_bounded_by_arcs_of_parabolas(core, layers, axial, more, nodes):
    radius, length = 2.0, 3.0
    points, cells = mesh = generate.curved_cylinder(core, layers, axial, radius, length, nodes=nodes, **more)
    measured = quality(mesh)
    assert measured.valid.all()
    # Through three points of an arc of 2 u: x = r (1 - (1 - cos u) t^2), y = r t sin u.
    around = 4 * core
    u = np.pi / around
    area = around * radius**2 * np.sin(u) * (1.0 + (1.0 - np.cos(u)) / 3.0)
    assert measured.volume.sum() == pytest.approx(length * area, rel=1e-12)
    assert area / (np.pi * radius**2) == pytest.approx(1.0, abs=u**4 / 25)
    # All nodes of the outermost faces lie on the true surface.
    distance = np.hypot(points[:, 0], points[:, 1])
    outside = np.isclose(distance, radius, rtol=1e-14)
    assert outside.sum() == 2 * around * (2 * axial + 1) - (0 if nodes == 27 else around * axial)
    assert distance.max() <= radius * (1 + 1e-14)
    assert np.array_equal(np.unique(cells[f"hexahedron{nodes}"]), np.arange(len(points)))


@pytest.mark.parametrize("nodes", [20, 27])
def test_a_curved_ball_has_the_volume_of_the_ball_to_fourth_order(nodes):
    errors = []
    for n in (1, 2, 4):
        mesh = generate.curved_ball(n, n, 3.0, nodes=nodes)
        points, (cells,) = mesh[0], mesh[1].values()
        measured = quality(mesh)
        assert measured.valid.all()
        outside = np.isclose(np.linalg.norm(points, axis=1), 3.0, rtol=1e-14)
        assert outside.sum() == 24 * n**2 + 2 - (0 if nodes == 27 else 6 * n**2)
        assert cells.shape == (n**3 + 6 * n**3, nodes)
        errors.append(36.0 * np.pi - measured.volume.sum())
    assert errors[0] > errors[1] > errors[2] > 0
    assert errors[1] / errors[2] == pytest.approx(16.0, rel=0.15)
    assert errors[2] < 2e-3 * 36.0 * np.pi


def test_the_corners_of_curved_grids_are_those_of_straight_ones():
    for straight, curved in (
        (generate.cylinder(3, 2, 4, 2.0, 5.0, 0.4, 0.3), generate.curved_cylinder(3, 2, 4, 2.0, 5.0, 0.4, 0.3)),
        (generate.ball(3, 2, 2.0, 0.4, 0.3), generate.curved_ball(3, 2, 2.0, 0.4, 0.3)),
    ):
        np.testing.assert_array_equal(curved[0][: len(straight[0])], straight[0])
        np.testing.assert_array_equal(curved[1]["hexahedron27"][:, :8], straight[1])
        # Curves inside follow the surface: in the middle they are elsewhere than straight ones.
        mesh = as_volume_mesh(curved)
        middle = mesh.points[mesh.blocks[0].cells]
        bowed = np.linalg.norm(middle[:, 26] - middle[:, :8].mean(axis=1), axis=1)
        assert bowed.max() > 0.01


@pytest.mark.parametrize("make", [generate.cylinder, generate.ball, generate.curved_cylinder, generate.curved_ball])
def test_parameters_that_make_no_sense_are_refused(make):
    for wrong in ({"layers": 0}, {"grading": 0.0}, {"core_size": 1.0}, {"core": 0}, {"radius": 0.0}):
        with pytest.raises(OptionError):
            make(**wrong)
    if "curved" in make.__name__:
        with pytest.raises(OptionError, match="20 or 27, not 8"):
            make(nodes=8)
