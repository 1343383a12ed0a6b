"""Draw the pictures of README, the tour and the how-to pages: python docs/pictures.py [NAME ...].

They show what the pages' own lines of Python do to the meshes in data/ and to those of hexconformal.generate.
"""

from __future__ import annotations

import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

import hexconformal as hc
import surface
from hexconformal import generate
from hexconformal.elements import FACES
from hexconformal.mesh import boundary_quads
from hexconformal.plots import volume_plots as plots
from surface.plots import surface_plots

ROOT = Path(__file__).resolve().parents[1]
DATA, IMAGES = ROOT / "data", ROOT / "docs" / "images"
_WIDTH, _COLOURS = 1100, 128


def figure3(path: Path) -> None:
    """The cube of skewed cells that README begins with."""
    mesh = generate.sheared_cube()
    plots.before_after(path, mesh, hc.regularize(mesh, gradient_tolerance=1e-12).mesh)


def tour_hexes(path: Path) -> None:
    """A ball of shaken cells, before and after."""
    mesh = DATA / "jittered_ball.vtu"
    plots.before_after(path, mesh, hc.regularize(mesh).mesh)


def tour_quality(path: Path) -> None:
    """The measures of the same."""
    mesh = DATA / "jittered_ball.vtu"
    plots.histogram(path, mesh, hc.regularize(mesh).mesh)


def tour_surface(path: Path) -> None:
    """A head of triangles, before and after."""
    mesh = DATA / "statue.ply"
    surface_plots.before_after(path, mesh, surface.remesh(mesh).mesh)


def untangled(path: Path) -> None:
    """A ball whose inner nodes are thrown about until most cells are inverted."""
    mesh = generate.jittered(*generate.ball(core=6, layers=4), amount=1.0, seed=1, valid=False)
    plots.before_after(path, mesh, hc.regularize(mesh).mesh)


def layers(path: Path) -> None:
    """Thin cells at a wall, shaken."""
    mesh = DATA / "boundary_layer.vtu"
    plots.before_after(path, mesh, hc.regularize(mesh).mesh)


def moved(path: Path) -> None:
    """A cube inside a cube, turned by 45 degrees."""
    points, cells = generate.box((12, 12, 6), (1.0, 1.0, 0.5), (-0.5, -0.5, 0.0))
    inside = (np.abs(points[cells].mean(axis=1)[:, :2]) < 0.16).all(axis=1)
    cells = cells[~inside]
    used, cells = np.unique(cells, return_inverse=True)
    points, cells = points[used], cells.reshape(-1, 8)
    wall = np.flatnonzero((np.abs(points[:, :2]) < 0.17).all(axis=1))
    motion = hc.MeshMotion((points, cells), moving=wall)
    angle = np.radians(45)
    turned = points[wall, :2] @ [[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]]
    step = motion.step(np.column_stack([turned - points[wall, :2], np.zeros(len(wall))]))
    plots.before_after(path, (points, cells), (step.points, cells))


def fibre(path: Path) -> None:
    """A round fibre in a matrix, its inner nodes shaken."""
    points, cells = generate.cylinder(4, 2, 6, radius=0.5)
    rim = np.flatnonzero(np.isclose(np.hypot(points[:, 0], points[:, 1]), 0.5))
    around = boundary_quads(cells)[0]
    around = np.searchsorted(rim, around[np.isin(around, rim).all(axis=1)])
    rings = [rim]
    for r in (0.65, 0.8, 1.0):  # the matrix, ring by ring
        points = np.concatenate([points, points[rim] * [2 * r, 2 * r, 1]])
        rings.append(len(points) - len(rim) + np.arange(len(rim)))
    matrix = [np.hstack([low[around], high[around]]) for low, high in zip(rings[:-1], rings[1:], strict=True)]
    material = np.repeat([1, 2], [len(cells), sum(map(len, matrix))])
    cells = np.concatenate([cells, *matrix])
    shaken = generate.jittered(points, cells, 0.3)[0]
    shaken[rim] = points[rim]
    mesh = hc.HexMesh(shaken, cells, cell_data={"material": material})
    plots.before_after(path, mesh, hc.regularize(mesh).mesh)


def grains(path: Path) -> None:
    """Voxels of a polycrystal."""
    points, cells = generate.box((10, 10, 10))
    seeds = np.random.default_rng(1).uniform(size=(6, 3))
    grain = np.linalg.norm(points[cells].mean(axis=1)[:, None] - seeds, axis=2).argmin(axis=1)
    mesh = hc.HexMesh(generate.jittered(points, cells, 0.2)[0], cells, cell_data={"material": grain})
    plots.before_after(path, mesh, hc.regularize(mesh).mesh)


