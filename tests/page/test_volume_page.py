"""What a page of a volume mesh holds is what the mesh has."""

import numpy as np
import pytest
from meshes.mixed import mixed_block
from web_pages import PageFile

import hexconformal as hc
from hexconformal import MeshError, WriteError, generate
from hexconformal.elements import HEXAHEDRON20, quadratic_shapes
from hexconformal.mesh import MixedMesh, face_table
from hexconformal.page import Frame, PageSchedule, volume_page


def test_points_and_arrays_are_bit_by_bit_those_of_the_files(run):
    page = PageFile((run / "report.html").read_text(encoding="utf-8"))
    for number, name in ((0, "part.vtu"), (-1, "better.vtu")):
        mesh, (points, of_cells, of_points) = hc.read(run / name), page.frame(number)
        assert points.tobytes() == mesh.points.tobytes()
        for name, values in mesh.cell_data.items():
            if name not in ("region", "scaled_jacobian_change"):  # which the page tells in other ways
                np.testing.assert_array_equal(of_cells[name], values)
        for name, values in mesh.point_data.items():
            np.testing.assert_array_equal(of_points[name], values)
        measured = hc.quality(mesh)
        for name, values in measured.arrays().items():
            np.testing.assert_array_equal(of_cells[name], values)
    assert page.contents["regions"]["names"] == ["3", "7"]
    np.testing.assert_array_equal(
        page.array(page.contents["regions"]["labels"]), (hc.read(run / "part.vtu").cell_data["material"] == 7)
    )


def test_frames_are_those_of_the_series(run):
    page = PageFile((run / "report.html").read_text(encoding="utf-8"))
    names = [frame["name"] for frame in page.contents["frames"]]
    assert names[:2] == ["before", "iteration 1"]
    assert names[-1] == "after"
    last = page.contents["frames"][-1]["position"]
    assert [frame["position"] for frame in page.contents["frames"]] == list(range(int(last) + 1))
    frame = hc.read(run / "run_frames" / "run_0005.vtu")
    points, of_cells, _ = page.frame(5)
    assert points.tobytes() == frame.points.tobytes()
    np.testing.assert_array_equal(of_cells["scaled_jacobian"], frame.cell_data["scaled_jacobian"])
    energy = page.contents["curves"][0]
    assert energy["title"] == "energy"
    assert len(energy["x"]) == last + 1


def test_faces_of_all_types_have_their_cells_on_both_sides():
    mesh = mixed_block()
    page = PageFile(volume_page(mesh).to_html())
    faces, sides = (page.array(page.contents[name]) for name in ("faces", "sides"))
    every = {}
    for block in mesh.blocks:
        for place, nodes in zip(block.places.tolist(), block.cells.tolist(), strict=True):
            for face in block.cell_type.faces:
                every.setdefault(tuple(sorted(nodes[k] for k in face)), set()).add(place)
    found = {
        tuple(sorted(set(face))): set(side) - {-1} for face, side in zip(faces.tolist(), sides.tolist(), strict=True)
    }
    assert found == every
    types = [page.contents["cells"]["type_names"][k] for k in page.array(page.contents["cells"]["types"])]
    assert types.count("pyramid") == sum(len(b.cells) for b in mesh.blocks if b.cell_type.name == "pyramid")


def test_labels_are_those_of_the_file(tmp_path):
    points, cells = generate.box((2, 1, 1))
    lines = ["*NODE", *(f"{10 * k + 5}, {x}, {y}, {z}" for k, (x, y, z) in enumerate(points.tolist()))]
    lines += ["*ELEMENT, TYPE=C3D8"]
    lines += [", ".join(map(str, [100 * k + 7, *(10 * c + 5 for c in cell)])) for k, cell in enumerate(cells.tolist())]
    (tmp_path / "part.inp").write_text("\n".join(lines) + "\n")
    page = PageFile(volume_page(tmp_path / "part.inp").to_html())
    assert page.contents["cells"]["labels"] == [7, 107]
    assert page.contents["title"] == "part.inp"


def test_middles_of_curved_faces_are_where_the_shape_functions_say():
    corners, cells = generate.box((2, 2, 1))
    curved = hc.elevated(hc.HexMesh(corners, cells), nodes=20)
    page = PageFile(volume_page(curved).to_html())
    faces, middles = page.array(page.contents["faces"]), page.array(page.contents["middles"])
    assert (middles[:, :4] >= 0).all()
    assert (middles[:, 4] == -1).all()  # of eight nodes
    for side in range(4):
        ends = curved.points[faces[:, [side, (side + 1) % 4]]].mean(axis=1)
        np.testing.assert_allclose(curved.points[middles[:, side]], ends)
    # The browser takes the centre of a face of eight nodes as this mean of them.
    centre = quadratic_shapes(np.array([[0.5, 0.5, 0.0]]), HEXAHEDRON20)[0]
    np.testing.assert_allclose(centre[:4], -0.25)
    np.testing.assert_allclose(centre[8:12], 0.5)


