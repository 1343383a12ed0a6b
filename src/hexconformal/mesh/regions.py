"""The regions of a mesh: its materials, parts and blocks."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence, Sized
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ..common import OptionError, array_of_numbers, first_names
from .space import SERIAL, Space

__all__ = ["REGION_ARRAYS", "SURFACE_ARRAYS", "Regions", "find_regions", "region_arrays"]

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
_MANY = 0.5  # regions per cell from which on an array, or sets, number cells
_BITS = 32  # sets that a code of 64 bits holds besides what came before


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
    of_sets
        True where they come from sets of cells, which no array tells of.
    """

    labels: Ints
    names: tuple[str, ...]
    source: str
    of_sets: bool = False

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

    def section_groups(self) -> Mapping[str, Mask]:
        """Those of the sets of cells to which the file gives a material, by name."""

    def tag_names(self, array: str) -> Mapping[int, str]:
        """What the file calls the numbers in an array on cells that tags them."""


def find_regions(
    mesh: Tagged, interfaces: Any = "auto", names: Sequence[str] = REGION_ARRAYS, space: Space = SERIAL
) -> Regions | None:
    """The regions of a mesh, from what it carries.

    Parameters
    ----------
    mesh
        The mesh, a volume or a surface.
    interfaces
        "auto": the sets to which the file gives a material, if it does; else the first array on cells with a name that
        stands for regions (material, region, part, block, gmsh:physical and the like) and more than one value; else,
        where nothing in the file has a material, the common refinement of its cell sets. "ignore": none; the name of an
        array; or (m,) integers.
    names
        Of arrays that stand for regions.
    space
        Of values on the cells of the mesh, each part of which asks with its cells.

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
            return next((found for found in _candidates(mesh, names, space) if found is not None), None)
        if interfaces not in mesh.cell_data:
            there = first_names(list(mesh.cell_data)) if mesh.cell_data else "none"
            raise OptionError(
                f"interfaces must be 'auto', 'ignore' or an array on cells, not {interfaces!r}; there are: {there}"
            )
        values = _one_integer_each(mesh.cell_data[interfaces], len(mesh.cells), space)
        return _numbered(values, f"array {interfaces!r}", mesh.tag_names(interfaces), space)
    return _numbered(_one_integer_each(interfaces, len(mesh.cells), space).astype(np.int64), "given", {}, space)


def region_arrays(mesh: Tagged, regions: Regions | None) -> dict[str, Ints]:
    """The labels of regions that come from sets as the array "region", to put it on the mesh, unless it has one."""
    return {"region": regions.labels} if regions and regions.of_sets and "region" not in mesh.cell_data else {}


def _candidates(mesh: Tagged, names: Sequence[str], space: Space) -> Iterator[Regions | None]:
    """What regions may come from, the strongest statement first; None where it tells nothing apart."""
    sections = mesh.section_groups()
    yield _of_sets(sections, "sections")
    known = {name.lower(): name for name in mesh.cell_data}
    for name in (known[name.lower()] for name in names if name.lower() in known):
        yield _of_values(mesh.cell_data[name], name, mesh.tag_names(name), space)
    if not sections:
        # Beside sets that have a material, others are selections: for loads, or for output.
        yield _of_sets(mesh.cell_groups(), "sets of cells")


def _one_integer_each(values: Any, count: int, space: Space) -> NDArray[Any]:
    numbers = array_of_numbers("interfaces", values, "a name or integers")
    if not space.everywhere(numbers.shape == (count,) and np.array_equal(numbers, np.rint(numbers))):
        raise OptionError(f"interfaces must be one integer for each of the {count} cells, not of shape {numbers.shape}")
    return numbers


def _of_values(values: NDArray[Any], name: str, called: Mapping[int, str], space: Space) -> Regions | None:
    """The regions that an array stands for; None where it numbers cells, or its values are no integers."""
    numbers = values.ndim == 1 and values.dtype.kind in "iubf" and np.array_equal(values, np.rint(values))
    if not space.everywhere(bool(numbers)):
        return None
    return _numbered(values, f"array {name!r}", called, space, _most(int(space.total(len(values)))))


def _numbered(
    values: NDArray[Any], source: str, called: Mapping[Any, str], space: Space, most: float = np.inf
) -> Regions | None:
    kinds = space.distinct(values, most)
    if kinds is None or len(kinds) < 2:
        return None
    names = tuple(called.get(kind, f"{kind:.17g}") for kind in kinds.astype(np.float64).tolist())
    return Regions(np.searchsorted(kinds, values).astype(np.int64), names, source)


def _of_sets(groups: Mapping[str, Mask], source: str) -> Regions | None:
    """The common refinement of sets of cells: cells belong together that are in the same ones."""
    # A set of all cells tells nothing apart, and others inside it are meant.
    telling = {name: np.asarray(mask) for name, mask in groups.items() if np.any(mask) and not np.all(mask)}
    if not telling:
        return None
    counts = np.zeros(len(next(iter(groups.values()))), dtype=np.int64)
    for mask in telling.values():
        counts += mask
    if (counts != 1).any():
        # Where sets do not share all cells out, one of a single cell is a place to look at, no material.
        telling = {name: mask for name, mask in telling.items() if np.count_nonzero(mask) > 1}
    codes = np.zeros_like(counts)
    for number, mask in enumerate(telling.values(), 1):
        codes = 2 * codes + ~mask  # the members of the first set come first, cells in none last
        if number % _BITS == 0:
            codes = np.unique(codes, return_inverse=True)[1].ravel()
    _, first, labels = np.unique(codes, return_index=True, return_inverse=True)
    members: list[list[str]] = [[] for _ in first]
    for name, mask in telling.items():
        for region in np.flatnonzero(mask[first]).tolist():
            members[region].append(name)
    names = tuple(" & ".join(sets) or "the rest" for sets in members)
    tells = 1 < len(first) <= _most(len(labels))
    return Regions(labels.astype(np.int64).ravel(), names, source, of_sets=True) if tells else None


def _most(count: int) -> float:
    """How many regions so many cells have at most."""
    return max(2.0, _MANY * count)
