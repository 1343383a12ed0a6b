"""Tables of numbers in the lines of a deck."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .....common import ReadError

__all__ = ["read_integers", "read_nodes", "read_real"]


def read_real(field: str) -> float:
    """A number; nothing is 0, and Fortran's exponents are known."""
    try:
        return float(field or 0.0)
    except ValueError:
        if "<" in field:
            raise ReadError(f"parameters are not supported: {field!r}; put in their values") from None
        return float(field.upper().replace("D", "E"))


def read_integers(data: list[str]) -> NDArray[np.int64]:
    """All numbers in lines, which commas and blanks separate."""
    text = " ".join(data).replace(",", " ")
    numbers = _scanned(text, np.int64, " ")
    return np.array(text.split(), dtype=np.int64) if numbers is None else numbers


def read_nodes(data: list[str]) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Labels (n,) and coordinates (n, 3); what is left out is 0, and further numbers are directions.

    >>> read_nodes(["1, 0.5, 1e0, 2", "2,,1.d0"])
    (array([1, 2]), array([[0.5, 1. , 2. ],
           [0. , 1. , 0. ]]))
    """
    if all(line.count(",") == 3 for line in data):
        table = _scanned(",".join(data), np.float64, ",")
        if table is not None and len(table) == 4 * len(data) and (np.abs(table[::4]) < 2.0**53).all():
            table = table.reshape(-1, 4)
            return table[:, 0].astype(np.int64), table[:, 1:]
    rows = [[field.strip() for field in f"{line},,,".split(",")[:4]] for line in data]
    labels = np.array([int(float(row[0])) for row in rows], dtype=np.int64)
    return labels, np.array([[read_real(field) for field in row[1:]] for row in rows]).reshape(-1, 3)


def _scanned(text: str, dtype: Any, separator: str) -> NDArray[Any] | None:
    """All numbers of a text at once, which takes little time and memory; None if there is anything else."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            return np.fromstring(text, dtype, sep=separator)
        except (DeprecationWarning, ValueError):
            return None
