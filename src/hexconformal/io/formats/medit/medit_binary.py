"""New coordinates in Medit's binary meshes (.meshb); all else stays byte for byte."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ....common import ReadError

__all__ = ["put_points"]

_DIMENSION, _VERTICES, _END = 3, 4, 54
_TYPES = {1: ("i4", "f4", "i4"), 2: ("i4", "f8", "i4"), 3: ("i4", "f8", "i8"), 4: ("i8", "f8", "i8")}


def put_points(data: bytes, points: NDArray[np.float64]) -> tuple[bytes, bool]:
    """The bytes of a file with other places of its vertices, and whether they are of single precision."""
    order = "<" if data[:4] == b"\1\0\0\0" else ">"
    version = int(np.frombuffer(data, order + "i4", 1, 4)[0])
    if version not in _TYPES:
        raise ReadError(f"version {version} of .meshb is not supported")
    integer, real, position = (np.dtype(order + kind) for kind in _TYPES[version])
    place, dimension = 8, 3
    while place + 4 + position.itemsize <= len(data):
        keyword = int(np.frombuffer(data, order + "i4", 1, place)[0])
        following = int(np.frombuffer(data, position, 1, place + 4)[0])
        body = place + 4 + position.itemsize
        if keyword == _DIMENSION:
            dimension = int(np.frombuffer(data, order + "i4", 1, body)[0])
            following = body + 4
        elif keyword == _VERTICES:
            count = int(np.frombuffer(data, integer, 1, body)[0])
            record = np.dtype([("point", real, (dimension,)), ("ref", integer)])
            start = body + integer.itemsize
            rows = np.frombuffer(data, record, count, start).copy()
            rows["point"] = points[:, :dimension]
            return data[:start] + rows.tobytes() + data[start + rows.nbytes :], version == 1
        if keyword == _END or following <= place:
            break
        place = following
    raise ReadError("it has no vertices")