def four_types(path: Path) -> None:
    """A box of wedges, hexahedra, pyramids, and tetrahedra at its end, shaken."""
    points, cubes = generate.box((8, 4, 4), (2.0, 1.0, 1.0))
    x = points[cubes].mean(axis=1)[:, 0]
    cut, around = cubes[x < 0.7], cubes[x > 1.3]
    # Triangles lie in the faces across y; pyramids meet in the centre of the cube whose faces they stand on.
    wedges = np.vstack([cut[:, [0, 4, 1, 3, 7, 2]], cut[:, [4, 5, 1, 7, 6, 2]]])
    apex = len(points) + np.arange(len(around))
    points = np.vstack([points, points[around].mean(axis=1)])
    pyramids = np.vstack([np.column_stack([around[:, face[::-1]], apex]) for face in FACES])
    outside = (points[pyramids[:, :4], 0] > 1.99).all(axis=1)
    tetrahedra = np.vstack([pyramids[outside][:, [0, 1, 2, 4]], pyramids[outside][:, [0, 2, 3, 4]]])
    cells = {"hexahedron": cubes[(x > 0.7) & (x < 1.3)], "wedge": wedges, "pyramid": pyramids[~outside]}
    mesh = hc.as_volume_mesh((points, cells | {"tetra": tetrahedra}))
    inner = (points > 0.0) & (points < [2.0, 1.0, 1.0])
    moves = np.random.default_rng(0).uniform(-0.09, 0.09, points.shape)
    shaken = mesh.replaced(points + moves * inner)
    plots.before_after(path, shaken, hc.regularize(shaken).mesh)


def curved_cells(path: Path) -> None:
    """Three quarters of a ring of hexahedra of 27 nodes, all inner ones shaken."""
    mesh = hc.elevated(generate.box((3, 9, 3)), 27)
    x, angle, z = mesh.points.T * [[1.5], [1.5 * np.pi], [1.5]]
    ring = mesh.replaced(np.column_stack([-(1 + x) * np.cos(angle), -(1 + x) * np.sin(angle), z]))
    inside = ((mesh.points > 0.01) & (mesh.points < 0.99)).all(axis=1)
    moves = np.random.default_rng(0).uniform(-0.2, 0.2, ring.points.shape)
    shaken = ring.replaced(ring.points + moves * inside[:, None])
    plots.before_after(path, shaken, hc.regularize(shaken, boundary="fixed").mesh)


WAYS: list[dict[str, Any]] = [{}, {"features": "soft", "hausdorff": 0.02}, {"hausdorff": 0.001, "feature_band": 0.1}]


def three_ways(path: Path) -> None:
    """A twisted cylinder as it is, with defaults, with soft edges and more room, and with edges and surface kept."""
    mesh, panels = DATA / "twisted_cylinder.vtu", []
    for options in WAYS:
        plots.before_after(path, mesh, hc.regularize(mesh, **options).mesh)
        with Image.open(path) as picture:
            half, above = picture.width // 2, round(0.85 * picture.height)  # without the colour bar
            before, after = (picture.convert("RGB").crop((x, 0, x + half, above)) for x in (0, half))
            panels += [after] if panels else [before, after]
    whole = Image.new("RGB", (sum(panel.width for panel in panels), panels[0].height), "white")
    for number, panel in enumerate(panels):
        whole.paste(panel, (number * panel.width, 0))
    whole.save(path)


def page(path: Path) -> None:
    """The page of a result in a browser, cut open; needs playwright and Chromium."""
    from playwright.sync_api import sync_playwright

    file = path.with_suffix(".html")
    hc.regularize(DATA / "jittered_ball.vtu").to_html(file)
    flags = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-sandbox"]
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=shutil.which("chromium"), args=flags)
        tab = browser.new_page(viewport={"width": 1280, "height": 760})
        tab.goto(file.as_uri())
        tab.wait_for_selector("html[data-ready=yes]", state="attached")
        tab.get_by_role("button", name="z", exact=True).click()
        tab.locator("#cut-position").fill("0.55")
        tab.wait_for_timeout(2000)
        tab.screenshot(path=path)
        browser.close()
    file.unlink()


PICTURES: dict[str, Callable[[Path], None]] = {
    draw.__name__: draw
    for draw in (
        figure3,
        tour_hexes,
        tour_quality,
        tour_surface,
        untangled,
        layers,
        moved,
        fibre,
        grains,
        four_types,
        curved_cells,
        three_ways,
        page,
    )
}


def main() -> None:
    """Draw all pictures, or those named, small enough to be kept in the repository."""
    IMAGES.mkdir(exist_ok=True)
    for name in sys.argv[1:] or PICTURES:
        path = IMAGES / f"{name}.png"
        PICTURES[name](path)
        with Image.open(path) as picture:
            size = (_WIDTH, round(picture.height * _WIDTH / picture.width))
            small = picture.convert("RGB").resize(size, Image.Resampling.LANCZOS)
        small.quantize(_COLOURS, dither=Image.Dither.NONE).save(path, optimize=True)
        print(f"{path.relative_to(ROOT)}, {path.stat().st_size // 1000} kB")


if __name__ == "__main__":
    main()
