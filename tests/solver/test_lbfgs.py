"""L-BFGS on quadratic functions, of which the way is known."""

import numpy as np
import pytest

from hexconformal.energy import Objective, Term
from hexconformal.solver import Problem, lbfgs


class Quadratic(Term):
    """Half the sum of curvatures times squared coordinates; each view from a place adds to a count."""

    def __init__(self, curvatures, seen=0):
        self.curvatures, self.seen = curvatures, seen

    def value(self, points):
        return 0.5 * float((self.curvatures * points**2).sum())

    def value_gradient(self, points):
        return self.value(points), self.curvatures * points

    def add_convex(self, points, gradient, assembly):
        raise NotImplementedError

    def restricted(self, patch):
        raise NotImplementedError

    def renewed(self, points):
        return Quadratic(self.curvatures, self.seen + 1)


CURVATURES = np.geomspace(1.0, 30.0, 12).reshape(4, 3)


def gradients(preconditioner, most):
    """Norms of the gradient, iteration by iteration, relative to the first."""
    problem = Problem(Objective((Quadratic(CURVATURES),)), lambda field: field)
    start = problem.at(np.random.default_rng(0).normal(size=(4, 3)))
    found = [at for at, _ in zip(lbfgs(start, preconditioner), range(most), strict=False)]
    assert [at.problem.objective.terms[0].seen for at in found] == list(range(1, most + 1))
    assert all(a.energy >= b.energy for a, b in zip([start, *found[:-1]], found, strict=True))
    return np.array([at.gradient_norm for at in found]) / start.gradient_norm


def test_with_the_inverse_for_a_preconditioner_it_is_one_step():
    assert gradients(lambda field: field / CURVATURES, 1)[0] < 1e-14


def test_pairs_make_up_for_a_preconditioner_that_knows_little():
    # Steepest descent with the same line search comes to 8e-4.
    assert gradients(lambda field: field, 40)[-1] < 1e-4


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_the_scale_of_the_preconditioner_is_learnt(scale):
    norms = gradients(lambda field: scale * field / CURVATURES, 15)
    assert norms[-1] < 1e-8
