"""What makes no sense is refused."""

import numpy as np
import pytest
from meshes.surfaces import as_arrays, icosphere

import surface
from hexconformal import MeshError, OptionError
from surface.flow import Flow, Helfrich, MeanCurvature, PWillmore, Stepping, Willmore, evolve


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda m: Flow(m, []), "terms must be one or more"),
        (lambda m: Willmore(m, "length"), "not 'length'"),
        (lambda m: PWillmore(m, 0.5), "p must be at least 1"),
        (lambda m: Helfrich(m, kc=-1), "kc must be positive"),
        (lambda m: evolve(Willmore(m), stall=0.0), "must end the run"),
        (lambda m: evolve(Willmore(m), speed=3), "unknown option 'speed'"),
        (lambda m: Stepping(steps=1, outputs=(0.2, 0.1)), "times that grow"),
        (lambda m: Stepping(steps=1, remesh_below=120), "remesh_below"),
        (lambda m: Stepping(steps=-1), "steps must be 0 or more, not -1"),
        (lambda m: Stepping(steps=1, growth=0.9), r"growth must be at least 1, not 0\.9"),
        (lambda m: Stepping(steps=1, stall=1.0), r"stall must lie in \[0, 1\), not 1\.0"),
        (lambda m: Stepping(steps=1, remesh=-2), "remesh must be a boolean, or every how many steps, not -2"),
    ],
)
def test_what_makes_no_sense_is_refused(make, message):
    with pytest.raises(OptionError, match=message):
        make(as_arrays(icosphere(0)))


def test_open_surfaces_have_no_volume_to_keep():
    square = ([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2, 3]])
    with pytest.raises(OptionError, match="it encloses none"):
        evolve(MeanCurvature(square, "volume"), steps=1)
    with pytest.raises(MeshError):
        evolve(MeanCurvature(([[0, 0, 0], [1, 0, 0], [np.nan, 1, 0]], [[0, 1, 2]])), steps=1)


def test_a_mesh_is_no_flow():
    with pytest.raises(OptionError, match=r"MeanCurvature\(mesh\) or Willmore\(mesh\), not str"):
        surface.evolve("statue.ply", steps=1)
