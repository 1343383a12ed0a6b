"""Write the small meshes of this folder: valid, but bad. Run as ``python data/make_data.py``."""

from pathlib import Path

import numpy as np
import pyvista as pv

from hexconformal import generate
from hexconformal.quality import quality

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


if __name__ == "__main__":
    main()
