"""Lines between the regions of a surface are kept by remeshing."""

import numpy as np
import pytest
import pyvista as pv
from meshes.surfaces import as_arrays, icosphere, mixed_sphere, quad_sphere, shaken
from program import run

import surface
from hexconformal import OptionError
from surface.constraint import find_interfaces
from surface.io import from_vtk, to_vtk
from surface.mesh import SurfaceMesh

SPHERES = {
    "triangles": lambda: shaken(icosphere(3), 0.02),
    "quads": lambda: shaken(quad_sphere(8), 0.02),
    "both": lambda: shaken(mixed_sphere(8), 0.02),
}


def two_patches(shape):
    """A sphere of two patches that meet in a wavy line."""
    points, cells = shape
    centre = cells.centres(points)
    wave = 0.2 * np.sin(3 * np.arctan2(centre[:, 1], centre[:, 0]))
    return SurfaceMesh(points, cells, cell_data={"material": np.where(centre[:, 2] > wave, 3, 7)})


def line_of(mesh):
    """Edges between cells with other values, found one by one."""
    seen = {}
    cells = mesh.cells.triangles.tolist() + mesh.cells.quads.tolist()
    for cell, tag in zip(cells, tags(mesh), strict=True):
        for a, b in zip(cell, cell[1:] + cell[:1], strict=True):
            seen.setdefault((min(a, b), max(a, b)), set()).add(tag)
    return np.array([edge for edge, found in sorted(seen.items()) if len(found) > 1])


def tags(mesh):
    return mesh.cell_data["material"].tolist()


def distance_of_lines(one, other, edges):
    """Largest distance of two positions of a line, both ways, at 21 places on every edge."""

    def one_way(x, y):
        share = np.linspace(0, 1, 21)[:, None, None]
        places = ((1 - share) * x[edges[:, 0]] + share * x[edges[:, 1]]).reshape(-1, 1, 3)
        start, along = y[edges[:, 0]], y[edges[:, 1]] - y[edges[:, 0]]
        at = (((places - start) * along).sum(axis=2) / (along**2).sum(axis=1)).clip(0, 1)
        return np.linalg.norm(places - start - at[:, :, None] * along, axis=2).min(axis=1).max()

    return max(one_way(one, other), one_way(other, one))


def areas_of_patches(points, mesh):
    measured = surface.quality(mesh.replaced(points)).area
    return np.array([measured[mesh.cell_data["material"] == tag].sum() for tag in (3, 7)])


@pytest.mark.long
@pytest.mark.parametrize("shape", SPHERES)
def test_a_line_on_a_sphere_stays_within_the_bound_and_its_nodes_slide(shape):
    mesh = two_patches(SPHERES[shape]())
    edges, before = line_of(mesh), mesh.points
    bound = 0.01 * np.linalg.norm(np.ptp(before, axis=0))
    result = surface.remesh(mesh)
    after = result.points
    assert distance_of_lines(after, before, edges) < bound
    assert distance_of_lines(surface.remesh(mesh, interfaces="ignore").points, before, edges) > bound
    moved = np.linalg.norm(after - before, axis=1)[np.unique(edges)]
    assert np.median(moved) > 0.2 * bound
    length = np.linalg.norm(before[edges[:, 0]] - before[edges[:, 1]], axis=1).sum()
    assert np.abs(areas_of_patches(after, mesh) - areas_of_patches(before, mesh)).max() < bound * length
    assert result.report.hausdorff <= 0.01
    assert result.report.turned == 0
    assert result.report.after.mean_angle > result.report.before.mean_angle + 5
    note = f"interfaces: 2 regions (array 'material': 3, 7), {len(edges)} edges between them are kept: nodes slide"
    assert any(text.startswith(note) for text in result.report.notes)


