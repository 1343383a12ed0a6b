"""Options of the minimization have an effect on curved boundaries too, with either energy."""

import numpy as np
import pytest
import pyvista as pv
from meshes.hexahedra import with_rough_surface

import hexconformal as hc
from hexconformal import generate
from hexconformal.mesh.topology import boundary_quads

ENERGIES = ["barrier", "quaternionic"]
ROUGH = with_rough_surface(generate.cylinder(3, 2, 4))
DIAGONAL = np.linalg.norm(np.ptp(ROUGH[0], axis=0))


def run(**options):
    """The result of a few iterations, as promised."""
    result = hc.regularize(ROUGH, **{"max_iterations": 12, **options})
    report = result.report
    assert report.after.invalid == 0
    assert report.hausdorff <= report.hausdorff_bound
    assert report.energy_after < report.energy_before
    assert not any("without effect" in note for note in report.notes)
    return result


def apart(one, other):
    return np.abs(one.points - other.points).max() / DIAGONAL


@pytest.mark.long
@pytest.mark.parametrize("energy", ENERGIES)
@pytest.mark.parametrize("emphasis", ["auto", "mean"])
def test_each_option_changes_the_result(energy, emphasis):
    plain = run(energy=energy, emphasis=emphasis)
    other_rule = "gauss" if energy == "barrier" else "corners"
    for option in ({"weight": "volume"}, {"quadrature": other_rule}, {"method": "lbfgs"}, {"method": "newton"}):
        assert apart(run(energy=energy, emphasis=emphasis, **option), plain) > 1e-4, option


@pytest.mark.parametrize("energy", ENERGIES)
@pytest.mark.parametrize("method", ["lbfgs", "newton", "majorize"])
def test_the_method_that_is_asked_for_is_the_one_that_is_told(energy, method):
    result = run(energy=energy, method=method, emphasis="mean")
    phases = [record.phase for record in result.history]
    assert phases[0] == "input"
    assert set(phases[1:10]) == {method}
    energies = [record.energy for record in result.history[:10]]
    assert energies[-1] < energies[0]


def test_left_to_itself_it_is_the_convex_equation():
    for energy in ENERGIES:
        auto, same = (run(energy=energy, emphasis="mean", method=method) for method in ("auto", "majorize"))
        assert np.array_equal(auto.points, same.points)
        assert auto.history[1].phase == "distortion"


@pytest.mark.long
@pytest.mark.parametrize("energy", ENERGIES)
@pytest.mark.parametrize("method", ["auto", "lbfgs", "newton", "majorize"])
def test_a_gradient_that_is_small_enough_ends_it(energy, method):
    most = {"max_iterations": 60}
    long = run(energy=energy, method=method, emphasis="mean", **most)
    short = run(energy=energy, method=method, emphasis="mean", gradient_tolerance=0.9, **most)
    assert short.report.reason == "gradient fell below 0.9 of its start"
    assert short.converged
    assert len(short.history) < len(long.history)
    assert apart(short, long) > 1e-4


@pytest.mark.parametrize("energy", ENERGIES)
def test_a_curved_boundary_slides_with_either_energy_and_stays_where_it_may_not(energy):
    points, cells = ROUGH
    surface = np.unique(boundary_quads(cells)[0])
    result = run(energy=energy)
    assert np.linalg.norm(result.points - points, axis=1)[surface].max() > 1e-3 * DIAGONAL
    assert 0.0 < result.report.hausdorff <= 0.005
    wider, narrower = (run(energy=energy, hausdorff=bound).report for bound in (0.02, 0.001))
    assert narrower.hausdorff < result.report.hausdorff
    assert wider.energy_after < narrower.energy_after
    # Without a bound curved parts stay: the nodes that move do so in the flat ends.
    still = hc.regularize(ROUGH, energy=energy, hausdorff=0.0, max_iterations=12)
    mantle = surface[(points[surface, 2] > 0.1) & (points[surface, 2] < points[:, 2].max() - 0.1)]
    assert np.array_equal(still.points[mantle], points[mantle])
    assert still.report.hausdorff == 0.0


@pytest.mark.parametrize("boundary", ["slide", "fixed"])
def test_a_ball_without_a_flat_face_is_held_by_its_barrier(boundary):
    points, cells = with_rough_surface(generate.ball(2, 1))
    report = hc.regularize((points, cells), energy="quaternionic", boundary=boundary, max_iterations=10).report
    assert report.after.invalid == 0
    assert report.hausdorff <= 0.005
    assert abs(report.volume_change) < 0.05
    assert (report.boundary_moved > 0) == (boundary == "slide")


@pytest.mark.parametrize("energy", ENERGIES)
def test_another_surface_goes_with_either_energy(energy):
    points, cells = generate.ball(3, 2)
    surface = pv.Sphere(radius=1.03, theta_resolution=60, phi_resolution=60)
    start = hc.regularize((points, cells), surface=surface, energy=energy, max_iterations=0).report
    report = hc.regularize((points, cells), surface=surface, energy=energy, hausdorff=0.025, max_iterations=20).report
    assert report.after.invalid == 0
    assert report.hausdorff <= 0.025 < start.hausdorff
    assert report.boundary_moved == len(np.unique(boundary_quads(cells)[0]))


@pytest.mark.parametrize("energy", ENERGIES)
@pytest.mark.parametrize("method", ["lbfgs", "newton", "majorize"])
def test_a_run_that_is_left_for_its_result_goes_on_as_if_it_had_not_been(energy, method):
    # The result, whose volume is restored, is found with the same formulation.
    options = hc.Options(energy=energy, method=method, conserve_volume=True, max_iterations=12)
    whole, left = (hc.Regularization(ROUGH, options) for _ in range(2))
    for _ in whole:
        pass
    for record in left:
        if record.iteration == 4:
            assert left.result().report.reason == "interrupted"
    assert [record.phase for record in left.history] == [record.phase for record in whole.history]
    assert np.array_equal(left.points, whole.points)
