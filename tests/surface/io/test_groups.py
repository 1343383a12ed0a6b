"""Groups of surface files name nodes, as those of volumes do: what is in them may be held by name."""

import meshio
import numpy as np
import pytest
import pyvista as pv
from program import error_line, run

import surface
from hexconformal.common import OptionError
from surface.quality import held_nodes

N = 6
ROWS = np.arange((N + 1) * (N + 1)).reshape(N + 1, N + 1)
QUADS = np.stack([ROWS[:-1, :-1], ROWS[:-1, 1:], ROWS[1:, 1:], ROWS[1:, :-1]], axis=-1).reshape(-1, 4)
LOW = QUADS[: 2 * N]  # the first two rows of cells
CHOSEN = np.unique(LOW)


@pytest.fixture
def sheet():
    """A square in the plane with shaken nodes."""
    x, y = np.meshgrid(np.arange(N + 1.0), np.arange(N + 1.0))
    inner = (x % N > 0) & (y % N > 0)
    shift = np.random.default_rng(0).uniform(-0.3, 0.3, (2, *x.shape)) * inner
    return np.stack([x + shift[0], y + shift[1], 0 * x], axis=-1).reshape(-1, 3)


def obj(points, head, between, tail=""):
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in points.tolist()]
    faces = ["f " + " ".join(str(node + 1) for node in quad) for quad in QUADS.tolist()]
    return "\n".join([*lines, head, *faces[: len(LOW)], between, *faces[len(LOW) :], tail]) + "\n"


def save_obj(path, points):
    path.write_text(obj(points, "o sheet\ng low  both", "g high both"))


def save_msh(path, points):
    high = QUADS[len(LOW) :]
    tags = [np.full(len(LOW), 3), np.full(len(high), 4)]
    data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
    names = {"low": np.array([3, 2]), "high": np.array([4, 2])}
    meshio.Mesh(points, [("quad", LOW), ("quad", high)], cell_data=data, field_data=names).write(path, "gmsh22")


def save_vtp(path, points):
    grid = pv.PolyData(points, np.insert(QUADS, 0, 4, axis=1))
    grid.cell_data["low"] = np.repeat([1, 0], [len(LOW), len(QUADS) - len(LOW)])
    grid.save(path)


@pytest.mark.parametrize("save", [save_obj, save_msh, save_vtp])
def test_nodes_of_a_group_are_held_by_its_name(save, sheet, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    name = f"a.{save.__name__[-3:]}"
    save(tmp_path / name, sheet)
    mesh = surface.read(name)
    assert np.flatnonzero(held_nodes(mesh, "LOW")).tolist() == CHOSEN.tolist()
    assert run(f"remesh {name} b.vtp --fixed low --quiet") == 0
    result = surface.read("b.vtp").points
    np.testing.assert_array_equal(result[CHOSEN], mesh.points[CHOSEN])
    assert np.abs(result - mesh.points).max() > 0.05
    capsys.readouterr()
    assert run(f"remesh {name} b.vtp --fixed wall --quiet") == 2
    assert "'low'" in error_line(capsys)


def test_objects_and_groups_of_obj(sheet, tmp_path):
    path = tmp_path / "a.obj"
    path.write_text(obj(sheet, "o sheet\ng low  both", "g high both\no\ng both"))
    names = surface.read(path).named_nodes()
    assert set(names) == {"sheet", "low", "both"}
    assert names["both"].all()
    assert names["sheet"].tolist() == names["low"].tolist() == np.isin(np.arange(len(sheet)), CHOSEN).tolist()


def test_solids_of_stl(tmp_path):
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    facets = ["".join(f"vertex {x} {y} {z}\n" for x, y, z in square[[0, k, k + 1]]) for k in (1, 2)]
    facets = [f"facet normal 0 0 1\nouter loop\n{text}endloop\nendfacet\n" for text in facets]
    path = tmp_path / "a.stl"
    path.write_text(
        f"solid in let\n{facets[0]}endsolid in let\nsolid\nendsolid\n solid wall\n{facets[1]}endsolid wall\n"
    )
    names = surface.read(path).named_nodes()
    assert {name: np.flatnonzero(mask).tolist() for name, mask in names.items()} == {
        "in let": [0, 1, 2],
        "wall": [0, 2, 3],
    }


def test_many_groups_take_no_more_than_their_file(sheet, tmp_path):
    many = "g " + " ".join(f"n{k}" for k in range(20_000))
    path = tmp_path / "a.obj"
    path.write_text(obj(sheet, many, "\n".join(f"o {k}\nf 1 2 3" for k in range(20_000))))
    groups = surface.read(path).origin.file.cell_groups
    assert sum(map(len, groups.values())) == 40_000
    with pytest.raises(OptionError, match=r"there are: .* and 39990 more"):
        held_nodes(surface.read(path), "wall")


def test_without_groups_there_are_point_arrays_alone():
    mesh = surface.SurfaceMesh(np.eye(3), [[0, 1, 2]], {"wall": [0, 0, 1]})
    assert list(mesh.named_nodes()) == ["wall"]
    with pytest.raises(OptionError, match="there are: 'wall'"):
        held_nodes(mesh, "low")
