"""What objectives are put together from."""

import numpy as np
import pytest
from corner_problems import formulation_of

from hexconformal import generate
from hexconformal.elements import CELL_TYPES, cell_volumes, collapsed_cells, corner_scaled_jacobian
from hexconformal.energy import CornerWeights
from hexconformal.formulation import LEVEL


def test_volumes_count_only_where_they_have_a_weight():
    # Without one a cell turned inside out, which volumes know no way out of, is no obstacle to unfolding.
    points, cells = generate.box((2, 2, 2))
    points[cells[0, 0]] += 3.0
    assert cell_volumes(points, cells).min() < 0.0
    formulation = formulation_of(points, cells, target_volumes=np.ones(len(cells)))
    plain, sized = (formulation.objective(CornerWeights(eps=0.5), volume) for volume in (0.0, 1.0))
    assert np.isfinite(plain.value(points))
    assert sized.value(points) == np.inf


def leaning(*leans):
    """Cells of all types beside each other, of which each leans by some length per height; and their table."""
    points, cells, first = [], [], 0
    for cell_type, lean in zip(CELL_TYPES.values(), leans, strict=True):
        x = cell_type.ideal.copy()
        x[:, 0] += lean * x[:, 2] + 5.0 * len(points)
        nodes = first + np.arange(len(x))[None]
        points.append(x)
        cells.append(collapsed_cells(nodes, cell_type))
        first += len(x)
    return np.concatenate(points), np.concatenate(cells)


def test_what_is_below_the_least_of_its_type_is_the_worst():
    points, cells = leaning(1.5, 0.5, 0.1, 0.3)
    plain = corner_scaled_jacobian(points, cells)
    assert plain.argmin() == 0
    np.testing.assert_array_equal(formulation_of(points, cells).quality(points), plain)
    # The second lost a fifth of what its type had, the last a half; the others are no worse than they were.
    least = plain * [1.0, 1.25, 0.9, 2.0]
    quality = formulation_of(points, cells, least=least).quality(points)
    np.testing.assert_array_equal(quality[[0, 2]], plain[[0, 2]])
    assert quality[3] < quality[1] < plain[0]
    assert quality[[1, 3]] == pytest.approx(plain[0] * np.array([0.8, 0.5]))
    # An inverted cell stays as bad as it is, and the worst.
    turned = points.copy()
    turned[cells[2]] *= [1.0, 1.0, -1.0]
    quality = formulation_of(turned, cells, least=np.full(4, 0.9)).quality(turned)
    assert quality[2] == corner_scaled_jacobian(turned, cells)[2] < 0.0
    assert quality.argmin() == 2


def test_a_type_is_spoiled_where_one_of_its_cells_is_below_its_least():
    points, cells = leaning(1.5, 0.5, 0.1, 0.3)
    plain = corner_scaled_jacobian(points, cells)
    assert not formulation_of(points, cells).spoils_a_type(points)
    for more, spoiled in ((0.0, False), (0.5 * LEVEL, False), (2.0 * LEVEL, True)):
        for k in range(4):
            least = np.where(np.arange(4) == k, plain + more, plain)
            assert formulation_of(points, cells, least=least).spoils_a_type(points) == spoiled
