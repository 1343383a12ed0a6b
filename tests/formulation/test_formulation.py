"""What objectives are put together from."""

import numpy as np
from corner_problems import formulation_of

from hexconformal import generate
from hexconformal.elements import cell_volumes
from hexconformal.energy import CornerWeights


def test_volumes_count_only_where_they_have_a_weight():
    # Without one a cell turned inside out, which volumes know no way out of, is no obstacle to unfolding.
    points, cells = generate.box((2, 2, 2))
    points[cells[0, 0]] += 3.0
    assert cell_volumes(points, cells).min() < 0.0
    formulation = formulation_of(points, cells, target_volumes=np.ones(len(cells)))
    plain, sized = (formulation.objective(CornerWeights(eps=0.5), volume) for volume in (0.0, 1.0))
    assert np.isfinite(plain.value(points))
    assert sized.value(points) == np.inf
