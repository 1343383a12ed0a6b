"""The picture of regions, beside those of quality."""

import numpy as np
import pytest
from matplotlib.image import imread

import hexconformal as hc
from hexconformal import generate
from hexconformal.mesh import Regions, blocks_of
from hexconformal.plots import canvas, region_scene
from hexconformal.plots.volume_plots import before_after

POINTS, CELLS = generate.box((6, 6, 6))
UPPER = POINTS[CELLS].mean(axis=1)[:, 2] > 0.5


def picture_of(tmp_path, labels, interfaces="auto"):
    mesh = hc.HexMesh(POINTS, CELLS, cell_data={"material": labels})
    before_after(tmp_path / "p.png", mesh, mesh, interfaces)
    return imread(tmp_path / "p.png")[..., :3]


def share_of(picture, colour):
    """Share of the pixels of a colour, in whatever light."""
    red, green, blue = (int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5))
    brightness = picture.max(axis=-1, keepdims=True)
    wanted = np.array([red, green, blue]) / max(red, green, blue)
    return float(
        (
            (np.abs(picture / np.maximum(brightness, 0.05) - wanted).max(axis=-1) < 0.03)
            & (picture.min(axis=-1) < 0.95)
        ).mean()
    )


@pytest.mark.long
def test_regions_are_drawn_beside_before_and_after(tmp_path, rendering):
    picture = picture_of(tmp_path, UPPER.astype(int))
    third = picture[: int(0.85 * len(picture)), -picture.shape[1] // 3 :]
    one, other, unused = (share_of(third, colour) for colour in region_scene._COLOURS[:3])
    assert one > 0.1
    assert other > 0.1
    assert unused < 0.01
    # The legend below names both in their colours.
    legend = picture[int(0.87 * len(picture)) :, -picture.shape[1] // 3 :]
    assert share_of(legend, region_scene._COLOURS[0]) > 1e-3
    assert share_of(legend, region_scene._COLOURS[1]) > 1e-3
    without = picture_of(tmp_path, UPPER.astype(int), "ignore")
    assert without.shape[1] * 3 == picture.shape[1] * 2
    plain = tmp_path / "plain.png"
    before_after(plain, (POINTS, CELLS), (POINTS, CELLS))
    np.testing.assert_array_equal(imread(plain)[..., :3], without)


@pytest.mark.long
def test_interfaces_are_seen_where_the_mesh_is_cut_open(tmp_path, rendering, monkeypatch):
    """A core that the cut takes a part of stays visible by its interface."""
    core = (np.abs(POINTS[CELLS].mean(axis=1) - 0.5).max(axis=1) < 0.3).astype(int)
    with_interface = picture_of(tmp_path, core)
    monkeypatch.setattr(canvas, "add_interfaces", lambda *_: None)
    differs = np.abs(with_interface - picture_of(tmp_path, core)).max(axis=-1) > 0.05
    third = differs.shape[1] // 3
    assert differs[:, : 2 * third].mean() == 0.0
    assert differs[:, 2 * third :].mean() > 0.01


def test_many_regions_that_meet_have_different_colours(tmp_path, rendering):
    labels = np.arange(len(CELLS)) // 9
    pairs = np.array([[a, b] for a in range(24) for b in range(a + 1, 24) if (a * b) % 3 == 1])
    found = region_scene._apart(24, pairs)
    assert (found[pairs[:, 0]] != found[pairs[:, 1]]).all()
    assert picture_of(tmp_path, labels).shape[1] == 2400


@pytest.mark.long
@pytest.mark.parametrize("name", ["$x_{", "_hidden", "a" * 60, "\x1b[2J", "%s"])
def test_any_name_can_stand_in_the_legend(tmp_path, rendering, name):
    points, cells = generate.box((2, 1, 1))
    mesh, regions = hc.HexMesh(points, cells), Regions(np.array([0, 1]), (name, "b"), "given")
    scene = region_scene.region_scene(points, blocks_of(mesh), regions, np.ones(2, dtype=bool))
    canvas.side_by_side(tmp_path / "n.png", [scene, scene], canvas.bounding_box(points), "none")
    assert (tmp_path / "n.png").stat().st_size > 1000
