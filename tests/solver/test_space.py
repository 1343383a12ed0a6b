"""Minimizers know nothing of how nodes are shared out: two parts with copies of common nodes come to what one does."""

from itertools import islice

import numpy as np
import pytest
from meshes.hexahedra import off_boundary

from hexconformal import generate
from hexconformal.energy import DistortionTerm, Objective
from hexconformal.mesh import Space
from hexconformal.solver import MatrixFreeEquation, Problem, lbfgs, newton

POINTS, CELLS = generate.jittered(*generate.box((4, 4, 4)), 0.3, seed=3)
POINTS = 4.0 * POINTS
INNER = off_boundary(POINTS, CELLS)


class TwoParts(Space):
    """Fields of two parts one below the other; the first copy of a node owns it."""

    def __init__(self, ids):
        self.ids = ids
        self.owners = np.unique(ids, return_index=True)[1]

    def inner(self, a, b):
        return float(np.einsum("ij,ij->", a[self.owners], b[self.owners]))

    def update(self, field):
        return field[self.owners][self.ids]

    def add(self, field):
        whole = np.zeros((len(self.owners), 3))
        np.add.at(whole, self.ids, field)
        return whole[self.ids]


def in_parts():
    """Ids of the nodes of both parts, and their cells in these numbers."""
    ids, cells, start = [], [], 0
    for part in (CELLS[:27], CELLS[27:]):
        nodes, local = np.unique(part, return_inverse=True)
        ids.append(nodes)
        cells.append(local.reshape(part.shape) + start)
        start += len(nodes)
    return np.concatenate(ids), np.concatenate(cells)


def problem(cells, points, inner, **space):
    term = DistortionTerm(cells, len(points), None, None, 0.0, "corners")
    return Problem(Objective((term,)), lambda field: field * inner[:, None], **space).at(points)


def run(method, at):
    if method == "lbfgs":
        return lbfgs(at, np.copy, scaled=True)
    return newton(at, MatrixFreeEquation(lambda field: field / 8.0, at.gradient_norm))


@pytest.mark.parametrize("method", ["lbfgs", "newton"])
def test_two_parts_come_to_the_same_as_one(method):
    ids, cells = in_parts()
    assert len(ids) > len(POINTS)
    whole = run(method, problem(CELLS, POINTS, INNER))
    parts = run(method, problem(cells, POINTS[ids], INNER[ids], space=TwoParts(ids)))
    for one, other in islice(zip(whole, parts, strict=False), 8):
        assert other.energy == pytest.approx(one.energy, rel=1e-9)
        np.testing.assert_allclose(other.points, one.points[ids], atol=1e-9)
    assert one.energy < 0.1 * problem(CELLS, POINTS, INNER).energy


@pytest.mark.parametrize("method", ["lbfgs", "newton"])
@pytest.mark.parametrize("without", ["inner", "add"])
def test_without_its_sums_they_would_not(method, without):
    ids, cells = in_parts()
    space = TwoParts(ids)
    setattr(space, without, getattr(Space(), without))
    *_, one = islice(run(method, problem(CELLS, POINTS, INNER)), 3)
    *_, other = islice(run(method, problem(cells, POINTS[ids], INNER[ids], space=space)), 3)
    assert np.abs(other.points - one.points[ids]).max() > 1e-6
