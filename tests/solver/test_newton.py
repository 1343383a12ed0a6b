"""Newton steps with the convex Hessian: where they end, and what rounding leaves in them."""

import numpy as np
from corner_problems import fixed_boundary_energy, jittered_cubes
from hexconformal.energy.corner_energy import CornerEnergy, Weights
from hexconformal.solver.projected_newton import newton_step, projected_newton

from hexconformal import generate


def test_newton_converges_to_the_perfect_mesh():
    points, cells = jittered_cubes()
    problem = fixed_boundary_energy(points, cells)
    *_, (best, energy) = projected_newton(problem, points, Weights(), decrease=1e-12)
    assert energy < 1e-12
    assert np.abs(best - 4 * generate.box((4, 4, 4))[0]).max() < 1e-6


def test_a_rounded_step_forgets_rounding_in_its_input_and_stays_admissible():
    points, cells = generate.jittered(*generate.box((3, 3, 3)), 0.3, seed=3)
    noise = 1e-13 * np.random.default_rng(0).normal(size=points.shape)
    slanted = np.array([0.6, 0.0, 0.8])
    projectors = np.tile(np.eye(3), (len(points), 1, 1))
    projectors[::5] -= np.outer(slanted, slanted)
    weights, moved = Weights(), {}
    for rounding in (0.0, 2.0**-10):
        problem = CornerEnergy(cells, np.empty((0, 1, 3, 3)), projectors, rounding=rounding)
        moved[rounding] = [
            newton_step(problem, x, weights, 1e-5, lambda _: True)[0] - x for x in (points, points + noise)
        ]
        assert np.abs(moved[rounding][0][::5] @ slanted).max() < 1e-15
    differences = {rounding: np.abs(one - other)[1::5].max() for rounding, (one, other) in moved.items()}
    assert differences[2.0**-10] < 1e-15 < 1e-13 < differences[0.0]
    # Half the rounding, of an edge of a third is what it costs.
    assert np.abs(moved[0.0][0] - moved[2.0**-10][0]).max() < 2.0**-11 / 3
