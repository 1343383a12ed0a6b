"""Tags of cells: the integers by which files tell materials, and parts of the boundary, apart."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["TAG_ARRAYS", "cell_tags", "element_numbers", "is_told_by_tags", "tag_names"]

TAG_ARRAYS = ("gmsh:physical", "nastran:ref", "medit:ref", "cell_tags")


def cell_tags(mesh: Any) -> tuple[str, list[NDArray[np.int64]]]:
    """The array of a meshio.Mesh that tags its cells, block by block; no name, and zeros, if there is none.

    >>> import meshio
    >>> mesh = meshio.Mesh(np.eye(3), [("line", [[0, 1], [1, 2]])], cell_data={"medit:ref": [np.array([4, 5])]})
    >>> cell_tags(mesh)
    ('medit:ref', [array([4, 5])])
    """
    for name in TAG_ARRAYS:
        parts = [np.asarray(part) for part in mesh.cell_data.get(name, ())]
        if any(part.any() for part in parts) and all(part.dtype.kind in "iu" and part.ndim == 1 for part in parts):
            return name, [part.astype(np.int64) for part in parts]
    return "", [np.zeros(len(block.data), dtype=np.int64) for block in mesh.cells]


def tag_names(mesh: Any) -> dict[tuple[int, int], str]:
    """Names of tags by dimension and tag: those of Gmsh's physical groups, and of MED's families."""
    names = {}
    for name, value in mesh.field_data.items():
        # Formats keep other things there, too, lists in lists among them.
        numbers = list(value) if np.iterable(value) else []
        if len(numbers) == 2 and all(isinstance(number, int | np.integer) for number in numbers):
            names[int(numbers[1]), int(numbers[0])] = str(name)
    for tag, groups in getattr(mesh, "cell_tags", {}).items():
        names.update({(dimension, int(tag)): "_".join(groups) for dimension in range(4) if groups})
    return names


def is_told_by_tags(mesh: Any, name: str) -> bool:
    """Whether a set of cells of a meshio.Mesh is all that has the tag of its name, as where no cell has two tags.

    >>> import meshio
    >>> tags, names = {"gmsh:physical": [np.array([4, 5])]}, {"a": np.array([4, 1]), "both": np.array([6, 1])}
    >>> sets = {"a": [np.array([0])], "both": [np.array([0, 1])]}
    >>> lines = [("line", [[0, 1], [1, 2]])]
    >>> mesh = meshio.Mesh(np.eye(3), lines, cell_data=tags, field_data=names, cell_sets=sets)
    >>> is_told_by_tags(mesh, "a"), is_told_by_tags(mesh, "both")
    (True, False)
    """
    tag = next(((tag, dimension) for (dimension, tag), other in tag_names(mesh).items() if other == name), None)
    if tag is None:
        return False
    tags = cell_tags(mesh)[1]
    told = [(own == tag[0]) & (block.dim == tag[1]) for own, block in zip(tags, mesh.cells, strict=True)]
    for mask, part in zip(told, mesh.cell_sets[name], strict=False):
        members = np.zeros(len(mask), dtype=bool)
        if part is not None and len(part):
            members[np.asarray(part)] = True
        if (members & ~mask).any():
            return False
    return True


def element_numbers(mesh: Any, out: Any) -> list[NDArray[np.int64]]:
    """The numbers of the cells of a meshio.Mesh, block by block: hexahedra keep their labels, the others follow.

    Parameters
    ----------
    mesh
        The HexMesh that it was made from.
    out
        The meshio.Mesh.
    """
    sizes = [len(block.data) for block in out.cells]
    hexes = np.concatenate([np.full(len(b.data), b.type.startswith("hexahedron")) for b in out.cells])
    labels = mesh.cell_labels
    numbers = np.arange(1, len(hexes) + 1)
    if labels is not None and len(labels) == hexes.sum() and labels.min() > 0 and len(np.unique(labels)) == len(labels):
        numbers[hexes] = labels
        numbers[~hexes] = labels.max() + 1 + np.arange((~hexes).sum())
    return np.split(numbers, np.cumsum(sizes)[:-1])
