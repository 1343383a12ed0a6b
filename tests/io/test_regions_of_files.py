"""The same model has the same regions in every format."""

import meshio
import numpy as np
import pytest
from meshes.hexahedra import wavy_layers

import hexconformal as hc
from hexconformal import generate
from hexconformal.mesh import find_regions

POINTS, CELLS = generate.box((4, 2, 2))
STEEL = POINTS[CELLS].mean(axis=1)[:, 0] < 0.5
SETS = {"STEEL": [np.flatnonzero(STEEL)], "RUBBER": [np.flatnonzero(~STEEL)]}


def partition_of(path):
    """Centres of the cells of each region of a file."""
    mesh = hc.read(path)
    regions, centres = find_regions(mesh), mesh.points[mesh.cells].mean(axis=1).round(6)
    assert regions is not None
    return {frozenset(map(tuple, centres[regions.labels == k])) for k in range(len(regions.names))}, regions


WHERE = POINTS[CELLS].mean(axis=1).round(6)
EXPECTED = {frozenset(map(tuple, WHERE[STEEL])), frozenset(map(tuple, WHERE[~STEEL]))}


@pytest.mark.parametrize("name", ["gmsh:physical", "material"])
@pytest.mark.parametrize("extension", [".vtu", ".vtk", ".msh", ".exo", ".med", ".bdf", ".mesh", ".xdmf"])
def test_a_box_of_two_materials_has_the_same_regions_in_every_format(tmp_path, extension, name):
    if (extension, name) == (".bdf", "material"):
        pytest.skip("property numbers are written from tags")
    path = tmp_path / f"box{extension}"
    hc.write(path, hc.HexMesh(POINTS, CELLS, cell_data={name: np.where(STEEL, 5, 2)}))
    assert partition_of(path)[0] == EXPECTED


@pytest.mark.parametrize("extension", [".inp", ".exo"])
def test_so_it_has_in_formats_with_sets(tmp_path, extension):
    path = tmp_path / f"box{extension}"
    hc.write(path, meshio.Mesh(POINTS, [("hexahedron", CELLS)], cell_sets=SETS))
    found, regions = partition_of(path)
    assert found == EXPECTED
    assert sorted(regions.names) == ["RUBBER", "STEEL"]


def test_names_of_physical_groups_are_those_of_the_regions(tmp_path):
    groups = {"steel": np.array([5, 3]), "skin": np.array([2, 2]), "rubber": np.array([2, 3])}
    tags = {"gmsh:physical": [np.where(STEEL, 5, 2)], "gmsh:geometrical": [np.where(STEEL, 5, 2)]}
    hc.write(tmp_path / "a.msh", meshio.Mesh(POINTS, [("hexahedron", CELLS)], cell_data=tags, field_data=groups))
    found, regions = partition_of(tmp_path / "a.msh")
    assert found == EXPECTED
    assert regions.names == ("rubber", "steel")


def deck(path, more):
    """A deck with sets for output besides those of the materials, and more statements."""
    sets = {**SETS, "PROBES": [np.arange(3, 12)], "TIP": [np.array([15])]}
    hc.write(path, meshio.Mesh(POINTS, [("hexahedron", CELLS)], cell_sets=sets))
    path.write_text(path.read_text() + more)
    return path


def test_sets_of_elements_that_sections_name_are_the_regions_of_a_deck(tmp_path):
    # Names differ in case, as CalculiX and Abaqus allow.
    sections = "*SOLID SECTION, ELSET=steel, MATERIAL=IRON\n*Solid Section, material=R, elset=Rubber\n1.,\n"
    found, regions = partition_of(deck(tmp_path / "a.inp", sections))
    assert found == EXPECTED
    assert regions.names == ("STEEL", "RUBBER")
    assert regions.source == "sections"
    # Without them nothing tells materials from selections.
    assert len(partition_of(deck(tmp_path / "b.inp", ""))[0]) == 4


def test_beside_a_section_of_everything_other_sets_are_selections(tmp_path):
    more = "*ELSET, ELSET=ALL, GENERATE\n1, 16\n*SOLID SECTION, ELSET=ALL, MATERIAL=IRON\n"
    mesh = hc.read(deck(tmp_path / "a.inp", more))
    assert find_regions(mesh) is None
    assert find_regions(mesh.replaced(cell_data={"material": STEEL})) is not None


