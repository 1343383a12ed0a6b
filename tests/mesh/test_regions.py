"""Regions of a mesh, from arrays and sets, and the faces between them."""

import meshio
import numpy as np
import pytest

import hexconformal as hc
from hexconformal import generate
from hexconformal.geometry import enclosed_volume
from hexconformal.io import as_hex_mesh
from hexconformal.mesh import boundary_quads, curves_of, find_interfaces, find_regions, region_surfaces

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


def test_numbers_of_regions_are_told_in_full():
    assert find_regions(mesh(material=np.where(LEFT, 12345678, 2))).names == ("2", "12345678")
    assert find_regions(mesh(material=np.where(LEFT, np.inf, 2.0))).names == ("2", "inf")
    assert find_regions(mesh(material=np.where(LEFT, np.nan, 2.0))) is None


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
    assert find_regions(sets(all=rows)) is None


def test_sets_that_overlap_are_refined():
    rows = np.arange(len(CELLS))
    regions = find_regions(sets(steel=rows[:9], heated=rows[5:12]))
    assert regions.names == ("steel & heated", "steel", "heated", "the rest")
    np.testing.assert_array_equal(regions.labels, np.repeat([1, 0, 2, 3], [5, 4, 3, 4]))
    assert regions.source == "sets of cells"


def test_more_sets_than_a_code_has_bits_are_refined_like_few():
    """100 nested sets of a bar tell 101 layers apart."""
    points, cells = generate.box((101, 3, 1))
    layer = np.rint(points[cells].mean(axis=1)[:, 0] * 101 - 0.5).astype(int)
    nested = {f"up to {k}": [np.flatnonzero(layer < k)] for k in range(1, 101)}
    regions = find_regions(as_hex_mesh(meshio.Mesh(points, [("hexahedron", cells)], cell_sets=nested)))
    assert len(regions.names) == 101
    np.testing.assert_array_equal(regions.labels, layer)


def test_sets_that_pick_single_cells_tell_no_regions_apart():
    rows = np.arange(len(CELLS))
    each = {f"output {k}": rows[k : k + 1] for k in rows}
    assert find_regions(sets(**each)) is None
    assert find_regions(sets(probe=rows[3:4])) is None
    assert find_regions(sets(**each, steel=rows[:9])).names == ("steel", "the rest")
    # Sets that share all cells out are materials, however small.
    assert find_regions(sets(steel=rows[1:], rubber=rows[:1])).names == ("steel", "rubber")


def test_faces_between_regions():
    quads = find_interfaces(CELLS, NUMBERS).quads
    assert len(quads) == 4
    assert (POINTS[quads][..., 0] == 0.5).all()
    assert len(find_interfaces(CELLS, np.zeros(len(CELLS), int)).quads) == 0


GRAINS = np.random.default_rng(3).integers(0, 5, 60)


@pytest.fixture(scope="module")
def grains():
    """A box of cells that belong to five grains at random, moved so that no face is flat."""
    points, cells = generate.jittered(*generate.box((5, 4, 3)), 0.3, seed=5, keep_boundary=False)
    return points, cells, find_interfaces(cells, GRAINS)


def test_every_interface_lies_between_its_two_regions_and_looks_out_of_the_first(grains):
    points, cells, interfaces = grains
    expected = {}
    for one in range(len(cells)):
        for other in range(one):
            common = frozenset(cells[one]) & frozenset(cells[other])
            if len(common) == 4 and GRAINS[one] != GRAINS[other]:
                pair = tuple(sorted((GRAINS[one], GRAINS[other])))
                expected.setdefault(pair, set()).add(common)
    found = zip(map(tuple, interfaces.pairs.tolist()), interfaces.parts(), strict=True)
    assert {pair: {frozenset(quad) for quad in quads.tolist()} for pair, quads in found} == expected
    assert interfaces.counts.sum() == len(interfaces.quads) == sum(len(common) for common in expected.values())
    for pair, quads in zip(interfaces.pairs, interfaces.parts(), strict=True):
        for quad in quads:
            inside = next(k for k in np.flatnonzero(pair[0] == GRAINS) if np.isin(quad, cells[k]).all())
            x = points[quad]
            outward = x.mean(axis=0) - points[cells[inside]].mean(axis=0)
            assert np.cross(x[2] - x[0], x[3] - x[1]) @ outward > 0


def test_the_surface_of_every_region_encloses_its_cells(grains):
    points, cells, _ = grains
    volumes = hc.quality((points, cells)).volume
    for region, quads in enumerate(region_surfaces(cells, GRAINS)):
        assert enclosed_volume(points, quads) == pytest.approx(volumes[region == GRAINS].sum(), rel=1e-12)
    whole = region_surfaces(cells, np.zeros(len(cells), int))
    np.testing.assert_array_equal(whole, [boundary_quads(cells)[0]])


def test_curves_where_three_regions_meet():
    points, cells = generate.box((2, 2, 4))
    x, y, _ = points[cells].mean(axis=1).T
    interfaces = find_interfaces(cells, np.where(x < 0.5, 0, np.where(y < 0.5, 1, 2)))
    edges = interfaces.junction_edges()
    assert len(edges) == 4
    assert (points[edges][..., :2] == 0.5).all()
    count, ends = curves_of(edges)
    assert count == 1
    assert sorted(points[ends, 2]) == [0, 1]
    # Two regions that touch along an edge only have no such curve: the faces around it lie between the same two.
    assert len(find_interfaces(cells, np.where((x < 0.5) == (y < 0.5), 0, 1)).junction_edges()) == 0
    ring = np.array([[0, 1], [1, 2], [2, 0]])
    assert curves_of(ring)[0] == 1
    assert curves_of(ring[:0])[0] == 0
