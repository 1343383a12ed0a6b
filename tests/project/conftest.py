"""The files that README and documentation speak of."""

import numpy as np
import pytest
import pyvista as pv

import hexconformal as hc
from hexconformal import generate


@pytest.fixture(scope="session")
def example_files(tmp_path_factory):
    """A folder with the files of the examples: small ones, which tests copy."""
    place = tmp_path_factory.mktemp("examples")
    points, cells = generate.ball(core=8, layers=1)
    points = points + 0.01 * np.random.default_rng(0).normal(size=points.shape)
    hc.write(place / "part.vtu", hc.HexMesh(points, cells))
    hc.write(place / "part.msh", hc.HexMesh(points, cells))
    hc.write(place / "mirrored.inp", hc.HexMesh(points, cells[:, [4, 5, 6, 7, 0, 1, 2, 3]]))
    hc.write(place / "layers.vtu", hc.HexMesh(*generate.boundary_layer((4, 4, 6))))
    sphere = pv.Sphere(radius=1.0, theta_resolution=60, phi_resolution=60)
    sphere.save(place / "part.stl")
    pv.Icosphere(nsub=1).scale([1.0, 1.2, 1.5]).save(place / "statue.ply")
    pv.Box(level=1, quads=True).clean().save(place / "cube.ply")
    _write_box_with_motions(place)
    _write_assembly(place)
    hc.write(place / "swept.inp", hc.as_volume_mesh(generate.jittered(*generate.swept_cylinder(), 0.3)))
    hc.write(place / "curved.msh", hc.as_volume_mesh(generate.curved_cylinder(2, 1, 2)))
    return place


def _write_box_with_motions(place):
    """A box with its lid marked as a wall, and how its floor moves: for a while, and for longer."""
    points, cells = generate.box((3, 3, 3))
    hc.write(place / "box.vtu", hc.HexMesh(points, cells, {"wall": (points[:, 2] == 1.0).astype(int)}))
    floor = np.flatnonzero(points[:, 2] == 0.0)
    for name, last in (("motion", 2), ("longer", 3)):
        rows = [f"{time},{node},0,0,{-0.05 * time}" for time in range(1, last + 1) for node in floor]
        (place / f"{name}.csv").write_text("\n".join(["time,node,dx,dy,dz", *rows]))


def _write_assembly(place):
    """A deck of two materials, the one on the other."""
    points, cells = generate.jittered(*generate.box((3, 3, 4)), 0.2)
    deck = ["*NODE", *(f"{n}, {x}, {y}, {z}" for n, (x, y, z) in enumerate(points.tolist(), 1))]
    rows = [", ".join(map(str, [n, *(nodes + 1)])) for n, nodes in enumerate(cells, 1)]
    for name, half in (("STEEL", rows[:18]), ("RUBBER", rows[18:])):
        deck += [f"*ELEMENT, TYPE=C3D8, ELSET={name}", *half, f"*SOLID SECTION, ELSET={name}, MATERIAL={name}"]
    (place / "assembly.inp").write_text("\n".join([*deck, ""]))
