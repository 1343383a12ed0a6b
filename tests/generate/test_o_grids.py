"""Cylinders and balls."""

import numpy as np
import pytest

from hexconformal import generate
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
