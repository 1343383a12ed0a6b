"""When a minimization of the distortion ends, what it watches, and what takes over."""

import numpy as np
import pytest

import hexconformal as hc
from hexconformal.elements import is_valid
from hexconformal.formulation.formulation import ValidCells
from hexconformal.formulation.schedules import MinimizationSchedule, Schedules
from hexconformal.generate import boundary_layer, box, jittered, sheared_cube
from hexconformal.mesh.normalized_mesh import NormalizedMesh
from hexconformal.regularization.boundary import Boundary
from hexconformal.regularization.minimize import Minimization
from hexconformal.regularization.options import Options
from hexconformal.regularization.setting import Setting
from hexconformal.solver.admissible import boundary_directions


def minimization(points, cells, boundary="fixed", schedules=None, **options):
    """That of the distortion alone, with the mesh it is of."""
    normalized = NormalizedMesh(hc.HexMesh(points, cells))
    setting = Setting(normalized, Options(boundary=boundary, **options), schedules or Schedules())
    admissible = boundary_directions(normalized.points, normalized.quads, boundary)
    formulation = setting.formulation(Boundary(admissible))
    run = Minimization(
        setting.distortion, formulation, setting.options, normalized.points, normalized.referenced, alone=True
    )
    return run, normalized


def test_valid_cells_are_watched_beside_folded_ones():
    points, cells = jittered(*box((4, 4, 4)), 0.7, seed=1, valid=False)
    run, normalized = minimization(points, cells, energy="quaternionic", method="lbfgs")
    valid = is_valid(normalized.points, cells)
    assert 0 < valid.sum() < len(cells)
    broken = normalized.points.copy()
    first = cells[np.flatnonzero(valid)[-1]]
    broken[first[0]] += 2 * (broken[first[6]] - broken[first[0]])
    keeps = ValidCells(normalized.points, cells)
    assert keeps(normalized.points)
    assert not keeps(broken)
    # The folded ones may stay as they are.
    for _, step in zip(range(3), run, strict=False):
        assert is_valid(step.points, cells)[valid].all()


def test_cells_that_become_valid_are_watched_from_then_on():
    straight, cells = box((3, 3, 3))
    tangled = straight.copy()
    tangled[0] = 0.9
    keeps = ValidCells(tangled, cells)
    assert keeps(straight)
    assert keeps(tangled)
    keeps.grow(straight)
    assert keeps(straight)
    assert not keeps(tangled)


def test_the_end_is_told_and_reached():
    run, _ = minimization(*sheared_cube(5), boundary="slide", emphasis="mean", gradient_tolerance=1e-3)
    gradients = [step.gradient for step in run]
    assert run.converged
    assert "gradient fell below 0.001" in run.reason
    assert len(gradients) > 2
    assert gradients[-1] <= 1e-3 < gradients[-2]


def test_a_stall_ends_it_where_the_worst_cells_are_raised_afterwards():
    points, cells = jittered(*box((5, 5, 5)), 0.45, seed=2, keep_boundary=False)
    run, _ = minimization(points, cells, emphasis="worst", gradient_tolerance=1e-12)
    energies = [step.energy for step in run]
    assert run.reason == "the energy stalls"
    drops = -np.diff(energies) / np.array(energies[:-1])
    assert (drops[-2:] < 3e-3).all()
    assert (drops[:-2] >= 3e-3).any()


def test_newton_takes_over_from_lbfgs():
    run, _ = minimization(*sheared_cube(6), boundary="fixed", emphasis="mean", gradient_tolerance=1e-10)
    phases = [step.phase for step in run]
    assert phases[:5] == ["lbfgs"] * 5
    assert phases[-1] == "newton"


def test_newton_takes_over_after_so_many_iterations_at_the_latest():
    early = Schedules(minimization=MinimizationSchedule(handover=3))
    run, _ = minimization(*sheared_cube(6), schedules=early, emphasis="mean", gradient_tolerance=1e-10)
    assert [step.phase for step, _ in zip(run, range(4), strict=False)] == ["lbfgs"] * 3 + ["newton"]


def test_large_cells_count_more_by_their_volume():
    points, cells = boundary_layer((3, 3, 4), 4.0)
    points, cells = jittered(points, cells, 0.2)
    run, normalized = minimization(points, cells, weight="volume")
    plain, _ = minimization(points, cells, weight="reference")
    volumes = hc.quality((normalized.points, cells)).volume
    each, weighted = (one._distortion.cell_energies(normalized.points) for one in (plain, run))
    np.testing.assert_allclose(weighted, each * volumes / volumes.mean(), rtol=1e-12)


def test_thin_cells_are_stiffer_in_the_metric():
    points, cells = boundary_layer((3, 3, 4), 4.0)
    run, normalized = minimization(points, cells)
    stiffness, volumes = run._stiffness(), hc.quality((normalized.points, cells)).volume
    np.testing.assert_allclose(stiffness, volumes ** (-2 / 3), rtol=1e-9)


@pytest.mark.parametrize("energy", ["barrier", "quaternionic"])
def test_newton_converges_quadratically_and_lbfgs_linearly(energy):
    # 6 and 16 iterations.
    mesh = hc.HexMesh(*jittered(*box((5, 5, 5)), 0.2, seed=1))
    ended = {}
    for method in ("newton", "lbfgs"):
        options = {"boundary": "fixed", "emphasis": "mean", "gradient_tolerance": 1e-9, "energy": energy}
        result = hc.regularize(mesh, method=method, **options)
        assert result.converged
        ended[method] = [one.gradient for one in result.history]
    assert ended["newton"][-1] < ended["newton"][-2] ** 1.3
    assert ended["lbfgs"][-1] > ended["lbfgs"][-2] ** 1.3
    assert len(ended["newton"]) < 10 < len(ended["lbfgs"])
