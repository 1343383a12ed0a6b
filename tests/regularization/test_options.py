"""Options that are refused, and where they are described."""

from dataclasses import fields

import numpy as np
import pytest

import hexconformal as hc
from hexconformal import generate


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"boundary": "glide"}, "boundary must be 'slide', 'fixed' or 'free'"),
        ({"target": "sphere"}, "target must be 'auto', 'cube', 'input' or 'a:b:c'"),
        ({"target": "1:-1:2"}, "three positive edge lengths"),
        ({"target": ["a", "b", "c"]}, "target must be a name, edge lengths or points"),
        ({"target": np.zeros((3, 3))}, "three edge lengths or reference points"),
        ({"fixed": np.ones(3, dtype=bool)}, "fixed"),
        ({"fixed": [10**6]}, "fixed"),
        ({"gradient_tolerance": -1.0}, "gradient_tolerance must lie in"),
        ({"hausdorff": -0.1}, r"in \[0, 1\), not -0.1"),
        ({"hausdorff": float("nan")}, r"in \[0, 1\), not nan"),
        ({"hausdorff": 1.0}, r"in \[0, 1\), not 1.0"),
        ({"features": "hard"}, "features must be 'auto', 'keep' or 'soft'"),
        ({"max_iterations": -1}, "max_iterations must be 0 or more"),
        ({"boundary": "free", "energy": "quaternionic"}, "shrinks the mesh to a point"),
        ({"emphasis": "worst", "energy": "quaternionic"}, "blind to orientation"),
        ({"speed": 3}, "unknown option 'speed'; there are: boundary"),
    ],
)
def test_options_that_make_no_sense_are_refused(options, words):
    with pytest.raises(hc.OptionError, match=words):
        hc.regularize(generate.box((2, 2, 2)), **options)


def test_the_docstring_names_every_option():
    named = hc.regularize.__doc__.split("**options")[1].split("Returns")[0]
    assert [field.name for field in fields(hc.Options) if f"`{field.name}`" not in named] == []
