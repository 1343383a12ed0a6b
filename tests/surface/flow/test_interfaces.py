"""Lines between regions go where a flow takes them, whether or not it is remeshed."""

import numpy as np
from meshes.surfaces import icosphere, shaken
from program import run

import surface
from hexconformal.geometry import face_areas
from surface.flow import Evolution, MeanCurvature, Stepping
from surface.flow.remeshing import Remesher
from surface.mesh import SurfaceMesh


def two_patches():
    """A stretched sphere of two patches, and the nodes of the line between them."""
    points, cells = shaken(icosphere(2), 0.03)
    points = points * [1.0, 1.0, 1.4]
    material = np.where(cells.centres(points)[:, 2] > 0.3, 1, 2)
    sides = [np.isin(np.arange(len(points)), cells.triangles[material == tag]) for tag in (1, 2)]
    return SurfaceMesh(points, cells, cell_data={"material": material}), sides[0] & sides[1]


def share_and_line(mesh, line, **options):
    flow = MeanCurvature(mesh, conserve="volume")
    *_, last = surface.evolve(flow, steps=15, tau=0.003, growth=1.0, stall=0.0, **options)
    areas = face_areas(last.points, mesh.cells)
    return areas[mesh.cell_data["material"] == 1].sum() / areas.sum(), last.points[line], last.record.mean_angle


def test_the_line_is_that_of_the_flow_without_remeshing():
    mesh, line = two_patches()
    assert 10 < line.sum() < 40
    share, at, angle = share_and_line(mesh, line)
    kept, kept_at, kept_angle = share_and_line(mesh, line, remesh=True)
    lost, lost_at, _ = share_and_line(mesh, line, remesh=True, remesh_options={"interfaces": "ignore"})
    assert kept_angle > angle + 4
    assert np.linalg.norm(kept_at - at, axis=1).max() < 0.02
    assert np.linalg.norm(lost_at - at, axis=1).max() > 0.1
    assert abs(kept - share) < 1e-3 < abs(lost - share)


def test_remeshing_leaves_the_nodes_of_the_line_where_they_are():
    mesh, line = two_patches()
    nobody = np.zeros(len(mesh.points), dtype=bool)
    moved = Remesher(mesh, nobody, {}, 5)(mesh.points, True)
    np.testing.assert_array_equal(moved[line], mesh.points[line])
    assert np.abs(moved - mesh.points).max() > 0.02
    ignored = Remesher(mesh, nobody, {"interfaces": "ignore"}, 5)(mesh.points, True)
    plain = Remesher(SurfaceMesh(mesh.points, mesh.cells), nobody, {}, 5)(mesh.points, True)
    np.testing.assert_array_equal(ignored, plain)


def test_it_is_told_where_the_surface_is_remeshed():
    mesh, _ = two_patches()
    told = [Evolution(MeanCurvature(mesh), Stepping(steps=1, remesh=remesh)).notes for remesh in (True, False)]
    assert told[0][-1].startswith("interfaces: 2 regions (array 'material': 1, 2)")
    assert told[0][-1].endswith("go where the flow takes them: remeshing holds their nodes")
    assert told[1] == ()


def test_the_command_line_takes_the_name_of_an_array(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    mesh, _ = two_patches()
    surface.write("a.vtu", SurfaceMesh(mesh.points, mesh.cells, cell_data={"colour": mesh.cell_data["material"]}))
    assert run("flow a.vtu out --steps 1 --remesh --interfaces colour") == 0
    assert "2 regions (array 'colour': 1, 2)" in capsys.readouterr().out
