"""Pages in a real browser: they open without a complaint or a request, and show what the numbers say."""

import io
from itertools import permutations

import numpy as np
import pytest
from matplotlib.image import imread
from meshes.mixed import mixed_block
from meshes.surfaces import as_arrays, mixed_sphere
from web_pages import Opened

import hexconformal as hc
from hexconformal import generate
from hexconformal.elements import TETRAHEDRON10
from hexconformal.page import PageSchedule, volume_page
from surface import as_surface_mesh
from surface.page import surface_page


@pytest.fixture(scope="module")
def report(started, run):
    return Opened(started, run / "report.html").ready()


@pytest.fixture
def page(report):
    """The page of the run, with all cells again."""
    report.tab.keyboard.press("Escape")
    report.set("{layout: 'both', frame: page.mesh.frames.length - 1, chosenBy: 'own'}".replace("page", "hexconformal"))
    return report


@pytest.fixture(scope="module")
def both(run):
    """Measures before and after."""
    return hc.quality(run / "part.vtu"), hc.quality(run / "better.vtu")


def pixels(opened):
    """What is seen of the mesh, (h, w, 3) bytes."""
    opened.rest()
    picture = imread(io.BytesIO(opened.tab.locator("main").screenshot()))
    return np.round(255 * picture[..., :3]).astype(int)


def test_opens_without_complaints_and_loads_nothing(page, run):
    assert page.complaints == []
    assert page.requests == [(run / "report.html").resolve().as_uri()]
    assert page.tab.locator("#label-before b").inner_text() == "before"
    assert page.tab.locator("#counts").inner_text().startswith("all ")


def test_values_are_those_of_the_files(page, run):
    for frame, name in (("first", "part.vtu"), ("last", "better.vtu")):
        mesh = hc.read(run / name)
        np.testing.assert_array_equal(page.ask(f"Array.from(page.mesh.{frame}.points)"), mesh.points.ravel())
        load = page.ask(f"Array.from(page.mesh.{frame}.cellValues('load'))")
        np.testing.assert_array_equal(load, mesh.cell_data["load"].ravel())
    again = page.ask("Array.from(page.mesh.last.cellValues('scaled_jacobian'))")
    np.testing.assert_array_equal(again, hc.read(run / "better.vtu").cell_data["scaled_jacobian"])


@pytest.mark.parametrize("place", [150, 640])
def test_the_slider_leaves_the_worse_cells(page, both, place):
    slider = page.tab.locator("#threshold")
    slider.fill(str(place))
    before, after = (one.scaled_jacobian for one in both)
    low, high = min(before.min(), after.min()), max(before.max(), after.max())
    bound = page.ask("page.store.state.threshold")
    assert bound == pytest.approx(low + place / 1000 * (high - low))
    assert page.counts() == [(before <= bound).sum(), (after <= bound).sum()]
    shown = [page.tab.locator(f"#label-{name}").get_attribute("data-count") for name in ("before", "after")]
    assert [int(count) for count in shown] == page.counts()
    page.tab.locator("#chosen-by").select_option("before")
    assert page.counts() == [(before <= bound).sum()] * 2
    page.tab.locator("#chosen-by").select_option("own")
    slider.fill("1000")
    assert page.counts() == [len(before)] * 2


def test_only_faces_between_drawn_and_other_cells_are_drawn(page, both, run):
    page.set("{threshold: 0.7}")
    drawn = both[0].scaled_jacobian <= 0.7
    from hexconformal.mesh import face_table

    sides = face_table(hc.read(run / "part.vtu").cells).cells
    one, other = drawn[sides[:, 0]], drawn[sides[:, 1]] & (sides[:, 1] >= 0)
    assert page.ask("page.views.before.faces.geometry.index.count / 6") == (one != other).sum()


