"""Exodus II (.e, .exo, .ex2), with the names of elements and the orders of nodes that meshio leaves out."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ...common import ReadError
from ..format_tools.capabilities import Capabilities, supported_part
from ..format_tools.format import Format
from ..format_tools.meshio_files import (
    checked_contents,
    join_blocks,
    parsing,
    permuted_nodes,
    require_disk_space,
    write_with_meshio,
)
from ..format_tools.meshio_internals import exodus_reader
from ..source_file import FileContents, SourceFile

__all__ = ["EXODUS"]

_CAPABILITIES = Capabilities(
    cell_types="""vertex line line3 triangle triangle6 quad quad8 quad9 tetra tetra10 pyramid wedge hexahedron
        hexahedron20 hexahedron27""",
    point_arrays="all",
    point_sets=True,
)
# Besides the names that meshio knows; case does not matter.
_ELEMENT_NAMES = {
    **dict.fromkeys(["TET", "TET4", "TETRA4"], "tetra"),
    **dict.fromkeys(["TET10"], "tetra10"),
    **dict.fromkeys(["PYRA", "PYRA5", "PYRAMID5"], "pyramid"),
    **dict.fromkeys(["WEDGE6"], "wedge"),
    **dict.fromkeys(["TRISHELL", "TRISHELL3", "SHELL3"], "triangle"),
    **dict.fromkeys(["TRISHELL6", "SHELL6"], "triangle6"),
    **dict.fromkeys(["BAR", "EDGE", "EDGE2", "TRUSS", "TRUSS2"], "line"),
    **dict.fromkeys(["BAR3", "EDGE3", "TRUSS3"], "line3"),
}
# Where the format has the nodes that VTK names in turn: edges upwards come before those of the top.
_EDGES = [*range(12), 16, 17, 18, 19, 12, 13, 14, 15]
_NODE_ORDERS = {"hexahedron20": _EDGES, "hexahedron27": [*_EDGES, 23, 24, 25, 26, 21, 22, 20]}


def _read(path: Path) -> FileContents:
    with parsing("exodus") as output:
        try:
            mesh = exodus_reader(_ELEMENT_NAMES)(str(path))
        except KeyError as problem:
            raise ReadError(f"not a sound exodus file (elements of type {problem} are not known)") from problem
        mesh.cells = permuted_nodes(mesh.cells, _NODE_ORDERS)
    return checked_contents(mesh, SourceFile(path, "exodus"), output)


def _write(target: Path, mesh: Any) -> list[str]:
    out, lost = supported_part(mesh, "exodus", _CAPABILITIES)
    out = join_blocks(out)
    out.cells = permuted_nodes(out.cells, _NODE_ORDERS, inverse=True)
    require_disk_space(target, out)
    write_with_meshio(target, out, "exodus")
    return lost


EXODUS = Format("exodus", (".e", ".ex2", ".exo"), _read, _write, _CAPABILITIES)