def test_every_cell_stays_on_its_side():
    mesh = two_patches(SPHERES["triangles"]())
    edges = line_of(mesh)
    moved = surface.remesh(mesh).points
    centres = mesh.cells.centres(moved)
    old = pv.PolyData.from_regular_faces(mesh.points, mesh.cells.triangles)
    below = mesh.cell_data["material"][old.find_closest_cell(centres)]
    nodes = mesh.points[np.unique(edges)]
    near = np.linalg.norm(centres[:, None] - nodes, axis=2).min(axis=1) < 0.1
    assert 50 < near.sum() < len(near) / 2
    np.testing.assert_array_equal(below[~near], mesh.cell_data["material"][~near])
    assert (below[near] == mesh.cell_data["material"][near]).mean() > 0.98


def test_where_three_regions_meet_the_node_stays():
    points, cells = shaken(icosphere(3), 0.02)
    axis = points[0]
    frame = np.linalg.svd(axis[None])[2][1:]
    angle = np.arctan2(*(cells.centres(points) @ frame.T).T)
    mesh = SurfaceMesh(points, cells, cell_data={"tag": np.digitize(angle, [-2.0, 0.5])})
    result = surface.remesh(mesh)
    assert np.array_equal(result.points[0], points[0])
    assert not np.array_equal(surface.remesh(mesh, interfaces="ignore").points[0], points[0])
    assert "3 regions (array 'tag': 0, 1, 2)" in "".join(result.report.notes)


def test_without_regions_or_where_they_are_ignored_nothing_is_kept():
    mesh = two_patches(SPHERES["both"]())
    plain = surface.remesh(as_arrays((mesh.points, mesh.cells)))
    ignored = surface.remesh(mesh, interfaces="ignore")
    np.testing.assert_array_equal(ignored.points, plain.points)
    whole = SurfaceMesh(mesh.points, mesh.cells, cell_data={"material": np.ones(len(mesh.cells), int)})
    np.testing.assert_array_equal(surface.remesh(whole).points, plain.points)
    for result in (plain, ignored):
        assert not any("interfaces" in note for note in result.report.notes)


def test_an_array_may_be_named_or_given():
    mesh = two_patches(SPHERES["triangles"]())
    tag = mesh.cell_data["material"]
    expected = surface.remesh(mesh, max_iterations=3).points
    plain = SurfaceMesh(mesh.points, mesh.cells, cell_data={"colour": tag})
    for interfaces in ("colour", tag, tag.astype(float)):
        given = surface.remesh(plain, max_iterations=3, interfaces=interfaces)
        np.testing.assert_array_equal(given.points, expected)
    with pytest.raises(OptionError, match="interfaces must be 'auto', 'ignore' or an array on cells, not 'phase'"):
        surface.remesh(plain, interfaces="phase")
    with pytest.raises(OptionError, match="interfaces must be one integer for each of the 1280 cells"):
        surface.remesh(plain, interfaces=tag[:3])


def test_without_projection_a_line_that_strays_is_told():
    mesh = two_patches(SPHERES["triangles"]())
    report = surface.remesh(mesh, project=False, hausdorff=0.003, max_iterations=10).report
    assert report.hausdorff > 0.003
    assert any("farther than hausdorff" in note for note in report.notes)


def save_ply(path, mesh):
    surface.write(path, mesh)


def save_vtp(path, mesh):
    grid = pv.PolyData.from_regular_faces(mesh.points, mesh.cells.triangles)
    grid.cell_data["material"] = mesh.cell_data["material"]
    grid.save(path)


def save_obj(path, mesh):
    lines = ["v " + " ".join(map(repr, point)) for point in mesh.points.tolist()]
    for name, tag in (("upper", 3), ("lower", 7)):
        lines.append(f"g {name}")
        chosen = mesh.cells.triangles[np.equal(tags(mesh), tag)]
        lines += ["f " + " ".join(str(i + 1) for i in cell) for cell in chosen.tolist()]
    path.write_text("\n".join(lines) + "\n")