def test_a_part_in_two_places_is_two_regions(tmp_path):
    path = deck(tmp_path / "a.inp", "*SOLID SECTION, ELSET=WHOLE, MATERIAL=IRON\n")
    mesh, section = (
        path.read_text().split("*NSET")[0].split("*ELSET")[0],
        "*SOLID SECTION, ELSET=WHOLE, MATERIAL=IRON\n",
    )
    whole = "*ELSET, ELSET=WHOLE, GENERATE\n1, 16\n"
    part = mesh.replace("*HEADING\n", "*HEADING\n*PART, NAME=BRICK\n") + whole + section + "*END PART\n"
    places = (
        "*INSTANCE, NAME=ONE, PART=BRICK\n*END INSTANCE\n*INSTANCE, NAME=TWO, PART=BRICK\n2., 0., 0.\n*END INSTANCE\n"
    )
    path.write_text(part + "*ASSEMBLY, NAME=A\n" + places + "*END ASSEMBLY\n")
    found = find_regions(hc.read(path))
    assert found.names == ("ONE.WHOLE", "TWO.WHOLE")
    np.testing.assert_array_equal(found.labels, np.repeat([0, 1], 16))


def test_the_same_model_comes_to_the_same_points_in_every_format(tmp_path):
    mesh = wavy_layers(4)
    layer = mesh.cell_data["material"]
    result = hc.regularize(mesh)
    assert result.report.largest_displacement > 0.01
    tagged = hc.HexMesh(mesh.points, mesh.cells, cell_data={"gmsh:physical": layer + 2})
    paths = [tmp_path / f"model{extension}" for extension in (".vtu", ".msh", ".exo", ".med", ".bdf")]
    for path in paths:
        hc.write(path, tagged)
    sets = {name: [np.flatnonzero(layer == k)] for k, name in enumerate(("LOWER", "UPPER"))}
    paths.append(tmp_path / "model.inp")
    hc.write(paths[-1], meshio.Mesh(mesh.points, [("hexahedron", mesh.cells)], cell_sets=sets))
    for path in paths:
        read = hc.read(path)
        # Formats may write cells in another order, and numbers with fewer digits.
        np.testing.assert_allclose(read.points, mesh.points, atol=1e-15)
        found = hc.regularize(path)
        np.testing.assert_allclose(found.points, result.points, atol=1e-12)
        assert len(found.report.regions) == 2


def test_what_else_a_file_has_beside_names_of_groups_is_no_obstacle():
    fields = {"med:nom": [[], ["T"]], "steel": np.array([5, 3]), "note": "two", "rubber": [2, 3]}
    tags = {"gmsh:physical": [np.where(STEEL, 5, 2)]}
    mesh = hc.as_hex_mesh(meshio.Mesh(POINTS, [("hexahedron", CELLS)], cell_data=tags, field_data=fields))
    assert find_regions(mesh).names == ("rubber", "steel")


def of_families():
    """The box with families of cells as MED has them: negative numbers, by name."""
    mesh = meshio.Mesh(POINTS, [("hexahedron", CELLS)], cell_data={"cell_tags": [np.where(STEEL, -1, -2)]})
    mesh.cell_tags = {-1: ["steel"], -2: ["rubber"]}
    return mesh


@pytest.mark.parametrize("extension", [".msh", ".inp"])
def test_families_of_med_are_groups_or_sets_in_other_formats(tmp_path, extension):
    first, second = tmp_path / "a.med", tmp_path / f"b{extension}"
    pytest.importorskip("h5py")
    hc.write(first, of_families())
    lost = hc.write(second, hc.read(first))
    found, regions = partition_of(second)
    assert found == EXPECTED
    assert sorted(regions.names) == ["rubber", "steel"]
    assert any(text.startswith("the numbers of") and "kept as" in text for text in lost)
    assert not any("steel" in text for text in lost)


@pytest.mark.parametrize("first", [".bdf", ".msh", ".mesh", ".xdmf"])
def test_tags_are_sets_in_decks(tmp_path, first):
    hc.write(tmp_path / f"a{first}", hc.HexMesh(POINTS, CELLS, cell_data={"gmsh:physical": np.where(STEEL, 5, 2)}))
    hc.write(tmp_path / "b.inp", hc.read(tmp_path / f"a{first}"))
    found, regions = partition_of(tmp_path / "b.inp")
    assert found == EXPECTED
    assert sorted(name[-2:] for name in regions.names) == ["_2", "_5"]


def test_of_several_arrays_of_tags_decks_tell_which_is_lost(tmp_path):
    tags = {"gmsh:physical": np.where(STEEL, 5, 2), "medit:ref": np.arange(len(CELLS))}
    lost = hc.write(tmp_path / "b.inp", hc.HexMesh(POINTS, CELLS, cell_data=tags))
    assert lost == ["cell array 'medit:ref'", "the numbers of cell array 'gmsh:physical' (kept as sets)"]
