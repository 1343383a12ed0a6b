"""The container: arrays of any layout are taken, and nothing handed in is changed."""

import numpy as np
import pytest
from meshes.hexahedra import block

from hexconformal import HexMesh, as_hex_mesh
from hexconformal.common.errors import MeshError, OptionError


@pytest.mark.parametrize("how", ["float32", "readonly", "fortran", "strided", "lists"])
def test_any_layout_is_accepted_and_never_changed(how):
    points, cells = block(2)
    p, c = {
        "float32": lambda: (points.astype(np.float32), cells.astype(np.int32)),
        "readonly": lambda: (points.copy(), cells.copy()),
        "fortran": lambda: (np.asfortranarray(points), np.asfortranarray(cells)),
        "strided": lambda: (np.repeat(points, 2, axis=0)[::2], np.repeat(cells, 2, axis=1)[:, ::2]),
        "lists": lambda: (points.tolist(), cells.tolist()),
    }[how]()
    if how == "readonly":
        p.flags.writeable = c.flags.writeable = False
    before = repr((p, c))
    mesh = as_hex_mesh((p, c))
    assert mesh.points.dtype == np.float64
    assert mesh.cells.dtype == np.int64
    assert not mesh.points.flags.writeable
    assert mesh.points.flags.c_contiguous
    np.testing.assert_array_equal(mesh.points, points)
    np.testing.assert_array_equal(mesh.cells, cells)
    assert how == "readonly" or not np.shares_memory(mesh.points, p)
    result = mesh.to_source_type()
    result[0][:] = 0
    assert repr((p, c)) == before
    assert mesh.points.max() == 2


@pytest.mark.parametrize(
    ("points", "cells", "text"),
    [
        (np.zeros((8, 2)), [range(8)], r"\(n, 3\)"),
        (np.zeros((8, 3)), np.zeros((0, 8), int), "no hexahedra"),
        (np.zeros((8, 3)), [range(4)], r"\(m, 8\)"),
        (np.zeros((8, 3)), [[0.5] * 8], "integer"),
        (np.zeros((8, 3)), [[np.nan] * 8], "integer"),
        (np.zeros((8, 3), complex), [range(8)], "real"),
        ("abc", [range(8)], "points"),
        (np.zeros((8, 3)), [[0, 1], [2]], "cells"),
    ],
)
def test_nonsense_arrays_are_refused(points, cells, text):
    with pytest.raises(MeshError, match=text):
        as_hex_mesh((points, cells))


def test_bad_arguments_are_refused():
    mesh = HexMesh(*block(1))
    with pytest.raises(MeshError, match="first axis 8"):
        mesh.replaced(point_data={"a": np.zeros(7)})
    with pytest.raises(MeshError, match="first axis 1"):
        mesh.replaced(cell_data={"a": np.zeros(8)})
    with pytest.raises(MeshError, match="7 points"):
        mesh.replaced(points=np.zeros((7, 3)))
    with pytest.raises(OptionError, match="other_cells"):
        as_hex_mesh(mesh, other_cells="drop")
    with pytest.raises(OptionError, match="cannot make a mesh of int"):
        as_hex_mesh(3)
    assert as_hex_mesh(mesh) is mesh
