"""Validity of tetrahedra, wedges and pyramids against sampling, exact arithmetic, and cells made to be hard."""

from fractions import Fraction

import numpy as np
import pytest
from meshes.hexahedra import separate
from meshes.linear_cells import OTHERS, determinants, random_cells, sample_points

from hexconformal.elements import PYRAMID, TETRAHEDRON, WEDGE, all_valid, determinant_bounds, valid_cells
from hexconformal.elements.hexahedron import CORNERS, HEXAHEDRON
from hexconformal.elements.linear_validity import row_bounds

each_type = pytest.mark.parametrize("cell_type", OTHERS, ids=lambda one: one.name)
COUNT = 20_000


def sampled_minimum(cell_type, x, steps=21):
    points = sample_points(cell_type, steps if cell_type is WEDGE else 3)
    parts = np.array_split(x, max(len(x) // 1000, 1))
    return np.concatenate([determinants(cell_type, part, points).min(axis=1) for part in parts])


@each_type
def test_sampling_agrees(cell_type):
    x = random_cells(cell_type, COUNT, 0.9)
    x *= np.random.default_rng(1).uniform(0.2, 5, (COUNT, 1, 3))
    lower, upper = determinant_bounds(*separate(x), cell_type)
    valid, least = valid_cells(*separate(x), cell_type), sampled_minimum(cell_type, x)
    assert 0.1 < valid.mean() < 0.9
    assert (least[valid] > 0).all()
    assert (lower <= least).all()
    # What samples do not see lies between them, on a parabola.
    unseen = ~valid & (least > 0)
    assert unseen.mean() < 1e-3
    assert (sampled_minimum(cell_type, x[unseen], 5001) < 1e-6).all()
    np.testing.assert_allclose(upper, least, atol=0.02 * np.abs(x).max() ** 3)
    np.testing.assert_array_equal(valid, upper > 0)


def test_corners_alone_do_not_tell_of_a_wedge():
    x = random_cells(WEDGE, COUNT, 0.9)
    edges = x[:, WEDGE.neighbours] - x[:, :, None]
    fine_at_corners = (np.linalg.det(edges) > 0).all(axis=1)
    valid = valid_cells(*separate(x), WEDGE)
    assert not (valid & ~fine_at_corners).any()
    assert 0.02 < (fine_at_corners & ~valid).sum() / fine_at_corners.sum() < 0.1


def test_the_wedge_of_the_design_is_invalid_inside(shared):
    x = np.load(shared / "meshes" / "elements" / "wedge_invalid_inside.npy").reshape(1, 6, 3)
    edges = x[:, WEDGE.neighbours] - x[:, :, None]
    assert np.linalg.det(edges).min() > 0
    assert sampled_minimum(WEDGE, x).min() < 0
    assert not valid_cells(*separate(x), WEDGE)[0]


def test_a_twisted_wedge_is_valid_up_to_the_angle_that_the_parabola_tells():
    # Turning the upper triangle by an angle has the rows (1, cos, 1): they touch zero at half a turn.
    for degrees, expected in ((0, True), (90, True), (179, True), (181, False)):
        angle = np.radians(min(degrees, 360 - degrees))
        stretch = 1.0 if degrees < 180 else 1.1
        turn = np.array([[np.cos(angle), np.sin(angle), 0], [-np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
        x = WEDGE.ideal.copy()
        x[3:] = (x[3:] @ turn) * [stretch, 1 / stretch, 1]
        assert valid_cells(x, np.arange(6)[None], WEDGE)[0] == expected


@pytest.mark.parametrize(
    ("row", "least"),
    [
        ((1, 1, 1), 1),
        ((1, 2, 3), 1),
        ((3, 2, 1), 1),
        ((1, -1, 1), 0),
        ((4, -2, 1), 0),
        ((1, -2, 1), -0.5),
        ((-1, 5, 1), -1),
    ],
)
def test_minimum_of_a_parabola(row, least):
    assert row_bounds(np.array([row], float), 1) == pytest.approx(least, abs=1e-15)
    t = np.linspace(0, 1, 10_001)
    assert ((1 - t) ** 2 * row[0] + 2 * t * (1 - t) * row[1] + t**2 * row[2]).min() == pytest.approx(least, abs=1e-6)


def test_a_hexahedron_goes_its_own_way():
    points, cells = separate(CORNERS + np.random.default_rng(0).uniform(-0.5, 0.5, (500, 8, 3)))
    valid = valid_cells(points, cells, HEXAHEDRON)
    assert valid.any()
    assert not valid.all()
    assert all_valid(points, cells[valid])


@each_type
@pytest.mark.parametrize("scale", [1e-30, 1e-3, 1e30])
def test_scale_and_place_do_not_matter(cell_type, scale):
    x = random_cells(cell_type, 2000, 0.9)
    expected = valid_cells(*separate(x), cell_type)
    np.testing.assert_array_equal(valid_cells(*separate(scale * x), cell_type), expected)
    np.testing.assert_array_equal(valid_cells(*separate(scale * (x + 1000.0)), cell_type), expected)


def exact_minimum(cell_type, x):
    """The minimum of det J where it can be negative, without rounding: only its sign is exact on wedges."""
    x = [[Fraction(value) for value in point] for point in x.tolist()]

    def edge(a, b):
        return [q - p for p, q in zip(x[a], x[b], strict=True)]

    def det(a, b, c):
        return sum(a[i] * (b[i - 2] * c[i - 1] - b[i - 1] * c[i - 2]) for i in range(3))

    corners = [det(*(edge(q, int(b)) for b in cell_type.neighbours[q])) for q in range(len(cell_type.neighbours))]
    if cell_type is not WEDGE or min(corners) <= 0:
        return min(corners)
    for q in range(3):
        (a, b, c), (i, j, _) = [edge(q, int(b)) for b in WEDGE.neighbours[q]], WEDGE.neighbours[q].tolist()
        middle = (det(a, edge(q + 3, j + 3), c) + det(edge(q + 3, i + 3), b, c)) / 2
        if middle <= 0 and middle**2 >= corners[q] * corners[q + 3]:
            return Fraction(-1)
    return min(corners)


@pytest.mark.long
@each_type
def test_what_is_said_to_be_valid_is_valid_however_flat(cell_type):
    rng = np.random.default_rng(3)
    x = random_cells(cell_type, 3000, 0.1)
    # Flat up to rounding, and turned so that it is rounded everywhere.
    x[:, :, 2] *= 10.0 ** rng.uniform(-18, -12, (len(x), 1))
    x = x @ np.linalg.qr(rng.normal(size=(3, 3)))[0] + rng.normal(size=(len(x), 1, 3))
    valid = valid_cells(*separate(x), cell_type)
    truly = np.array([exact_minimum(cell_type, one) > 0 for one in x])
    assert not (valid & ~truly).any()
    assert 0.02 < valid.mean() < truly.mean() < 1


@each_type
@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_numbers_that_are_none_make_no_valid_cell(cell_type, bad):
    for node in cell_type.nodes:
        x = cell_type.ideal.copy()
        x[node, 1] = bad
        assert not valid_cells(x, np.array([cell_type.nodes]), cell_type)[0]


def test_one_determinant_of_a_tetrahedron_and_four_of_a_pyramid():
    x = random_cells(TETRAHEDRON, 500, 0.5)
    np.testing.assert_allclose(
        determinant_bounds(*separate(x), TETRAHEDRON)[1], np.linalg.det(x[:, 1:] - x[:, :1]), atol=1e-14
    )
    # The apex may lie anywhere above the base: over a square the four are alike, outside of it too.
    x = np.array(PYRAMID.ideal)
    for apex, expected in (([5.0, 5, 1], True), ([0.5, 0.5, -1], False)):
        x[4] = apex
        assert valid_cells(x, np.arange(5)[None], PYRAMID)[0] == expected
