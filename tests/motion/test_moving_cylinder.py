"""The example of a flow on a moving mesh: its mesh, geometric conservation, its forces and its spring."""

import importlib.util
import sys

import numpy as np
import pytest
from paths import ROOT

from hexconformal.elements import is_valid

EXAMPLE = ROOT / "examples" / "moving_cylinder.py"
SMALL = {"around": 4, "layers": 8, "first": 0.04}


@pytest.fixture(scope="module")
def example():
    specification = importlib.util.spec_from_file_location("moving_cylinder", EXAMPLE)
    module = importlib.util.module_from_spec(specification)
    sys.modules["moving_cylinder"] = module
    specification.loader.exec_module(module)
    yield module
    del sys.modules["moving_cylinder"]


def test_the_grid_around_the_cylinder_is_valid_and_layered(example):
    points, cells = example.o_grid(**SMALL)
    assert is_valid(points, cells).all()
    assert len(np.unique(cells)) == len(points)
    radii = np.hypot(points[:, 0], points[:, 1])
    assert radii.min() == pytest.approx(example.RADIUS)
    assert np.sort(np.unique(radii.round(9)))[1] < example.RADIUS + 0.5


@pytest.mark.long
def test_a_uniform_velocity_stays_uniform_on_a_moving_mesh(example):
    pytest.importorskip("skfem")
    assert example.uniform_deviation(steps=100, **SMALL) <= 1e-12


def test_a_cylinder_at_rest_is_dragged_along_the_stream(example):
    pytest.importorskip("skfem")
    tunnel = example.Tunnel(**SMALL)
    for _ in range(20):
        force, _ = tunnel.step(np.zeros(2), 0.5, np.zeros(2))
    # Coefficient 1.35 at Re = 100 without walls; they and the coarse grid raise it.
    assert 1.0 < 2 * force[0] < 2.5
    assert abs(force[1]) < 0.05


def test_a_spring_without_a_flow_oscillates_with_its_period(example):
    spring = example.Spring(period=5.0, place=0.4)
    dt = 0.01
    for _ in range(500):
        spring.y, spring.v = spring.predicted(0.0, dt)
    assert spring.y == pytest.approx(0.4, abs=1e-5)
    assert spring.v == pytest.approx(0.0, abs=2e-4)
