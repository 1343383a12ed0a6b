"""Masks given as booleans or ids."""

import numpy as np
import pytest

from hexconformal.common.errors import OptionError
from hexconformal.common.validation import as_mask


def test_masks():
    assert as_mask(None, 3, "fixed").tolist() == [False] * 3
    assert as_mask([], 3, "fixed").tolist() == [False] * 3
    assert as_mask([2, 0], 3, "fixed").tolist() == [True, False, True]
    assert as_mask(np.array([1], np.uint8), 3, "fixed").tolist() == [False, True, False]
    given = np.array([True, False, True])
    result = as_mask(given, 3, "fixed")
    result[:] = False
    assert given.tolist() == [True, False, True]
    assert as_mask(np.eye(3, dtype=bool)[:2], 2, "fixed").shape == (2, 3)


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (np.zeros(4, bool), r"shape \(5,\)"),
        (np.zeros((5, 2), bool), r"shape \(5,\)"),
        ([5], r"ids in 0\.\.4; outside: 1 \(ids 5\)"),
        ([-1], "outside"),
        ([0.5], "point ids"),
        (["a"], "point ids"),
        ([[1, 2]], "point ids"),
        ([0, 1, 1, 0, 1], "zeros and ones"),
    ],
)
def test_bad_masks(value, text):
    with pytest.raises(OptionError, match=text):
        as_mask(value, 5, "fixed")