def test_regions_layers_and_cut_leave_cells_out(page, run):
    mesh = hc.read(run / "part.vtu")
    material = mesh.cell_data["material"]
    page.tab.locator("#region-1").uncheck()
    assert page.counts() == [(material == 3).sum()] * 2
    page.tab.locator("#region-1").check()
    layers = volume_page(mesh).cells.layers
    page.tab.locator("#peel").fill("1")
    assert page.counts() == [(layers >= 1).sum()] * 2
    page.tab.locator("#peel").fill("0")
    page.tab.locator("#cut-position").fill("0.4")
    after = hc.read(run / "better.vtu").points
    both = np.concatenate([mesh.points, after])
    bound = both[:, 0].min() + 0.4 * np.ptp(both[:, 0])
    assert page.counts() == [(after[mesh.cells].mean(axis=1)[:, 0] <= bound).sum()] * 2
    page.tab.locator("#cut-flipped").check()
    assert page.counts() == [(after[mesh.cells].mean(axis=1)[:, 0] >= bound).sum()] * 2
    page.tab.locator("#cut-flipped").uncheck()
    page.tab.locator("#all-cells").click()
    assert page.counts() == [len(material)] * 2


def test_a_brushed_histogram_filters(page, both):
    page.set("{panel: 'quality'}")
    chart = page.tab.locator("svg[data-measure=shape]")
    chart.scroll_into_view_if_needed()
    box = chart.bounding_box()
    for event, share in (("move", 0.25), ("down", 0.25), ("move", 0.4), ("move", 0.5), ("up", 0.5)):
        mouse = page.tab.mouse
        mouse.move(box["x"] + share * box["width"], box["y"] + 30)
        if event != "move":
            getattr(mouse, event)()
    low, high = page.ask("page.store.state.brushes.shape")
    first, last = (f([f(one.shape) for one in both]) for f in (min, max))
    assert low == pytest.approx(first + 0.25 * (last - first), abs=0.01)
    assert high == pytest.approx(first + 0.5 * (last - first), abs=0.01)
    assert page.counts() == [((one.shape >= low) & (one.shape <= high)).sum() for one in both]
    page.tab.keyboard.press("Escape")
    page.set("{panel: 'view'}")


def test_a_click_on_the_worst_cell_flies_there(page, both, run):
    page.set("{panel: 'worst', worstOf: 'before'}")
    rows = page.tab.locator("#worst-rows tr")
    named = [int(row.split()[0]) for row in rows.all_inner_texts()]
    assert named == np.argsort(both[0].scaled_jacobian, kind="stable")[:50].tolist()
    start = page.ask("page.stage.camera.position.toArray()")
    rows.first.click()
    page.rest()
    mesh = hc.read(run / "part.vtu")
    centre = page.ask(f"page.mesh.drawn({mesh.points[mesh.cells[named[0]]].mean(axis=0).tolist()})")
    np.testing.assert_allclose(page.ask("page.stage.controls.target.toArray()"), centre, atol=1e-6)
    place = np.array(page.ask("page.stage.camera.position.toArray()"))
    assert np.linalg.norm(place - centre) < 0.8 * np.linalg.norm(start)
    assert str(named[0]) in page.tab.locator(".card h3").inner_text()
    assert page.counts()[0] < 27
    page.tab.keyboard.press("Escape")
    assert page.counts() == [len(mesh.cells)] * 2
    page.tab.keyboard.press("f")
    page.set("{panel: 'view'}")


def test_frames_follow_the_slider(page, run):
    page.tab.locator("#frame").fill("4")
    page.tab.locator("#label-after b", has_text="iteration 4").wait_for()
    mesh = hc.read(run / "run_frames" / "run_0004.vtu")
    np.testing.assert_array_equal(page.ask("Array.from(page.frame.points)"), mesh.points.ravel())
    page.set("{threshold: 0.8}")
    assert page.counts()[1] == (mesh.cell_data["scaled_jacobian"] <= 0.8).sum()


def test_every_array_colours_the_mesh(page):
    for key in page.ask("page.all.map((one) => one.key)"):
        page.tab.locator("#colouring").select_option(key)
        shown = np.array(page.ask("Array.from(page.views.after.faces.geometry.attributes.value.array)"))
        assert (shown > -1e29).mean() > 0.9, key
    assert {"regions", "cell:load", "cell:load:2", "point:surface_distance", "point:moved_by"} <= set(
        page.ask("page.all.map((one) => one.key)")
    )
    page.tab.locator("#colouring").select_option("cell:load:2")
    low, high = page.ask("page.views.after.faces.material.uniforms.range.value.toArray()")
    values = np.array(page.ask("Array.from(page.mesh.last.cellValues('load'))")).reshape(-1, 3)[:, 2]
    assert (low, high) == (values.min(), values.max())
    page.tab.locator("#colouring").select_option("cell:scaled_jacobian")
    assert page.complaints == []