def save_stl(path, mesh):
    lines = []
    for name, tag in (("upper", 3), ("lower", 7)):
        lines.append(f"solid {name}")
        for cell in mesh.cells.triangles[np.equal(tags(mesh), tag)]:
            corners = [f"vertex {x!r} {y!r} {z!r}" for x, y, z in mesh.points[cell].tolist()]
            lines += ["facet normal 0 0 0", "outer loop", *corners, "endloop", "endfacet"]
        lines.append(f"endsolid {name}")
    path.write_text("\n".join(lines) + "\n")


@pytest.mark.parametrize("save", [save_ply, save_vtp, save_obj, save_stl], ids=lambda save: save.__name__)
def test_arrays_groups_and_solids_of_files_are_regions(save, tmp_path):
    mesh = two_patches(SPHERES["triangles"]())
    path = tmp_path / f"a.{save.__name__[-3:]}"
    save(path, mesh)
    read = surface.read(path)
    found = find_interfaces(read)
    ends = np.sort(np.linalg.norm(read.points[found.edges].mean(axis=1) - [0, 0, 9], axis=1))
    expected = np.sort(np.linalg.norm(mesh.points[line_of(mesh)].mean(axis=1) - [0, 0, 9], axis=1))
    np.testing.assert_allclose(ends, expected, atol=1e-6)
    assert found.regions.names == (("3", "7") if save in (save_ply, save_vtp) else ("upper", "lower"))


def test_groups_are_those_of_the_cells_though_triangles_come_first(tmp_path):
    points = np.array([[x, y, 0.0] for y in (0, 1) for x in range(4)])
    path = tmp_path / "a.obj"
    vertices = "".join(f"v {x} {y} {z}\n" for x, y, z in points)
    path.write_text(vertices + "g left\nf 1 2 6 5\ng right\nf 2 3 7\nf 2 7 6\nf 3 4 8 7\n")
    mesh = surface.read(path)
    assert {name: mask.tolist() for name, mask in mesh.cell_groups().items()} == {
        "left": [False, False, True, False],
        "right": [True, True, False, True],
    }
    np.testing.assert_array_equal(find_interfaces(mesh).edges, [[1, 5]])


def test_the_command_line_keeps_those_of_an_array(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    mesh = two_patches(SPHERES["triangles"]())
    surface.write("a.vtu", SurfaceMesh(mesh.points, mesh.cells, cell_data={"colour": mesh.cell_data["material"]}))
    assert run("remesh a.vtu b.vtu --interfaces colour") == 0
    assert "2 regions (array 'colour': 3, 7)" in capsys.readouterr().out
    bound = 0.01 * np.linalg.norm(np.ptp(mesh.points, axis=0))
    assert distance_of_lines(surface.read("b.vtu").points, mesh.points, line_of(mesh)) < bound
    assert run("remesh a.vtu c.vtu --max-iterations 1") == 0
    assert "interfaces" not in capsys.readouterr().out


def test_regions_of_plain_vtk_are_found_and_its_arrays_stay():
    points, cells = SPHERES["both"]()
    faces = np.concatenate(
        [np.insert(cells.quads, 0, 4, axis=1).ravel(), np.insert(cells.triangles, 0, 3, axis=1).ravel()]
    )
    source = pv.PolyData(points, faces, lines=[2, 0, 1])
    height = source.cell_centers().points[:, 2]
    source.cell_data["material"], source.cell_data["height"] = (height > 0.1).astype(np.int32), height
    mesh = from_vtk(source)
    expected = find_interfaces(surface.as_surface_mesh(source))
    assert len(expected.edges) > 10
    np.testing.assert_array_equal(find_interfaces(mesh).edges, expected.edges)
    after = pv.wrap(to_vtk(source, mesh))
    assert after["material"].dtype == np.int32
    for name in ("material", "height"):
        np.testing.assert_array_equal(after[name], source[name])
