"""Pairs of nodes that face each other on periodic boundaries ($Periodic), and whether they still do."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....common import ReadError
from .nodes import NodeTags
from .sections import Encoding, Numbers

__all__ = ["parted_pairs", "read_periodic"]

_TOLERANCE = 1e-9  # of a change of the gap of a pair, relative to the size of the mesh


def read_periodic(body: bytes, encoding: Encoding, tags: NodeTags) -> list[Any]:
    """The links of the body of $Periodic as meshio has them.

    Returns
    -------
    For each link its dimension, the tags of the entity and its master, the 16 numbers of the affine map from the
    master (or None), and the indices (k, 2) of nodes and their masters.
    """
    if encoding.version.startswith("4"):
        numbers = Numbers(body, encoding, "Periodic")
        links = []
        for _ in range(numbers.one("size")):
            dimension, entity, master = numbers.take("int", 3).tolist()
            affine = numbers.take("double", numbers.one("size"))
            pairs = numbers.take("size", 2 * numbers.one("size")).reshape(-1, 2)
            links.append([dimension, (entity, master), affine, tags.indices(pairs)])
        return links
    return _links_2(body, tags)


def _links_2(body: bytes, tags: NodeTags) -> list[Any]:
    lines = iter(body.decode("ascii", "replace").splitlines())
    links = []
    try:
        for _ in range(int(next(lines))):
            dimension, entity, master = (int(word) for word in next(lines).split())
            line, affine = next(lines), None
            if line.strip().startswith("Affine"):
                affine, line = np.array(line.split()[1:], dtype=np.float64), next(lines)
            pairs = np.array([next(lines).split() for _ in range(int(line))], dtype=np.int64).reshape(-1, 2)
            links.append([dimension, (entity, master), affine, tags.indices(pairs)])
    except StopIteration:
        raise ReadError("$Periodic is truncated") from None
    return links


def parted_pairs(links: list[Any], before: NDArray[np.float64], after: NDArray[np.float64]) -> int:
    """The number of pairs of nodes that no longer face each other as they did."""
    size = float(np.ptp(before, axis=0).max(initial=0.0))
    parted: set[tuple[int, int]] = set()
    for _, _, affine, pairs in links:
        matrix = np.eye(4) if affine is None or len(affine) != 16 else np.reshape(affine, (4, 4))
        slave, master = pairs[:, 0], pairs[:, 1]
        # The change of the gap: a pair may be some way apart in the file itself.
        change = (after - before)[slave] - (after - before)[master] @ matrix[:3, :3].T
        moved = np.linalg.norm(change, axis=1) > _TOLERANCE * size
        parted |= {tuple(pair) for pair in pairs[moved].tolist()}
    return len(parted)