def test_keys(page):
    page.tab.keyboard.press("2")
    assert page.ask("page.store.state.layout") == "after"
    page.tab.keyboard.press("4")
    assert page.ask("page.stage.parts.length") == 2
    page.tab.keyboard.press("?")
    assert page.tab.locator(".help").is_visible()
    page.tab.keyboard.press("Escape")
    assert page.tab.locator(".help").count() == 0
    page.tab.keyboard.press("z")
    page.rest()
    assert page.ask("page.stage.direction().toArray()") == pytest.approx([0, 0, 1], abs=1e-6)


def test_keys_turn_the_mesh(page):
    page.tab.keyboard.press("z")
    page.rest()
    far = page.ask("page.stage.camera.position.length()")
    for key, towards in (("ArrowRight", [-1, 0]), ("ArrowLeft", [0, 0]), ("ArrowUp", [0, -1]), ("ArrowDown", [0, 0])):
        page.tab.keyboard.press(key)
        page.rest()
        tilted = np.array([*np.multiply(towards, np.sin(np.pi / 18)), np.cos(np.pi / 18 * np.abs(towards).sum())])
        np.testing.assert_allclose(page.ask("page.stage.direction().toArray()"), tilted, atol=1e-6)
    page.tab.keyboard.press("+")
    assert page.ask("page.stage.camera.position.length()") == pytest.approx(0.8 * far, rel=1e-6)
    page.tab.keyboard.press("f")
    page.tab.keyboard.press(",")
    assert page.ask("page.store.state.frame") == page.ask("page.mesh.frames.length - 2")
    page.tab.keyboard.press(".")
    page.rest()


