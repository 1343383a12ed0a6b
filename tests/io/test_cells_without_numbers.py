"""Cells whose nodes are no numbers, as in damaged files of text."""

import meshio
import numpy as np
import pytest

import hexconformal as hc
from hexconformal.generate import box
from hexconformal.io import as_hex_mesh


@pytest.mark.parametrize("value", [np.nan, np.inf, 1e300])
def test_nodes_that_are_no_numbers_are_refused_without_a_warning(value, recwarn):
    points, cells = box((2, 1, 1))
    nodes = cells.astype(float)
    nodes[1, 3] = value
    mesh = meshio.Mesh(points, [("hexahedron", nodes)])
    with pytest.raises(hc.MeshError, match=r"nodes that are numbers; others: 1 \(ids 1\)"):
        as_hex_mesh(mesh)
    assert not recwarn.list
