"""Arrays as text in the page: each once, compressed, bit by bit what they were."""

from __future__ import annotations

import base64
import zlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["ArrayStore"]

_INTEGERS = (np.uint8, np.int16, np.int32)
_LEVEL = 6  # higher ones take twice as long for one percent


class ArrayStore:
    """The arrays of a page. An array that is put in again is stored once.

    Attributes
    ----------
    texts
        What each array is encoded as, by its number: base64 of the zlib stream of its bytes, in which all first bytes
        of its numbers come before all second ones, which compresses better.

    Examples
    --------
    >>> store = ArrayStore()
    >>> store.put(np.array([[3, 4], [5, 6]]))
    {'id': 0, 'type': 'uint8', 'shape': [2, 2]}
    >>> store.put(np.array([0.5]))["type"], len(store.texts)
    ('float64', 2)
    """

    def __init__(self) -> None:
        self.texts: list[str] = []
        self._known: dict[tuple[str, bytes], dict[str, Any]] = {}

    def put(self, values: NDArray[Any]) -> dict[str, Any]:
        """Store an array; returns its reference, as the page's contents hold it.

        Integers are stored in as many bytes as they need, those beyond 32 bits as float64: exactly up to 2^53, which is
        as much as a browser's numbers hold.
        """
        array = np.ascontiguousarray(_storable(np.asarray(values)))
        data = array.tobytes()
        key = (f"{array.dtype} {array.shape}", data)
        if key not in self._known:
            planes = np.frombuffer(data, dtype=np.uint8).reshape(-1, array.itemsize).T
            packed = zlib.compress(planes.tobytes(), _LEVEL)
            reference = {"id": len(self.texts), "type": array.dtype.name, "shape": list(array.shape)}
            self.texts.append(base64.b64encode(packed).decode("ascii"))
            self._known[key] = reference
        return self._known[key]


def _storable(values: NDArray[Any]) -> NDArray[Any]:
    """The values in a type of number that a browser has."""
    if values.dtype.kind == "b":
        return values.astype(np.uint8)
    if values.dtype.kind in "iu":
        low, high = (int(values.min()), int(values.max())) if values.size else (0, 0)
        for kind in _INTEGERS:
            if np.iinfo(kind).min <= low and high <= np.iinfo(kind).max:
                return values.astype(kind)
        return values.astype(np.float64)
    return values if values.dtype == np.float32 else values.astype(np.float64)
