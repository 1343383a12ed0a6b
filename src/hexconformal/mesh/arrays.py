"""Arrays of meshes, checked for shape and type and read-only, so that no mesh changes during a run."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..common import MeshError

__all__ = ["checked_cells", "checked_data", "checked_points", "read_only"]


def checked_points(points: ArrayLike, planar: bool = False) -> NDArray[np.float64]:
    """(n, 3) points, or (n, 2) ones too, read-only; a MeshError if they are something else."""
    try:
        array = np.asarray(points)
        if np.iscomplexobj(array):
            raise TypeError("complex numbers")
        result = read_only(array, np.float64)
    except (TypeError, ValueError) as problem:
        raise MeshError(f"points must be an (n, 3) array of real numbers: {problem}") from problem
    if result.ndim != 2 or result.shape[1] not in ((2, 3) if planar else (3,)):
        raise MeshError(f"points must be an (n, 3) array{', or (n, 2) in the plane' * planar}, not {result.shape}")
    return result


def checked_cells(cells: ArrayLike, corners: int, kind: str) -> NDArray[np.int64]:
    """(m, corners) node ids of cells of a kind, read-only; a MeshError if they are something else.

    >>> checked_cells([[0, 1, 2]], 4, "quadrilaterals")
    Traceback (most recent call last):
    hexconformal.MeshError: cells must be an (m, 4) array of quadrilaterals, not (1, 3)
    """
    try:
        array = np.asarray(cells)
        result = read_only(array, np.int64)
        exact = array.dtype.kind in "iu" or (array.dtype.kind == "f" and bool((result == array).all()))
    except (TypeError, ValueError, OverflowError) as problem:
        raise MeshError(f"cells must be an (m, {corners}) array of node ids: {problem}") from problem
    if result.size == 0:
        return result if result.shape == (0, corners) else read_only(np.empty((0, corners)), np.int64)
    if result.ndim != 2 or result.shape[1] != corners:
        raise MeshError(f"cells must be an (m, {corners}) array of {kind}, not {result.shape}")
    if not exact:
        raise MeshError(f"cells must hold integer node ids, not {array.dtype}")
    return result


def checked_data(data: Mapping[str, ArrayLike], count: int, name: str) -> dict[str, NDArray[Any]]:
    """Arrays by name, read-only; a MeshError if their first axis is not `count`."""
    result = {str(key): read_only(value, None) for key, value in data.items()}
    for key, array in result.items():
        if array.ndim == 0 or len(array) != count:
            raise MeshError(f"{name}[{key!r}] must have first axis {count}, but its shape is {array.shape}")
    return result


def read_only(values: ArrayLike, dtype: Any) -> NDArray[Any]:
    """A read-only, contiguous copy; the array itself if it is one already."""
    array = np.asarray(values)
    if (
        type(values) is np.ndarray
        and array.base is None
        and not array.flags.writeable
        and array.flags.c_contiguous
        and dtype in (None, array.dtype)
    ):
        return array
    with np.errstate(invalid="ignore"):
        result = np.array(array, dtype=dtype, order="C", copy=True, subok=False)
    result.setflags(write=False)
    return result
