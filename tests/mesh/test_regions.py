"""Regions of a mesh, from arrays and sets, and the faces between them."""

import meshio
import numpy as np
import pytest

import hexconformal as hc
from hexconformal import generate
from hexconformal.io import as_hex_mesh
from hexconformal.mesh import find_regions, interface_quads

POINTS, CELLS = generate.box((4, 2, 2))
LEFT = POINTS[CELLS].mean(axis=1)[:, 0] < 0.5
NUMBERS = np.where(LEFT, 5, 2)


def mesh(**arrays):
    return hc.HexMesh(POINTS, CELLS, cell_data=arrays)


@pytest.mark.parametrize("name", ["material", "MaterialIds", "Region", "part", "gmsh:physical", "medit:ref"])
@pytest.mark.parametrize("kind", [int, float, np.uint8])
def test_arrays_with_names_of_regions_tell_them_apart(name, kind):
    regions = find_regions(mesh(**{name: NUMBERS.astype(kind)}))
    np.testing.assert_array_equal(regions.labels == 1, LEFT)
    assert regions.names == ("2", "5")
    assert regions.source == f"array {name!r}"


@pytest.mark.parametrize(
    "arrays",
    [
        {},
        {"temperature": NUMBERS},
        {"material": np.ones(len(CELLS), int)},
        {"material": np.linspace(0.0, 1.0, len(CELLS))},
        {"part": np.arange(len(CELLS))},
        {"material": np.stack([NUMBERS, NUMBERS], axis=1)},
    ],
)
def test_other_arrays_do_not(arrays):
    assert find_regions(mesh(**arrays)) is None


def test_an_array_may_be_named_or_given_or_everything_ignored():
    assert find_regions(mesh(material=NUMBERS), "ignore") is None
    np.testing.assert_array_equal(find_regions(mesh(layer=NUMBERS), "layer").labels == 1, LEFT)
    np.testing.assert_array_equal(find_regions(mesh(), NUMBERS).labels == 1, LEFT)
    with pytest.raises(hc.OptionError, match="not 'phase'; there are: layer"):
        find_regions(mesh(layer=NUMBERS), "phase")
    for wrong in (NUMBERS[:3], NUMBERS + 0.5, LEFT.astype(str)):
        with pytest.raises(
            hc.OptionError, match=r"interfaces must be (one integer for each of the 16 cells|a name or integers)"
        ):
            find_regions(mesh(), wrong)


def sets(**parts):
    block = [("hexahedron", CELLS)]
    return as_hex_mesh(meshio.Mesh(POINTS, block, cell_sets={name: [rows] for name, rows in parts.items()}))


def test_sets_of_cells_that_do_not_overlap_are_regions_and_the_rest_is_one():
    rows = np.arange(len(CELLS))
    regions = find_regions(sets(steel=rows[:4], all=rows, rubber=rows[4:9]))
    assert regions.names == ("steel", "rubber", "the rest")
    np.testing.assert_array_equal(regions.labels, np.repeat([0, 1, 2], [4, 5, 7]))
    assert find_regions(sets(one=rows[:9], other=rows[5:])) is None
    assert find_regions(sets(all=rows)) is None


def test_faces_between_regions():
    quads, pairs = interface_quads(CELLS, NUMBERS)
    assert len(quads) == 4
    assert (POINTS[quads][..., 0] == 0.5).all()
    assert (pairs == pairs[0]).all()
    assert len(interface_quads(CELLS, np.zeros(len(CELLS), int))[0]) == 0


def test_pairs_of_regions_are_told_apart_whichever_comes_first():
    points, cells = generate.box((4, 1, 1))
    quads, pairs = interface_quads(cells, np.array([0, 1, 0, 2]))
    where = points[quads][:, 0, 0]
    np.testing.assert_array_equal(where, [0.25, 0.5, 0.75])
    assert pairs[0] == pairs[1] != pairs[2]
