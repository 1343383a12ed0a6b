"""Remeshing during a flow: angles stay good, and the energy falls nevertheless."""

from dataclasses import replace

import numpy as np
import pytest
from meshes.surfaces import as_arrays, icosphere, quad_cube, scattered_sphere, shaken

from surface.flow import Evolution, MeanCurvature, Stepping, Willmore, evolve


@pytest.mark.long
def test_remeshing_keeps_angles_and_the_flow_falls():
    points, cells = quad_cube(6)
    flow = Willmore((points, cells.quads), ("area", "volume"))
    plain, remeshed = (
        [moment.record for moment in evolve(flow, steps=40, stall=0.0, remesh=remesh)] for remesh in (False, True)
    )
    assert remeshed[-1].mean_angle > plain[-1].mean_angle + 0.5
    assert max(record.conserved_error for record in remeshed) < 1e-12
    assert remeshed[-1].energy < 0.7 * remeshed[0].energy
    assert np.isfinite([record.remesh_jump for record in remeshed]).any()


def test_remeshing_gives_back_less_than_the_flow_took_since_it_last_did():
    points, cells = icosphere(2)
    flow = Willmore((points * [1.0, 1.0, 1.6], cells.triangles), ("area", "volume"))
    records = [moment.record for moment in evolve(flow, steps=40, stall=0.0, remesh=True)]
    earned, jumps = 0.0, []
    for before, record in zip(records[:-1], records[1:], strict=True):
        jump = np.nan_to_num(record.remesh_jump)
        jumps.append(record.remesh_jump)
        most = 0.05 * before.energy if before.step == 0 else max(0.95 * earned, 0.0)
        assert jump <= most + 1e-12
        if np.isfinite(record.remesh_jump):
            earned = min(earned - jump, 0.0)
        fall = before.energy + jump - record.energy
        assert fall >= -1e-12 * record.energy
        earned += fall
    assert max(jumps[1:]) > 0


def test_a_poor_mesh_is_good_after_ten_steps_and_the_energy_falls_nevertheless():
    points, triangles = scattered_sphere(400)
    bumps = 1 + 0.25 * np.sin(3 * points[:, :1] + 1) * np.cos(3 * points[:, 1:2])
    start = (points * bumps * [1.0, 1.2, 1.6], triangles)
    records = [m.record for m in evolve(Willmore(start), steps=30, remesh=True)]
    jumps = np.array([record.remesh_jump for record in records[1:11]])
    assert jumps.max() > 0
    assert jumps.sum() < 0.05 * records[0].energy
    assert records[0].min_angle < 2.0
    assert records[1].min_angle > records[0].min_angle + 1.0
    assert min(record.min_angle for record in records[10:]) > 25.0
    assert (np.diff([record.energy for record in records[1:]]) < 0).all()
    assert records[3].energy < records[0].energy


def test_area_and_volume_come_back_smoothly_after_remeshing():
    points, cells = shaken(icosphere(3), 0.03)
    start = (points * [1.0, 1.2, 1.6], cells.triangles)
    records = [m.record for m in evolve(Willmore(start, ("area", "volume")), steps=1, remesh=True)]
    assert records[1].remesh_jump < -0.1 * records[0].energy
    assert records[1].conserved_error < 1e-12


def spoiled(points, early):
    """In place of remeshing, after the beginning: every node aside along the surface, always the same way."""
    if early:
        return None
    aside = np.cross(points, np.random.default_rng(5).standard_normal(points.shape))
    return points + 0.03 * aside / np.linalg.norm(aside, axis=1, keepdims=True)


@pytest.mark.long
def test_a_remeshing_that_gives_back_too_much_is_taken_in_part_until_it_wears_out_the_mesh():
    points, cells = icosphere(2)
    flow = Willmore((points * [1.0, 1.0, 1.6], cells.triangles), ("area", "volume"))

    def run(steps, stall=1e-9, state=None):
        run = Evolution(flow, Stepping(steps=steps, stall=stall, remesh=True))
        run._remesher = spoiled
        if state is not None:
            run.resume(state)
        return run, list(run)

    whole, moments = run(60)
    jumps = np.array([moment.record.remesh_jump for moment in moments])
    assert (jumps > 0).any()
    assert whole.reason.startswith("the energy falls only by wearing out the mesh")
    assert 10 <= whole.step < 60
    assert moments[-1].record.energy < moments[0].record.energy
    resumed, _ = run(60, state=run(whole.step - 3)[0].state())
    assert (resumed.step, resumed.reason) == (whole.step, whole.reason)
    assert run(60, stall=0.0)[0].reason == "reached steps = 60"


def test_where_the_worst_cannot_be_raised_the_rest_still_is(monkeypatch):
    from surface.flow import remeshing

    asked = []

    class Remeshing(remeshing.Remeshing):
        def __init__(self, mesh, options):
            asked.append(options.emphasis)
            super().__init__(mesh, replace(options, max_iterations=0) if options.emphasis == "worst" else options)

    monkeypatch.setattr(remeshing, "Remeshing", Remeshing)
    records = [m.record for m in evolve(MeanCurvature(as_arrays(shaken(icosphere(2), 0.03))), steps=11, remesh=True)]
    assert asked == ["mean"] * 10 + ["worst", "mean"]
    assert np.isfinite(records[11].remesh_jump)