def test_layers_are_peeled_from_the_boundary():
    shape = (5, 6, 7)
    page = volume_page(generate.box(shape))
    index = np.stack(np.unravel_index(np.arange(np.prod(shape)), shape[::-1])[::-1], axis=1)
    expected = np.minimum(index, np.array(shape) - 1 - index).min(axis=1)
    np.testing.assert_array_equal(np.sort(page.cells.layers), np.sort(expected))
    centres = generate.box(shape)[0][generate.box(shape)[1]].mean(axis=1)
    inside = (np.abs(centres - 0.5) < 0.5 - 1.0 / np.array(shape)).all(axis=1)
    np.testing.assert_array_equal(page.cells.layers > 0, inside)


def test_distance_of_the_skin():
    points, cells = generate.box((3, 3, 3))
    raised = points + np.where(points[:, 2:] == 1.0, [0.0, 0.0, 0.125], 0.0)
    page = volume_page((points, cells), (raised, cells))
    before, after = (frame.point_data["surface_distance"] for frame in page.frames)
    skin = np.unique(face_table(cells).quads[face_table(cells).counts == 1])
    assert np.isnan(before).sum() == len(points) - len(skin) == 8
    top = (points[:, 2] == 1.0) & (np.abs(points[:, :2] - 0.5) < 0.4).all(axis=1)
    np.testing.assert_allclose(before[top], 0.125)
    np.testing.assert_allclose(after[top], 0.125)
    np.testing.assert_allclose(after[points[:, 2] == 0.0], 0.0, atol=1e-15)


def test_large_meshes_have_skin_worst_cells_and_what_is_around_them():
    shape = 9
    points, cells = generate.box((shape, shape, shape))
    middle = int(np.abs(points - 4 / 9).sum(axis=1).argmin())
    points = points + 0.0
    points[middle] += 0.04
    page = volume_page((points, cells), schedule=PageSchedule(most_cells=500, worst=1))
    file = PageFile(page.to_html())
    told = file.contents["cells"]
    assert told["total"] == shape**3
    worst = int(hc.quality((points, cells)).scaled_jacobian.argmin())
    centres = points[cells].mean(axis=1)
    near = (np.abs(centres - centres[worst]) < 1.5 / shape).all(axis=1)
    assert told["count"] == shape**3 - (shape - 2) ** 3 + near.sum() == 386 + 27
    assert set(np.flatnonzero(near)) <= set(told["labels"])
    assert "413 of them: those at the boundary, the worst ones by scaled Jacobian" in file.contents["remarks"][0]
    # The skin is that of the whole mesh; other faces have cells beyond that are not in the page.
    faces, sides = (file.array(file.contents[name]) for name in ("faces", "sides"))
    places = file.frame(0)[0]
    assert (sides[:, 1] == -1).sum() == 6 * shape**2
    assert (sides[:, 1] == -2).any()
    on_box = (np.abs(places[faces] - 0.5) == 0.5).all(axis=1).any(axis=1)
    np.testing.assert_array_equal(on_box, sides[:, 1] == -1)
    # Histograms are of all cells, values those of the cells that are kept.
    assert sum(file.contents["measures"][0]["after"]) == shape**3
    np.testing.assert_array_equal(
        file.frame(0)[1]["scaled_jacobian"], hc.quality((points, cells)).scaled_jacobian[told["labels"]]
    )


def test_a_page_is_small_beside_its_mesh():
    assert len(volume_page(generate.box((1, 1, 1))).to_html()) < 800_000


def test_pages_of_the_same_are_the_same(run):
    one, two = (volume_page(run / "part.vtu", run / "better.vtu").to_html() for _ in range(2))
    assert one == two


def test_other_cells_and_other_endings_are_refused(tmp_path):
    points, cells = generate.box((2, 2, 2))
    with pytest.raises(MeshError, match="same cells"):
        volume_page((points, cells), generate.box((2, 2, 3)))
    with pytest.raises(MeshError, match="same cells"):
        volume_page((points, cells), (points, cells[::-1]))
    with pytest.raises(MeshError, match=r"NaN or infinite coordinates: 27 \(first ids 0"):
        volume_page((points, cells), (points * np.nan, cells))
    with pytest.raises(WriteError, match=r"known are \.htm \.html"):
        volume_page(generate.box((2, 2, 2))).write(tmp_path / "page.pdf")


def test_text_that_looks_like_markup_stays_text():
    points, cells = generate.box((1, 1, 1))
    mesh = MixedMesh.of_types(points, {"hexahedron": cells}).replaced(cell_data={"</script><b>": np.array([1.5])})
    text = volume_page(mesh, title="<i>&").to_html()
    assert "<b>" not in text.split("<body>")[0]
    assert "<title>&lt;i&gt;&amp; – hexconformal</title>" in text
    assert PageFile(text).frame(0)[1]["</script><b>"] == [1.5]


def test_frames_between_come_along():
    points, cells = generate.box((2, 2, 2))
    between = Frame("half", 1.5 * points, position=1.0)
    page = PageFile(volume_page((points, cells), (2 * points, cells), frames=[between]).to_html())
    assert [frame["name"] for frame in page.contents["frames"]] == ["before", "half", "after"]
    np.testing.assert_array_equal(page.frame(1)[0], 1.5 * points)
