"""Arrays on nodes and elements ($NodeData, $ElementData) of a file of Gmsh."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....common import ReadError
from .sections import Encoding, Numbers

__all__ = ["View", "encode_view", "read_view", "view_name"]


@dataclass(frozen=True)
class View:
    """An array: its name, the tags (k,) that it is about, and values (k, c)."""

    name: str
    tags: NDArray[np.int64]
    values: NDArray[np.float64]

    def on(self, tags: NDArray[np.int64]) -> NDArray[np.float64]:
        """(n,) or (n, c) values for tags in another order; NaN where there are none."""
        order = np.argsort(self.tags, kind="stable")
        places = np.minimum(np.searchsorted(self.tags[order], tags), max(len(order) - 1, 0))
        result = np.full((len(tags), self.values.shape[1]), np.nan)
        if len(order):
            there = self.tags[order][places] == tags
            result[there] = self.values[order[places[there]]]
        return result[:, 0] if result.shape[1] == 1 else result


def view_name(body: bytes) -> str:
    """The name of an array, which its section begins with."""
    lines = body.split(b"\n", 2)
    return lines[1].decode("utf-8", "surrogateescape").strip().strip('"') if len(lines) > 2 else ""


def read_view(body: bytes, encoding: Encoding, section: str) -> View:
    """The body of $NodeData or $ElementData."""
    place, tags = 0, []
    for _ in range(3):  # words, real numbers and integers, each with its count on a line before
        count, place = _line(body, place, section)
        if not count.strip().isdigit() or int(count) > len(body):
            raise ReadError(f"${section} must begin with counts")
        lines = []
        for _ in range(int(count)):
            line, place = _line(body, place, section)
            lines.append(line)
        tags.append(lines)
    _, components, rows = (int(line) for line in tags[2][:3])
    numbers = Numbers(body[place:], encoding, section)
    if encoding.ascii:
        table = numbers.take("double", rows * (1 + components)).reshape(rows, 1 + components)
        return View(view_name(body), table[:, 0].astype(np.int64), table[:, 1:])
    records = numbers.records(_record(encoding, components), rows)
    return View(view_name(body), records["tag"].astype(np.int64), records["values"].astype(np.float64))


def encode_view(section: str, view: View, encoding: Encoding) -> bytes:
    """A section $NodeData or $ElementData."""
    rows, components = view.values.shape
    head = f'${section}\n1\n"{view.name}"\n1\n0.0\n3\n0\n{components}\n{rows}\n'
    if encoding.ascii:
        lines = encoding.encoded("double", view.values).splitlines(keepends=True)
        body = b"".join(b"%d %s" % pair for pair in zip(view.tags.tolist(), lines, strict=True))
    else:
        records = np.empty(rows, _record(encoding, components))
        records["tag"], records["values"] = view.tags, view.values
        body = records.tobytes() + b"\n"
    return head.encode("utf-8", "surrogateescape") + body + f"$End{section}\n".encode()


def _record(encoding: Encoding, components: int) -> np.dtype[Any]:
    return np.dtype([("tag", encoding.dtype("int")), ("values", encoding.dtype("double"), (components,))])


def _line(body: bytes, place: int, section: str) -> tuple[bytes, int]:
    end = body.find(b"\n", place)
    if end < 0:
        raise ReadError(f"${section} is truncated")
    return body[place:end], end + 1
