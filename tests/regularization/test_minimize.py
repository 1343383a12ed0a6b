"""Exact minimizers, and ways to them."""

import numpy as np
import pytest
from meshes.hexahedra import jittered_box

import hexconformal as hc
from hexconformal import generate
from hexconformal.regularization import minimize
from hexconformal.solver import lbfgs

ENERGIES = ["barrier", "quaternionic"]


@pytest.mark.parametrize("energy", ENERGIES)
def test_sheared_cube_of_figure_3_becomes_perfectly_regular(energy):
    result = hc.regularize(generate.sheared_cube(15), energy=energy, gradient_tolerance=1e-12)
    regular, _ = generate.box((15, 15, 15))
    assert np.abs(result.points - regular).max() < 1e-12
    assert result.report.energy_after < 1e-20
    assert result.converged


@pytest.mark.parametrize("energy", ENERGIES)
def test_sheared_block_held_at_its_bottom_becomes_the_cube(energy):
    points, cells = generate.sheared_block(6, shear=1.5)
    bottom = points[:, 1] == 0.0
    result = hc.regularize((points, cells), boundary="free", fixed=bottom, energy=energy, gradient_tolerance=1e-10)
    straight = points - 1.5 * points[:, 1:2] * [1.0, 0.0, 0.0]
    assert np.abs(result.points - straight).max() < 1e-9


def test_majorize_minimize_never_raises_the_energy_and_finds_the_same_minimum():
    mesh = generate.twisted_cube(5, 50)
    options = {"boundary": "fixed", "energy": "quaternionic", "gradient_tolerance": 1e-8}
    slow = hc.regularize(mesh, method="majorize", **options)
    energies = [record.energy for record in slow.history]
    assert slow.converged
    assert len(energies) > 5
    assert all(b <= a * (1 + 1e-14) for a, b in zip(energies[:-1], energies[1:], strict=True))
    fast = hc.regularize(mesh, method="newton", **options)
    assert np.abs(slow.points - fast.points).max() < 1e-8


@pytest.mark.parametrize("method", ["lbfgs", "newton", "auto"])
def test_solvers_agree_on_the_minimizer(method):
    mesh = generate.twisted_cube(5, 50)
    exact = hc.regularize(mesh, boundary="fixed", method="newton", emphasis="mean", gradient_tolerance=1e-12)
    result = hc.regularize(mesh, boundary="fixed", method=method, emphasis="mean", gradient_tolerance=1e-9)
    assert result.converged
    assert np.abs(result.points - exact.points).max() < 1e-9


def test_newton_converges_superlinearly():
    options = {"boundary": "fixed", "method": "newton", "emphasis": "mean", "gradient_tolerance": 1e-12}
    history = hc.regularize(generate.twisted_cube(5, 50), **options).history
    gradients = np.array([record.gradient for record in history if record.gradient > 1e-11])
    orders = np.log(gradients[2:]) / np.log(gradients[1:-1])
    assert orders[-2:].min() > 1.4  # systems are solved to the root of the gradient: order 3/2


@pytest.mark.parametrize("energy", ENERGIES)
def test_a_regular_mesh_is_a_fixed_point(energy):
    mesh = generate.box((4, 4, 4))
    result = hc.regularize(mesh, energy=energy)
    assert result.converged
    assert np.abs(result.points - mesh[0]).max() < 1e-14


def test_volume_weights_change_the_compromise_but_not_a_perfect_mesh():
    points, cells = generate.box((5, 5, 5))
    mesh = generate.jittered(points**2, cells, 0.1, seed=3)
    one = hc.regularize(mesh, boundary="fixed", emphasis="mean", weight="reference").points
    other = hc.regularize(mesh, boundary="fixed", emphasis="mean", weight="volume").points
    assert np.abs(one - other).max() > 1e-4
    sheared = hc.regularize(generate.sheared_cube(6), weight="volume", gradient_tolerance=1e-12).points
    assert np.abs(sheared - generate.box((6, 6, 6))[0]).max() < 1e-11


def test_the_plain_energy_would_fold_and_the_line_search_does_not_let_it():
    points, cells = generate.sheared_cube(12)
    result = hc.regularize((points, cells), boundary="fixed", energy="quaternionic", max_iterations=60)
    assert result.report.before.invalid == 0
    assert result.report.after.invalid == 0
    assert all(record.inverted == 0 for record in result.history)
    assert result.report.energy_after < result.report.energy_before


def test_no_step_is_taken_beyond_the_last(monkeypatch):
    taken = []

    def counted(at, preconditioner):
        for following in lbfgs(at, preconditioner):
            taken.append(following)
            yield following

    monkeypatch.setattr(minimize, "lbfgs", counted)
    for most in (0, 2):
        taken.clear()
        report = hc.regularize(jittered_box(), method="lbfgs", emphasis="mean", max_iterations=most).report
        assert (report.iterations, len(taken)) == (most, most)
    taken.clear()
    result = hc.regularize(jittered_box(), method="lbfgs", emphasis="mean")
    assert result.converged
    assert len(taken) == result.report.iterations > 5


def test_a_free_boundary_needs_no_pins_with_the_barrier():
    points, cells = jittered_box(4)
    result = hc.regularize((points, cells), boundary="free", gradient_tolerance=1e-8)
    assert result.report.after.scaled_jacobian.min > 0.999999
