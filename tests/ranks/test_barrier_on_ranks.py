"""The distance barrier on ranks is the one of one process, wherever its samples go."""

import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).with_name("programs")))
from barrier import MESHES, TURNS, in_one_process

one = cache(in_one_process)


def of_mesh(name, results, ranks):
    """What ranks found of a mesh, and what one process finds."""
    found = results("barrier", ranks)
    return {key: found[f"{name}: {key}"] for key in one(name)}, one(name)


@pytest.mark.parametrize("ranks", [1, 3, 4])
@pytest.mark.parametrize("name", MESHES)
def test_values_and_gradients_are_those_of_one_process(results, name, ranks):
    found, known = of_mesh(name, results, ranks)
    np.testing.assert_allclose(found["values"], known["values"], rtol=1e-9)
    assert np.isfinite(found["values"][:TURNS]).all()
    for number in range(TURNS):
        expected = known[f"gradient {number}"]
        np.testing.assert_allclose(found[f"gradient {number}"], expected, rtol=0, atol=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("ranks", [1, 3, 4])
@pytest.mark.parametrize("name", MESHES)
def test_walls_distances_and_samples_are_those_of_one_process(results, name, ranks):
    found, known = of_mesh(name, results, ranks)
    np.testing.assert_allclose(found["walls"], known["walls"], rtol=1e-9)
    assert found["walls"][TURNS, 0] > 1.0  # outside
    np.testing.assert_allclose(found["distances"], known["distances"], rtol=1e-9)
    assert np.array_equal(found["samples"], known["samples"])
    assert np.array_equal(found["beyond"], known["beyond"])
    assert found["beyond"].any()
