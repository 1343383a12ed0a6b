"""netCDF files in memory, with what Exodus has in them: texts, lists of ids and names, names of components."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....common import ReadError

__all__ = [
    "as_characters",
    "component_names",
    "ids_of",
    "joined_components",
    "length_of",
    "names_of",
    "opened",
    "property_of",
    "texts",
]

_COMPRESSION = 1100  # the most by which netCDF's compression shrinks an array
_SMALL = 10_000_000  # bytes that any file may ask for


@contextmanager
def opened(content: bytes) -> Iterator[Any]:
    """A netCDF file whose bytes are in memory, for reading; raises a ReadError if it claims more than it can hold."""
    import netCDF4

    data = netCDF4.Dataset("memory", "r", memory=content)
    try:
        data.set_auto_maskandscale(False)
        if data.groups:
            raise ReadError(f"files with several groups are not supported: {', '.join(data.groups)}")
        limit = max(_SMALL, _COMPRESSION * len(content))
        for name, variable in data.variables.items():
            if int(np.prod(variable.shape, dtype=object)) > limit:
                raise ReadError(f"{name} is said to have {variable.shape} values, more than the file can hold")
        yield data
    finally:
        data.close()


def length_of(data: Any, dimension: str) -> int:
    """The length of a dimension; 0 if it is not there."""
    return len(data.dimensions[dimension]) if dimension in data.dimensions else 0


def texts(data: Any, name: str) -> list[str]:
    """The texts of a variable of characters, a row each; none if it is not there."""
    if name not in data.variables:
        return []
    rows = np.asarray(data[name][:])
    rows = rows.reshape(-1, rows.shape[-1]) if rows.ndim > 1 else rows.reshape(1, -1)
    joined = [b"".join(row.tolist()).partition(b"\0")[0] for row in rows.astype("S1")]
    return [text.decode("utf-8", "surrogateescape").strip() for text in joined]


def as_characters(names: list[str], length: int) -> NDArray[np.bytes_]:
    """(k, length) characters of names, as netCDF holds them."""
    padded = [name.encode("utf-8", "surrogateescape")[: length - 1].ljust(length, b"\0") for name in names]
    return np.frombuffer(b"".join(padded), dtype="S1").reshape(len(names), length)


def ids_of(data: Any, kind: str, count: int) -> list[int]:
    """The ids of blocks or sets; those that are not there are numbers from 1."""
    name = f"{kind}_prop1"
    ids = np.asarray(data[name][:]).astype(np.int64).tolist() if name in data.variables else []
    return ids if len(ids) == count else list(range(1, count + 1))


def property_of(data: Any, kind: str, name: str, count: int) -> list[int]:
    """What blocks or sets have of a property with a name; 0, as the format has it, for none."""
    # A variable's own name hides the attribute.
    found = (one for key, one in data.variables.items() if key.startswith(f"{kind}_prop") and "name" in one.ncattrs())
    values = next((np.asarray(one[:]).ravel().tolist() for one in found if one.getncattr("name") == name), [])
    return values if len(values) == count else [0] * count


def names_of(data: Any, kind: str, ids: list[int], default: str) -> list[str]:
    """The names of blocks or sets, all different; one that has none is called by default and its id."""
    given = texts(data, f"{kind}_names")
    given += [""] * (len(ids) - len(given))
    names: list[str] = []
    for name, number in zip(given, ids, strict=False):
        chosen = name or f"{default}_{number}"
        names.append(chosen if chosen not in names else f"{chosen}_{number}")
    return names


def joined_components(names: list[str]) -> dict[str, list[int]]:
    """Variables by name, where those that end in x, y and z are the components of one.

    >>> joined_components(["T", "disp_x", "disp_y", "disp_z"])
    {'T': [0], 'disp': [1, 2, 3]}
    """
    found: dict[str, list[int]] = {}
    used: set[int] = set()
    for place, name in enumerate(names):
        if place in used:
            continue
        places = [place]
        if name[-1:] in ("x", "X"):
            y, z = ("y", "z") if name[-1] == "x" else ("Y", "Z")
            others = [other for other in (name[:-1] + y, name[:-1] + z) if names.count(other) == 1]
            vector = re.sub(r"_$", "", name[:-1])
            if len(others) == 2 and vector and vector not in names and vector not in found:
                places += [names.index(other) for other in others]
                name = vector
        used.update(places)
        found[name] = places
    return found


def component_names(name: str, width: int) -> list[str]:
    """Names of the variables that an array of some width becomes.

    >>> component_names("v", 3), component_names("T", 1)
    (['v_x', 'v_y', 'v_z'], ['T'])
    """
    if width == 1:
        return [name]
    return [f"{name}_{axis}" for axis in ("xyz" if width == 3 else range(1, width + 1))]
