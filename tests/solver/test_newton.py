"""Newton steps with the convex Hessian: where they end, and what rounding leaves in them."""

import numpy as np
from corner_problems import fixed_boundary, formulation_of, jittered_cubes

from hexconformal import generate
from hexconformal.energy import CornerWeights
from hexconformal.formulation.formulation import convex_newton
from hexconformal.solver import newton_step


def test_newton_converges_to_the_perfect_mesh():
    points, cells = jittered_cubes()
    *_, last = convex_newton(fixed_boundary(points, cells), points, CornerWeights(), decrease=1e-12)
    assert last.energy < 1e-12
    assert np.abs(last.points - 4 * generate.box((4, 4, 4))[0]).max() < 1e-6


def test_a_rounded_step_forgets_rounding_in_its_input_and_stays_admissible():
    points, cells = generate.jittered(*generate.box((3, 3, 3)), 0.3, seed=3)
    noise = 1e-13 * np.random.default_rng(0).normal(size=points.shape)
    slanted = np.array([0.6, 0.0, 0.8])
    projectors = np.tile(np.eye(3), (len(points), 1, 1))
    projectors[::5] -= np.outer(slanted, slanted)
    moved = {}
    for rounding in (0.0, 2.0**-10):
        formulation = formulation_of(points, cells, projectors, rounding=rounding)
        problem = formulation.problem(formulation.objective(CornerWeights()))
        moved[rounding] = [
            newton_step(problem.start(x), formulation.equation)[0].points - x for x in (points, points + noise)
        ]
        assert np.abs(moved[rounding][0][::5] @ slanted).max() < 1e-15
    differences = {rounding: np.abs(one - other)[1::5].max() for rounding, (one, other) in moved.items()}
    assert differences[2.0**-10] < 1e-15 < 1e-13 < differences[0.0]
    # Half the rounding, of an edge of a third is what it costs.
    assert np.abs(moved[0.0][0] - moved[2.0**-10][0]).max() < 2.0**-11 / 3


def test_a_short_step_gets_a_larger_shift_next_time_and_a_long_one_a_smaller():
    points, cells = jittered_cubes(2)
    equation = fixed_boundary(points, cells).equation
    assert equation.after(1.0).added == equation.added == 1e-5
    assert equation.after(0.25).added == 4.0 * equation.added
    assert equation.after(0.25).after(0.5).added == equation.added
    for _ in range(20):
        equation = equation.after(0.25)
    assert equation.added == 0.1
