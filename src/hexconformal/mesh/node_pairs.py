"""Pairs of nodes that the file of a mesh couples."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["NodePairs"]


@dataclass(frozen=True, eq=False)
class NodePairs:
    """Pairs of nodes that move together, as one statement of a file has them.

    Attributes
    ----------
    nodes
        (k, 2) indices of nodes.
    source
        What the file calls them, such as "$Periodic".
    affine
        (4, 4) map that takes the second node of each pair to the first; None where the file tells none.
    several
        True where pairs may be of several maps, such as those of all pairs of faces.
    left_out
        What else the file couples, and is not understood, in words; "" for nothing.
    """

    nodes: NDArray[np.int64]
    source: str
    affine: NDArray[np.float64] | None = None
    several: bool = False
    left_out: str = ""
