"""The course of a flow: output times, what is conserved, singularities, what moments carry."""

import numpy as np
import pytest
from meshes.surfaces import as_arrays, icosphere

from surface.flow import Evolution, MeanCurvature, Stepping, Willmore, evolve


@pytest.mark.parametrize("conserve", [("area",), ("volume",), ("area", "volume")])
@pytest.mark.parametrize("kind", ["mean curvature", "willmore"])
def test_what_is_conserved_stays_while_the_energy_falls(kind, conserve):
    if kind == "mean curvature" and "area" in conserve:
        pytest.skip("its energy is the area")
    points, cells = icosphere(2)
    start = (points * [1.0, 1.3, 1.8], cells.triangles)
    flow = Willmore(start, conserve) if kind == "willmore" else MeanCurvature(start, conserve)
    records = [moment.record for moment in evolve(flow, steps=25, stall=0.0)]
    assert max(record.conserved_error for record in records) < 1e-12
    assert (np.diff([record.energy for record in records]) < 0).all()
    for name in conserve:
        values = [getattr(record, name) for record in records]
        assert values == pytest.approx([values[0]] * len(values), rel=1e-10)


def test_output_times_are_hit_whatever_the_steps_are():
    flow = MeanCurvature(as_arrays(icosphere(1)))
    times = [m.record.time for m in evolve(flow, t_end=0.1, tau=0.003, outputs=(0.01, 0.02, 0.0333))]
    assert {0.01, 0.02, 0.0333} <= set(times)
    assert times[-1] == 0.1
    assert (np.diff(times) > 0).all()


def test_a_sphere_that_vanishes_ends_the_run_with_its_place():
    points, cells = icosphere(2)
    run = Evolution(MeanCurvature((points + [5, 0, 0], cells.triangles)), Stepping(steps=2000, tau_max=2e-3))
    moments = list(run)
    assert run.reason.startswith("the surface vanishes, at (5")
    assert moments[-1].record.time == pytest.approx(0.25, abs=0.01)
    assert np.isfinite(moments[-1].points).all()


@pytest.mark.long
@pytest.mark.parametrize("stall", [0.0, 1e-5])
@pytest.mark.parametrize("remesh", [0, 1, 2])
def test_a_neck_that_pinches_ends_the_run_with_the_last_good_surface(stall, remesh):
    points, cells = icosphere(3)
    x = 4 * points[:, 0]
    shrink = np.where(np.abs(x) < 2.5, 0.12 + 0.88 * np.minimum(np.abs(x) / 2.5, 1) ** 2, 1.0)
    dumbbell = np.stack([x, *(points[:, 1:] * shrink[:, None]).T], axis=1)
    run = Evolution(MeanCurvature((dumbbell, cells.triangles)), Stepping(steps=400, stall=stall, remesh=remesh))
    last = list(run)[-1]
    assert "singularity" in run.reason
    assert (np.diff([record.time for record in run.history]) > 0).all()
    node = int(run.reason.split("node ")[1].split(",")[0])
    assert abs(last.points[node, 0]) < 0.5
    assert last.record.area > 0.5


def test_moments_carry_curvature_in_the_type_that_came_in():
    import pyvista as pv

    sphere = pv.Icosphere(radius=2.0, nsub=3)
    sphere.point_data["mine"] = np.arange(sphere.n_points)
    moment = next(iter(evolve(MeanCurvature(sphere), steps=1)))
    out = moment.mesh
    assert isinstance(out, pv.PolyData)
    assert out.point_data["mean_curvature"] == pytest.approx(0.5, rel=1e-3)
    assert out.point_data["curvature"] == pytest.approx(1.0, rel=1e-3)
    assert (out.point_data["mine"] == np.arange(sphere.n_points)).all()
