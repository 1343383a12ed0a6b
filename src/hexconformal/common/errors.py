"""The errors this library raises on purpose; every one says what is wrong, where, and what to do."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["MeshError", "OptionError", "ReadError", "WriteError", "first_ids", "first_names", "unusable_points"]

_NAMED = 5  # ids in a message
_LARGEST = 1e50  # a coordinate whose sixth power is a number still


class MeshError(ValueError):
    """The mesh itself cannot be worked on (shape, topology, coordinates)."""


class OptionError(ValueError):
    """An option has a value, or a combination of values, that makes no sense."""


class ReadError(MeshError):
    """A file is missing, unreadable, truncated, or not the mesh its name says."""


class WriteError(OSError):
    """A result cannot be written where it was asked for."""


for _error in (MeshError, OptionError, ReadError, WriteError):
    _error.__module__ = "hexconformal"  # where users find them, and what messages call them


def unusable_points(points: NDArray[np.float64], labels: NDArray[Any] | None = None) -> tuple[NDArray[np.int64], str]:
    """Ids of points that cannot be worked with, and what is wrong with them, for an error message.

    >>> unusable_points(np.array([[0.0, 0.0, 1.0], [np.nan, 0.0, 0.0]]))[1]
    'points with NaN or infinite coordinates: 1 (ids 1)'
    """
    bad = np.flatnonzero(~(np.abs(points) <= _LARGEST).all(axis=1))
    finite = np.isfinite(points[bad]).all()
    return bad, f"points with {f'coordinates beyond {_LARGEST:g}' if finite else 'NaN or infinite coordinates'}: " + (
        first_ids(bad, labels)
    )


def first_ids(ids: ArrayLike, labels: NDArray[Any] | None = None) -> str:
    """Say how many ids there are and name the first, by their labels in the file if it has some.

    >>> first_ids([3, 7])
    '2 (ids 3, 7)'
    >>> first_ids(range(100))
    '100 (first ids 0, 1, 2, 3, 4)'
    >>> first_ids([0, 1], np.array([10, 20]))
    '2 (ids 10, 20)'
    """
    ids = np.asarray(list(ids) if isinstance(ids, range) else ids).ravel()
    named = ids[:_NAMED] if labels is None else labels[ids[:_NAMED]]
    names = ", ".join(str(i) for i in named.tolist())
    return f"{len(ids)} ({'first ids' if len(ids) > _NAMED else 'ids'} {names})"


def first_names(names: Iterable[str]) -> str:
    """Say the first of some names, and how many more there are, for a message; what cannot be printed is left out.

    >>> first_names(["a", "b\\n"]), first_names(map(str, range(12)))
    ('a, b', '0, 1, 2, 3, 4, 5, 6, 7, 8, 9 and 2 more')
    """
    clean = ["".join(filter(str.isprintable, name)) for name in names]
    more = f" and {len(clean) - 2 * _NAMED} more" if len(clean) > 2 * _NAMED else ""
    return ", ".join(clean[: 2 * _NAMED]) + more
