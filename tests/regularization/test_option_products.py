"""Every option with every other, on a mesh with a curved boundary: refused with its reason, or a result as promised."""

from itertools import product

import numpy as np
import pytest

import hexconformal as hc
from hexconformal import generate

MESH = generate.jittered(*generate.cylinder(2, 1, 2), 0.3, seed=1)
BEFORE = hc.quality(MESH)
SIZES = {"input": "input", "free": "free", "given": 1.1 * BEFORE.volume}


def contradiction(energy, emphasis, sizes):
    """Pattern of the message if the options contradict each other, which names them; None if they do not."""
    if energy == "quaternionic" and sizes == "given":
        return "sizes .* must go with energy='barrier'"
    if energy == "quaternionic" and emphasis == "worst":
        return "emphasis='worst' must go with energy='barrier'"
    return None


@pytest.mark.long
@pytest.mark.parametrize("method", ["auto", "lbfgs", "newton", "majorize"])
@pytest.mark.parametrize("quadrature", ["gauss", "corners"])
@pytest.mark.parametrize("energy", ["barrier", "quaternionic"])
def test_a_result_is_valid_within_its_bound_and_no_worse_than_the_input(energy, quadrature, method):
    for weight, emphasis, sizes in product(("reference", "volume"), ("worst", "mean"), SIZES):
        options = {"energy": energy, "quadrature": quadrature, "method": method, "weight": weight}
        options |= {"emphasis": emphasis, "sizes": SIZES[sizes], "max_iterations": 8}
        refused = contradiction(energy, emphasis, sizes)
        if refused is not None:
            with pytest.raises(hc.OptionError, match=refused):
                hc.regularize(MESH, **options)
            continue
        result = hc.regularize(MESH, **options)
        report, what = result.report, (weight, emphasis, sizes)
        assert report.after.invalid == report.after.inverted == 0, what
        assert 0.0 < report.hausdorff <= report.hausdorff_bound == 0.005, what
        assert report.energy_after < report.energy_before, what
        assert report.boundary_moved > 0, what
        # The quaternionic energy is blind to orientation: it promises no more than to be lower.
        if energy == "barrier":
            assert report.after.scaled_jacobian.min >= BEFORE.scaled_jacobian.min() - 1e-6, what
            assert report.after.scaled_jacobian.mean > BEFORE.scaled_jacobian.mean(), what
        assert np.isfinite([record.energy for record in result.history]).all(), what
