"""Cells whose nodes are no numbers, as in damaged files of text."""

import meshio
import numpy as np
import pytest

import hexconformal as hc
import surface
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


@pytest.mark.parametrize("value", ["nan", "1e300", "-inf"])
def test_faces_of_a_ply_without_numbers_are_refused_without_a_warning(value, tmp_path, recwarn):
    lines = ["ply", "format ascii 1.0", "element vertex 3", *(f"property float {axis}" for axis in "xyz")]
    lines += ["element face 1", "property list uchar int vertex_indices", "end_header", "0 0 0", "1 0 0", "0 1 0"]
    path = tmp_path / "face.ply"
    path.write_text("\n".join([*lines, f"3 0 1 {value}", ""]))
    with pytest.raises(hc.MeshError, match="numbers of points"):
        surface.read(path)
    assert not recwarn.list
