"""Gmsh's meshes (.msh) as a format: those of a file are written as they came; Ansys has the same extension."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ...format_tools.capabilities import Capabilities, supported_part
from ...format_tools.format import Format
from ...format_tools.meshio_files import (
    checked_contents,
    file_head,
    parsing,
    permuted_nodes,
    refuse_namesake,
    write_with_meshio,
)
from ...format_tools.tags import cell_tags, is_told_by_tags, tag_names
from ...source_file import FileContents, SourceFile
from .elements import NODE_ORDERS
from .reader import read_mesh
from .rewriting import put_points

__all__ = ["GMSH"]

_TAGS = ("gmsh:physical", "gmsh:geometrical")
_ENTITIES = "gmsh:dim_tags"
_CAPABILITIES = Capabilities(
    cell_types="""vertex line line3 line4 line5 line6 line7 line8 line9 line10 line11 triangle triangle6 triangle10
        triangle15 triangle21 triangle28 triangle36 triangle45 triangle55 triangle66 quad quad8 quad9 quad16
        quad25 quad36 quad49 quad64 quad81 quad100 quad121 tetra tetra10 tetra20 tetra35 tetra56 tetra84
        tetra120 tetra165 tetra220 tetra286 pyramid pyramid13 pyramid14 wedge wedge15 wedge18 wedge40 wedge75 wedge126
        wedge196 wedge288 wedge405 wedge550 hexahedron hexahedron20 hexahedron27 hexahedron64 hexahedron125
        hexahedron216 hexahedron343 hexahedron512 hexahedron729 hexahedron1000""",
    point_arrays="all",
    cell_arrays="all",
    own_arrays=(*_TAGS, _ENTITIES),
    components=(1, 3, 9),
    field_data=True,
)
_VERSION_1 = rb"\$NOD", "this is a Gmsh 1 file: let Gmsh save it again, in version 2.2 or 4.1"


def _read(path: Path) -> FileContents:
    header = re.search(rb"\$MeshFormat\s+(\S+)\s+(\d)", file_head(path))
    with parsing("gmsh" if header else "gmsh or ansys") as output:
        import meshio

        refuse_namesake(path, *_VERSION_1)
        notes: tuple[str, ...] = ()
        if header is None:
            file = SourceFile(path, "ansys")
            mesh = meshio.ansys.read(str(path))
        else:
            version, as_text = header[1].decode(), header[2] == b"0"
            if version == "4.0":
                file, mesh = SourceFile(path, "gmsh", version, as_text), meshio.gmsh.read(str(path))
            else:
                data = path.read_bytes()
                found = read_mesh(data)
                mesh, notes = found.mesh, found.notes
                tags = found.node_tags, found.element_tags
                file = SourceFile(path, "gmsh", version, as_text, "", data, *tags)
    contents = checked_contents(mesh, file, output)
    return replace(contents, notes=(*contents.notes, *notes))


def _write(target: Path, mesh: Any) -> list[str]:
    """Write in the version that the mesh was read from, if meshio's writer can, otherwise as binary 2.2."""
    out, lost = supported_part(mesh, "gmsh", _CAPABILITIES)
    # Names of physical groups repeat as cell sets, which their tags already tell.
    lost = [
        text for text in lost if text not in {f"cell set {key!r}" for key in out.cell_sets if is_told_by_tags(out, key)}
    ]
    lost += _families_as_groups(out)
    arrays = [*out.point_data.items(), *((name, parts[0]) for name, parts in out.cell_data.items())]
    integers = [name for name, array in arrays if array.dtype.kind in "iu" and name not in (*_TAGS, _ENTITIES)]
    if integers:
        lost.append(f"the integer type of {', '.join(integers)} (kept as floating point)")
    file = getattr(mesh.origin, "file", None)
    from_version_4 = file is not None and file.version.startswith("4")
    version_4 = from_version_4 and _entities_are_known(out)
    if not version_4:
        out.point_data.pop(_ENTITIES, None)
    if from_version_4 and not version_4:
        lost.append("the geometric entities of Gmsh 4 (written as version 2.2)")
    # Both writers ask for both tags; Gmsh itself leaves those of physical groups out where there are none.
    for tag in _TAGS:
        out.cell_data.setdefault(tag, [np.zeros(len(block.data), dtype=np.int32) for block in out.cells])
    out.cells = permuted_nodes(out.cells, NODE_ORDERS, inverse=True)
    as_text = file is not None and file.ascii
    if as_text:
        _use_python_floats(out)
    write_with_meshio(target, out, "gmsh" if version_4 else "gmsh22", binary=not as_text)
    return lost


def _families_as_groups(out: Any) -> list[str]:
    """Make physical groups of MED's families, which meshio takes for groups, and does not write, where there are none.

    Families of cells have negative numbers, groups must not.
    """
    array, tags = cell_tags(out)
    if array != "cell_tags":
        return []
    names, free = tag_names(out), max(int(part.max(initial=0)) for part in tags) + 1
    found = sorted({int(tag) for part in tags for tag in np.unique(part) if tag})
    numbers = {tag: tag if tag > 0 else free + k for k, tag in enumerate(reversed(found))} | {0: 0}
    del out.cell_data["cell_tags"]
    out.cell_data["gmsh:physical"] = [np.array([numbers[tag] for tag in part.tolist()], np.int32) for part in tags]
    here = {(block.dim, tag) for block, part in zip(out.cells, tags, strict=True) for tag in np.unique(part).tolist()}
    for dimension, tag in sorted(here & set(names)):
        out.field_data.setdefault(names[dimension, tag], np.array([numbers[tag], dimension]))
    return ["the numbers of families (kept as physical groups)"]


def _entities_are_known(out: Any) -> bool:
    """True if each entity of the geometry has a node: the 4.1 writer keeps the tags of no others."""
    tags, geometry = out.point_data.get(_ENTITIES), out.cell_data.get("gmsh:geometrical")
    if tags is None or geometry is None:
        return False
    known = {tuple(row) for row in np.unique(np.asarray(tags, dtype=np.int64), axis=0).tolist()}
    entities = [(block.dim, *np.unique(part).tolist()) for block, part in zip(out.cells, geometry, strict=True)]
    return len(set(entities)) == len(entities) and known.issuperset(entities)


def _use_python_floats(out: Any) -> None:
    """Make arrays ones of Python's numbers: the writer of text spells out NumPy's as np.float64(...)."""
    for name in set(out.point_data) - {_ENTITIES}:
        out.point_data[name] = out.point_data[name].astype(np.float64).astype(object)
    for name in set(out.cell_data) - set(_TAGS):
        out.cell_data[name] = [part.astype(np.float64).astype(object) for part in out.cell_data[name]]


GMSH = Format("gmsh", _read, _write, _CAPABILITIES, put_points=put_points)