def test_a_picture_is_saved(page):
    with page.tab.expect_download() as saving:
        page.tab.keyboard.press("p")
    assert saving.value.suggested_filename == "part.vtu.png"
    picture = imread(saving.value.path())
    assert 0.1 < (np.ptp(picture[: picture.shape[0] // 2, :, :3], axis=2) > 0.25).mean() < 0.9


@pytest.mark.parametrize(("width", "height"), [(420, 700), (760, 500)])
def test_the_mesh_is_in_sight_in_narrow_windows(started, run, width, height):
    opened = Opened(started, run / "report.html", width=width, height=height).ready().rest()
    fitting = "page.stage.distanceToFit(page.stage.direction(), page.stage.camera.up)"
    assert opened.ask("page.stage.camera.position.length()") == pytest.approx(opened.ask(fitting))
    opened.tab.set_viewport_size({"width": 1000, "height": 600})
    opened.rest()
    assert opened.ask("page.stage.camera.position.length()") == pytest.approx(opened.ask(fitting))


@pytest.mark.long
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_mesh_is_seen_in_light_and_dark(started, run, scheme):
    opened = Opened(started, run / "report.html", scheme).ready()
    seen = pixels(opened)
    corner = seen[seen.shape[0] // 2, 3]
    assert corner.mean() > 240 if scheme == "light" else corner.mean() < 40
    mesh = (np.ptp(seen, axis=2) > 60).mean()  # colours, not grey
    assert 0.1 < mesh < 0.9
    halves = np.split(seen[:, : seen.shape[1] // 2 * 2], 2, axis=1)
    assert all((np.ptp(half, axis=2) > 60).mean() > 0.1 for half in halves)


def kinds():
    ball = generate.ball(core=2, layers=2)
    yield "mixed", volume_page(mixed_block())
    yield "quadratic", volume_page(hc.elevated(hc.HexMesh(*ball)))
    yield "surface", surface_page(as_arrays(mixed_sphere(4)))
    yield "folded", volume_page(generate.jittered(*ball, amount=1.0, seed=1, valid=False))


@pytest.mark.long
@pytest.mark.parametrize(("name", "made"), [pytest.param(*kind, id=kind[0]) for kind in kinds()])
def test_pages_of_all_kinds_open(started, tmp_path, name, made):
    made.write(tmp_path / "page.html")
    opened = Opened(started, tmp_path / "page.html").ready()
    assert (np.ptp(pixels(opened), axis=2) > 60).mean() > 0.1
    opened.tab.keyboard.press("w")
    opened.rest()
    assert opened.ask("page.store.state.focus") >= 0
    assert opened.complaints == []
    assert len(opened.requests) == 1
    if name == "folded":
        assert "inverted" in opened.tab.locator("#legend").inner_text()


def test_what_stands_for_cells_of_a_large_surface_is_no_cell(started, tmp_path):
    points, triangles, quads = as_arrays(mixed_sphere(8))
    mesh = as_surface_mesh((points, triangles, quads)).replaced(point_data={"height": points[:, 2]})
    surface_page(mesh, schedule=PageSchedule(most_cells=200, worst=2)).write(tmp_path / "page.html")
    opened = Opened(started, tmp_path / "page.html").ready()
    assert "cells that this page has" in opened.tab.locator("#counts").inner_text()
    count = opened.ask("page.mesh.count")
    assert count < len(triangles) + len(quads)

    def shown():
        values = np.array(opened.ask("Array.from(page.views.after.faces.geometry.attributes.value.array)"))
        owners = opened.ask("Array.from(page.views.after.faces.geometry.userData.owners)")
        assert not np.isnan(values).any()
        return values > -1e29, np.array(owners)

    valued, owners = shown()
    assert set(owners) == {-2, *range(count)}
    assert 0.05 < valued.mean() < 0.9  # the others are grey
    assert (np.ptp(pixels(opened), axis=2) > 60).mean() > 0.005
    opened.set("{colouring: 'point:height'}")
    assert shown()[0].all()
    opened.set("{threshold: 1.0}")
    assert set(shown()[1]) == {-2, *range(count)}
    opened.set("{threshold: 0.0}")
    assert len(shown()[1]) == 0
    opened.set("{threshold: null}")
    opened.tab.keyboard.press("w")
    around = opened.ask("[...page.mesh.neighbours(page.store.state.focus)]")
    assert sorted(set(shown()[1])) == sorted(around)
    assert len(around) > 5
    assert opened.complaints == []


def test_curves_between_regions_of_a_surface(started, tmp_path):
    n = 6
    places = np.stack(np.meshgrid(*[np.arange(n + 1.0)] * 2, [0.0]), axis=-1).reshape(-1, 3)
    first = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    quads = first[:, None] + [0, 1, n + 2, n + 1]
    region = (places[quads].mean(axis=1)[:, 0] > 2.0).astype(int)
    surface_page(as_surface_mesh((places, quads)).replaced(cell_data={"region": region})).write(tmp_path / "page.html")
    opened = Opened(started, tmp_path / "page.html").ready()
    assert not opened.ask("page.views.after.seams.visible")
    opened.tab.locator("#interfaces").check()
    assert opened.ask("page.views.after.seams.visible")
    ends = np.array(opened.ask("Array.from(page.views.after.seams.geometry.attributes.instanceStart.data.array)"))
    drawn = ends.reshape(-1, 2, 3) * opened.ask("page.mesh.diagonal") + opened.ask("page.mesh.middle")
    assert len(drawn) == n
    np.testing.assert_allclose(drawn[..., 0], 2.0, atol=1e-6)
    np.testing.assert_allclose(np.sort(drawn[..., 1], axis=None), np.repeat(np.arange(n + 1), 2)[1:-1], atol=1e-6)


def test_axes_turn_with_the_mesh(page):
    page.tab.keyboard.press("z")
    page.rest()
    tips = page.ask(
        "[...document.querySelectorAll('.axes line')].map((one) => [+one.getAttribute('x2'), +one.getAttribute('y2')])"
    )
    np.testing.assert_allclose(tips, [[22, 0], [0, -22], [0, 0]], atol=0.1)
    assert page.tab.locator(".axes text").all_text_contents() == ["x", "y", "z"]


@pytest.mark.parametrize("unit", [2.0**-150, 2.0**150], ids=["tiny", "huge"])
def test_the_unit_of_length_makes_no_difference(started, tmp_path, unit):
    points, cells = generate.jittered(*generate.box((3, 3, 3)), 0.2, seed=1)
    views = []
    for scale in (1.0, unit):
        page = volume_page((scale * points, cells))
        page.write(tmp_path / "page.html")
        opened = Opened(started, tmp_path / "page.html").ready().rest()
        views.append(opened.ask("Array.from(page.views.after.faces.geometry.attributes.position.array)"))
        opened.tab.keyboard.press("w")
        opened.rest()
        views.append(opened.ask("page.stage.camera.position.toArray()"))
        assert opened.complaints == []
    assert np.ptp(views[0]) > 0.5
    assert views[:2] == views[2:]


def test_curved_faces_go_through_their_middles(started, tmp_path):
    corners, cells = generate.box((1, 1, 1))
    mesh = hc.elevated(hc.HexMesh(corners, cells), nodes=27)
    bulged = mesh.points + 0.2 * mesh.points * (np.abs(mesh.points - 0.5) < 0.5).any(axis=1)[:, None]
    volume_page(mesh.replaced(bulged)).write(tmp_path / "page.html")
    opened = Opened(started, tmp_path / "page.html").ready()
    flat = opened.ask("Array.from(page.views.after.faces.geometry.attributes.position.array)")
    drawn = np.array(flat).reshape(-1, 3) * opened.ask("page.mesh.diagonal") + opened.ask("page.mesh.middle")
    assert len(drawn) == 6 * 25
    on_skin = bulged[np.unique(opened.ask("Array.from(page.mesh.middles)") + [0])]
    nearest = np.abs(drawn[:, None] - on_skin).max(axis=2).min(axis=0)
    assert nearest.max() < 1e-6


def test_curved_triangles_are_those_of_six_nodes(started, tmp_path):
    """Of a tetrahedron of ten nodes each drawn place is that of one of its faces, as its shape functions have it."""
    points = TETRAHEDRON10.ideal.copy()
    points[4:] += np.random.default_rng(3).uniform(-0.1, 0.1, (6, 3))
    volume_page(hc.as_volume_mesh((points, {"tetra10": [range(10)]}))).write(tmp_path / "page.html")
    opened = Opened(started, tmp_path / "page.html").ready()
    flat = opened.ask("Array.from(page.views.after.faces.geometry.attributes.position.array)")
    drawn = np.array(flat).reshape(-1, 3) * opened.ask("page.mesh.diagonal") + opened.ask("page.mesh.middle")
    assert len(drawn) == 4 * 25
    u, v = (at.ravel()[:, None] for at in np.meshgrid(np.linspace(0, 1, 5), np.linspace(0, 1, 5)))
    middle = {frozenset(ends): 4 + k for k, ends in enumerate([(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)])}
    exact = []
    for i, j, k in permutations(range(4), 3):
        a, b, c = (1 - u) * (1 - v), u * (1 - v), v
        ij, jk, ki = (points[middle[frozenset(ends)]] for ends in ((i, j), (j, k), (k, i)))
        corners = a * (2 * a - 1) * points[i] + b * (2 * b - 1) * points[j] + c * (2 * c - 1) * points[k]
        exact.append(corners + 4 * (a * b * ij + b * c * jk + c * a * ki))
    nearest = np.abs(drawn[:, None] - np.concatenate(exact)).max(axis=2).min(axis=1)
    assert nearest.max() < 1e-6


def test_inside_a_notebook_it_is_the_same(started, run, tmp_path):
    result = hc.regularize(run / "part.vtu", max_iterations=2)
    shown = result._repr_html_()
    assert shown.startswith("<iframe srcdoc=")
    (tmp_path / "notebook.html").write_text(f"<!DOCTYPE html><p>In [1]</p>{shown}", encoding="utf-8")
    opened = Opened(started, tmp_path / "notebook.html")
    frame = opened.tab.frame_locator("iframe")
    frame.locator("#label-after b").wait_for(timeout=60_000)
    assert frame.locator("#counts").inner_text().startswith("all ")
    assert opened.complaints == []
    assert [url for url in opened.requests if not url.startswith("about:")] == [
        (tmp_path / "notebook.html").resolve().as_uri()
    ]
