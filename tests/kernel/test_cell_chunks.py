"""Cells in chunks: those of one colour share no node, and sums have the same bits with any number of threads."""

import numpy as np
import pytest

from hexconformal import generate
from hexconformal.energy import Assembly, CornerTerm, CornerWeights, DistortionTerm, VolumeTerm
from hexconformal.kernel import CellChunks, cell_chunks, threads

BALL = generate.jittered(*generate.ball(4, 3), 0.2)


@pytest.fixture
def small(monkeypatch):
    """Chunks of few cells, and ranges of few items."""
    monkeypatch.setattr(cell_chunks, "_SIZE", 7)
    monkeypatch.setattr(cell_chunks, "_FEWEST", 2)
    monkeypatch.setattr(threads, "_SMALLEST_RANGE", 1)


def shuffled(cells):
    return np.random.default_rng(0).permutation(cells)


@pytest.mark.parametrize("order", [np.array, shuffled])
def test_chunks_of_one_colour_share_no_node(order, small):
    points, cells = BALL
    cells = order(cells)
    chunks = CellChunks.of(cells, len(points))
    assert sorted(chunks.order) == list(range(-(-len(cells) // 7)))
    assert chunks.starts[-1] == len(chunks.order)
    for first, last in zip(chunks.starts[:-1], chunks.starts[1:], strict=True):
        nodes = [np.unique(cells[7 * chunk : 7 * chunk + 7]) for chunk in chunks.order[first:last]]
        assert len(np.unique(np.concatenate(nodes))) == sum(len(own) for own in nodes)


def test_ordered_cells_need_few_colours(small):
    points, cells = generate.box((12, 12, 12))
    assert len(CellChunks.of(cells, len(points)).starts) < 30


def test_few_cells_are_one_chunk():
    points, cells = generate.box((4, 4, 4))
    chunks = CellChunks.of(cells, len(points))
    assert chunks.size == 64
    assert list(chunks.order) == [0]


def test_no_cells_have_no_sum():
    assert CellChunks.unshared(0).total(lambda *arguments: None) == 0.0


TERMS = {
    "corners": lambda cells, count: CornerTerm(cells, np.empty((0, 1, 3, 3)), CornerWeights(1.0, 1.0)),
    "volumes": lambda cells, count: VolumeTerm(cells, np.full(len(cells), 0.01)),
    "quadrature": lambda cells, count: DistortionTerm(cells, count, eps=0.0),
}


@pytest.mark.parametrize("kind", TERMS)
def test_sums_have_the_same_bits_with_any_number_of_threads(kind, small, monkeypatch):
    points, cells = BALL
    term, found = TERMS[kind](cells, len(points)), []
    for count in (1, 2, 5):
        monkeypatch.setattr(threads, "thread_count", lambda count=count: count)
        assembly, gradient = Assembly.of_cells(cells, np.ones(len(points), bool), diagonals=True), np.zeros_like(points)
        value = term.add_convex(points, gradient, assembly)[0]
        found.append((value, gradient, assembly.matrix.data, term.value(points), *term.value_gradient(points)))
    for other in found[1:]:
        for one, same in zip(found[0], other, strict=True):
            assert np.array_equal(one, same)
    monkeypatch.setattr(cell_chunks, "_FEWEST", 10**9)
    whole, gradient = Assembly.of_cells(cells, np.ones(len(points), bool), diagonals=True), np.zeros_like(points)
    assert term.add_convex(points, gradient, whole)[0] == pytest.approx(found[0][0], rel=1e-13)
    np.testing.assert_allclose(gradient, found[0][1], rtol=0, atol=1e-12 * np.abs(gradient).max())
    np.testing.assert_allclose(whole.matrix.data, found[0][2], rtol=0, atol=1e-12 * np.abs(whole.matrix.data).max())


@pytest.mark.parametrize("kind", TERMS)
def test_a_folded_cell_makes_a_sum_infinite(kind, small):
    points, cells = BALL
    points = points.copy()
    points[cells[-1]] = points[cells[-1]][::-1]
    assert TERMS[kind](cells, len(points)).value(points) == np.inf
