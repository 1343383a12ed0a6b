"""The distance barrier on ranks is the one of one process, wherever its samples go."""

import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).with_name("programs")))
from barrier import TURNS, in_one_process

one = cache(in_one_process)


@pytest.mark.parametrize("ranks", [1, 3, 4])
def test_values_and_gradients_are_those_of_one_process(results, ranks):
    found = results("barrier", ranks)
    np.testing.assert_allclose(found["values"], one()["values"], rtol=1e-9)
    assert np.isfinite(found["values"][:TURNS]).all()
    for number in range(TURNS):
        expected = one()[f"gradient {number}"]
        np.testing.assert_allclose(found[f"gradient {number}"], expected, rtol=0, atol=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("ranks", [1, 3, 4])
def test_walls_distances_and_samples_are_those_of_one_process(results, ranks):
    found = results("barrier", ranks)
    np.testing.assert_allclose(found["walls"], one()["walls"], rtol=1e-9)
    assert found["walls"][TURNS, 0] > 1.0  # outside
    np.testing.assert_allclose(found["distances"], one()["distances"], rtol=1e-9)
    assert np.array_equal(found["samples"], one()["samples"])
    assert np.array_equal(found["beyond"], one()["beyond"])
    assert found["beyond"].any()
