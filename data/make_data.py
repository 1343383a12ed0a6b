"""Write the small meshes of this folder: valid, but bad. Run as ``python data/make_data.py``."""

from pathlib import Path

import numpy as np
import pyvista as pv

import surface
from hexconformal import generate
from hexconformal.quality.assessment import quality

FOLDER = Path(__file__).parent


def twisted_cylinder() -> generate.Hexes:
    """An O-grid whose top is turned by 120 degrees, with its layers pulled to one side inside."""
    points, cells = generate.cylinder(core=6, layers=4, axial=14)
    x, y, z = points.T
    fade = 1 - (x**2 + y**2)  # nothing on the mantle
    angle = np.radians(120) * z / 2
    x, y = x + 0.4 * fade * np.sin(np.pi * z / 2), y + 0.25 * fade * np.sin(np.pi * z)
    turned = np.stack([np.cos(angle) * x - np.sin(angle) * y, np.sin(angle) * x + np.cos(angle) * y, z], axis=1)
    return turned, cells


def statue(level: int = 4) -> tuple[np.ndarray, np.ndarray]:
    """A head with nose, brow and chin on a neck: triangles drawn together towards the back, and shaken, as in scans."""
    ball = pv.Icosphere(nsub=level)
    x = np.asarray(ball.points, dtype=float)
    x = x / np.linalg.norm(x, axis=1, keepdims=True)
    shake = np.random.default_rng(3).uniform(-1, 1, x.shape)
    x = x + [0.25, 0, 0] + 0.12 * np.sin(3 * x[:, [1, 2, 0]]) + 0.28 / 2**level * shake
    x = x / np.linalg.norm(x, axis=1, keepdims=True)
    angle, z = np.arctan2(x[:, 1], -x[:, 0]), 1.5 * x[:, 2]
    width = np.hypot(x[:, 0], x[:, 1])
    bumps = ((0.4, -0.05, 0.28), (0.18, 0.5, 0.16), (0.2, -0.62, 0.16))  # nose, brow, chin: how far, where, how wide
    face = sum(far * np.exp(-(((z - at) / wide) ** 2)) for far, at, wide in bumps)
    width = width * (0.8 + 0.15 * np.tanh(4 * (z + 0.8)) + face * np.exp(-((angle / 0.5) ** 2)))
    points = np.stack([width * np.cos(angle), 0.8 * width * np.sin(angle), z], axis=1)
    return points, ball.regular_faces[:, ::-1]


MESHES = {
    "sheared_cube": generate.sheared_cube(15),
    "twisted_cylinder": twisted_cylinder(),
    "jittered_ball": generate.jittered(*generate.ball(core=6, layers=4), amount=0.45, seed=1),
    "boundary_layer": generate.jittered(*generate.boundary_layer((10, 10, 14), aspect=50), amount=0.4, seed=1),
}


def main() -> None:
    for name, (points, cells) in MESHES.items():
        grid = pv.UnstructuredGrid({pv.CellType.HEXAHEDRON: cells}, points)
        path = FOLDER / f"{name}.vtu"
        grid.save(path, binary=True, compression="lzma")
        summary = quality((points, cells)).summary()
        print(f"{path.name}, {path.stat().st_size // 1000} kB")
        print(summary, end="\n\n")
    path = FOLDER / "statue.ply"
    surface.write(path, statue())
    print(f"{path.name}, {path.stat().st_size // 1000} kB")
    print(surface.quality(path).summary())


if __name__ == "__main__":
    main()
