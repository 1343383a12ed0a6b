"""Surface files: VTK's own through pyvista, all others through meshio; written completely or not at all."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from hexconformal.errors import MeshError, ReadError
from hexconformal.io import check_writable, saving
from hexconformal.parsers import read_vtk, write_vtk

from .mesh import SurfaceMesh, from_meshio, from_pyvista

__all__ = ["EXTENSIONS", "read", "write"]

_VTK = (".vtp", ".vtu", ".vtk")
_MESHIO = {".ply": "ply", ".obj": "obj", ".stl": "stl", ".off": "off", ".msh": "gmsh"}
EXTENSIONS = tuple(sorted({*_VTK, *_MESHIO}))


def read(path: str | os.PathLike[str]) -> SurfaceMesh:
    """Read a surface; the extension tells the format.

    An .stl file knows no shared nodes: its equal points are merged.

    Raises
    ------
    ReadError
        If the file is missing, malformed, or of an unknown format.
    MeshError
        If it holds no surface.
    """
    path = Path(path)
    extension = path.suffix.lower()
    if not path.is_file():
        raise ReadError(f"{path} does not exist" if not path.exists() else f"{path} is a folder, not a mesh file")
    if extension not in EXTENSIONS:
        raise ReadError(f"{path}: unknown extension {extension or '(none)'}; known are {' '.join(EXTENSIONS)}")
    if path.stat().st_size == 0:
        raise ReadError(f"cannot read {path}: the file is empty")
    # meshio reads for ever where the header of a .ply file does not end.
    if extension == ".ply" and b"end_header" not in path.read_bytes():
        raise ReadError(f"cannot read {path}: no ply file, or only the beginning of one")
    try:
        if extension in _VTK:
            return from_pyvista(read_vtk(path)[0])
        import meshio

        return from_meshio(_merged(meshio.read(path, file_format=_MESHIO[extension])) if extension == ".stl"
                           else meshio.read(path, file_format=_MESHIO[extension]))  # fmt: skip
    except (ReadError, MeshError):
        raise
    except (Exception, SystemExit) as problem:
        raise ReadError(f"cannot read {path}: {type(problem).__name__}: {problem}") from problem


def write(path: str | os.PathLike[str], mesh: Any) -> None:
    """Write a surface, from whatever :func:`surface.as_surface_mesh` takes; the extension tells the format.

    Raises
    ------
    WriteError
        If the file cannot be written.
    """
    from .mesh import as_surface_mesh

    path = Path(path)
    check_writable(path, EXTENSIONS)
    surface = as_surface_mesh(mesh)
    if path.suffix.lower() in _VTK:
        saving(path, lambda target: write_vtk(target, to_pyvista(surface, path.suffix.lower() == ".vtp")))
        return

    def put(target: Path) -> None:
        import meshio

        out = to_meshio(surface)
        form = _MESHIO[path.suffix.lower()]
        options = {"binary": True} if form in ("ply", "stl") else {}
        meshio.write(target, out, file_format="gmsh22" if form == "gmsh" else form, **options)

    saving(path, put)


def to_meshio(mesh: SurfaceMesh) -> Any:
    """A meshio.Mesh of triangles, then quadrilaterals, with all arrays."""
    import meshio

    t = len(mesh.cells.triangles)
    names = [name for name, table in (("triangle", mesh.cells.triangles), ("quad", mesh.cells.quads)) if len(table)]
    parts = {"triangle": slice(0, t), "quad": slice(t, None)}
    return meshio.Mesh(
        mesh.points.copy(),
        list(zip(names, (table.copy() for table in mesh.cells.groups()), strict=True)),
        point_data={name: values.copy() for name, values in mesh.point_data.items()},
        cell_data={name: [values[parts[kind]] for kind in names] for name, values in mesh.cell_data.items()},
    )


def to_pyvista(mesh: SurfaceMesh, polydata: bool = True) -> Any:
    """A pyvista PolyData (or unstructured grid) of triangles, then quadrilaterals, with all arrays."""
    import numpy as np
    import pyvista as pv

    flat = [np.insert(table, 0, table.shape[1], axis=1).ravel() for table in mesh.cells.groups()]
    surface: Any = pv.PolyData(mesh.points.copy(), np.concatenate(flat))
    for name, values in mesh.point_data.items():
        surface.point_data.set_array(np.array(values), name)
    for name, values in mesh.cell_data.items():
        surface.cell_data.set_array(np.array(values), name)
    return surface if polydata else surface.cast_to_unstructured_grid()


def _merged(mesh: Any) -> Any:
    import meshio
    import numpy as np

    points, inverse = np.unique(mesh.points, axis=0, return_inverse=True)
    return meshio.Mesh(points, [(block.type, inverse.ravel()[block.data]) for block in mesh.cells])
