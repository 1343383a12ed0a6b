"""The regions of a mesh: its materials, parts and blocks, and the faces between them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Sized
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ..common import OptionError, array_of_numbers, first_names
from .topology import face_table

__all__ = ["REGION_ARRAYS", "SURFACE_ARRAYS", "Regions", "find_regions", "interface_quads"]

Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

# Arrays on cells that tell regions apart, those with the plainest names first; their case does not matter.
REGION_ARRAYS = (
    *("material", "materials", "materialids", "material_id", "region", "regions", "part", "parts", "block", "blocks"),
    *("subdomain", "domain", "attribute", "gmsh:physical", "medit:ref", "nastran:ref", "cell_tags"),
)
# Arrays on faces that tell surfaces apart, those of the geometry first.
SURFACE_ARRAYS = (
    *("gmsh:geometrical", "CellEntityIds", "gmsh:physical", "medit:ref", "nastran:ref", "cell_tags"),
    *("tags", "tag", "surface"),
)
_MANY = 0.5  # values per cell from which on an array numbers cells, not regions


@dataclass(frozen=True, eq=False)
class Regions:
    """Which cells belong together.

    Attributes
    ----------
    labels
        (m,) region of every cell, 0 to k - 1.
    names
        (k,) what they are called.
    source
        Where they come from, in words.
    """

    labels: Ints
    names: tuple[str, ...]
    source: str

    def __str__(self) -> str:
        return f"{len(self.names)} regions ({self.source}: {first_names(list(self.names))})"


class Tagged(Protocol):
    """A mesh with arrays on its cells, and sets of them, as volumes and surfaces are."""

    @property
    def cells(self) -> Sized:
        """The cells."""

    @property
    def cell_data(self) -> Mapping[str, NDArray[Any]]:
        """Arrays by name, first axis m."""

    def cell_groups(self) -> Mapping[str, Mask]:
        """Masks (m,) of the cells in sets, by name."""


def find_regions(mesh: Tagged, interfaces: Any = "auto", names: Sequence[str] = REGION_ARRAYS) -> Regions | None:
    """The regions of a mesh, from what it carries.

    Parameters
    ----------
    mesh
        The mesh, a volume or a surface.
    interfaces
        "auto": the first array on cells with a name that stands for regions (material, region, part, block,
        gmsh:physical and the like) and more than one value, else the cell sets of the file as far as they do not
        overlap; "ignore": none; the name of an array; or (m,) integers.
    names
        Those that stand for regions.

    Returns
    -------
    The regions; None where there are fewer than two.

    Raises
    ------
    OptionError
        If the name is unknown, or the numbers are not one integer per cell.

    Examples
    --------
    >>> from hexconformal import HexMesh
    >>> from hexconformal.generate import box
    >>> mesh = HexMesh(*box((2, 1, 1)), cell_data={"material": np.array([7, 3])})
    >>> regions = find_regions(mesh)
    >>> regions.labels, regions.names, regions.source
    (array([1, 0]), ('3', '7'), "array 'material'")
    >>> print(regions)
    2 regions (array 'material': 3, 7)
    """
    if isinstance(interfaces, str):
        if interfaces == "ignore":
            return None
        if interfaces == "auto":
            known = {name.lower(): name for name in mesh.cell_data}
            given = [known[name.lower()] for name in names if name.lower() in known]
            found = (_of_values(mesh.cell_data[name], f"array {name!r}") for name in given)
            return next((regions for regions in found if regions is not None), None) or _of_sets(mesh.cell_groups())
        if interfaces not in mesh.cell_data:
            there = first_names(list(mesh.cell_data)) if mesh.cell_data else "none"
            raise OptionError(
                f"interfaces must be 'auto', 'ignore' or an array on cells, not {interfaces!r}; there are: {there}"
            )
        return _given(mesh.cell_data[interfaces], len(mesh.cells), f"array {interfaces!r}")
    return _given(interfaces, len(mesh.cells), "given")


def interface_quads(cells: Ints, labels: Ints) -> tuple[Ints, Ints]:
    """Faces between cells of different regions.

    Returns
    -------
    (k, 4) nodes of each, and (k,) the pair of regions, as numbers that are the same for the same pair.

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> _, cells = box((3, 1, 1))
    >>> interface_quads(cells, np.array([0, 1, 0]))
    (array([[ 1,  5, 13,  9],
           [ 2,  6, 14, 10]]), array([1, 1]))
    """
    table = face_table(cells)
    one, other = table.cells.T
    between = (other >= 0) & (labels[one] != labels[other])
    sides = np.sort(np.stack([labels[one[between]], labels[other[between]]]), axis=0)
    return np.ascontiguousarray(table.quads[between]), sides[0] * (int(labels.max(initial=0)) + 1) + sides[1]


def _given(values: Any, count: int, source: str) -> Regions | None:
    numbers = array_of_numbers("interfaces", values, "a name or integers")
    if numbers.shape != (count,) or not np.array_equal(numbers, np.rint(numbers)):
        raise OptionError(f"interfaces must be one integer for each of the {count} cells, not of shape {numbers.shape}")
    return _numbered(numbers, source)


def _of_values(values: NDArray[Any], source: str) -> Regions | None:
    """The regions that an array stands for; None where it numbers cells, or its values are no integers."""
    if values.ndim != 1 or values.dtype.kind not in "iubf" or not np.array_equal(values, np.rint(values)):
        return None
    regions = _numbered(values, source)
    many = regions is not None and len(regions.names) > max(2.0, _MANY * len(values))
    return None if many else regions


def _numbered(values: NDArray[Any], source: str) -> Regions | None:
    kinds, labels = np.unique(values, return_inverse=True)
    names = tuple(f"{kind:g}" for kind in kinds.astype(np.float64).tolist())
    return Regions(labels.astype(np.int64).ravel(), names, source) if len(kinds) > 1 else None


def _of_sets(groups: Mapping[str, Mask]) -> Regions | None:
    """Sets of cells that do not overlap, and the rest of the cells as one more region."""
    if not groups:
        return None
    members = np.stack([np.asarray(mask) for mask in groups.values()])
    # A set of all cells tells nothing apart, and others inside it are meant.
    telling = np.flatnonzero(members.any(axis=1) & ~members.all(axis=1))
    if len(telling) == 0 or (members[telling].sum(axis=0) > 1).any():
        return None
    names = [list(groups)[k] for k in telling]
    labels = np.where(members[telling].any(axis=0), members[telling].argmax(axis=0), len(names))
    kinds, labels = np.unique(labels, return_inverse=True)
    named = tuple([*names, "the rest"][k] for k in kinds.tolist())
    return Regions(labels.astype(np.int64).ravel(), named, "sets of cells") if len(kinds) > 1 else None
