"""The example of a mesh of DOLFINx that follows its boundary."""

import importlib.util

import pytest
from paths import ROOT


def test_the_equation_is_solved_as_well_when_the_plate_is_back():
    pytest.importorskip("dolfinx")
    specification = importlib.util.spec_from_file_location("moving_dolfinx", ROOT / "examples" / "moving_dolfinx.py")
    example = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(example)
    rows = example.run(cells=4, steps=4)
    heights, worst, volumes, errors = zip(*rows, strict=True)
    assert max(heights) == pytest.approx(1 / 3)
    # At rest the elements of a cube are exact at their nodes; the nodes come back to where they were.
    assert (worst[-1], volumes[-1], errors[-1]) == pytest.approx((1.0, 1.0, errors[0]), abs=1e-8)
    # What the plate takes is the integral of its bilinear faces, by the trapezoidal rule along either axis.
    along = (2 * 0.5**0.5 + 1) / 4
    assert volumes[2] == pytest.approx(1 - along**2 / 3, abs=1e-12)
    assert max(errors) < 0.005
