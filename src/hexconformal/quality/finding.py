"""One finding of a check."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["Finding", "error", "warning"]


@dataclass(frozen=True, eq=False)
class Finding:
    """One finding of a check.

    Attributes
    ----------
    kind
        A word for programs: "not finite", "bad index", "repeated nodes", "duplicate cells", "crowded faces",
        "no boundary", "mirrored", "foreign order" (errors); "coincident points", "flat cells", "wrapped cells",
        "hanging nodes", "doubled corners", "pieces", "unreferenced points", "reversed wedges",
        "split faces" (warnings).
    severity
        "error" if the mesh has to be refused, "warning" if it can be worked on.
    ids
        The points or cells concerned.
    message
        Problem, number, first ids, and what to do.
    """

    kind: str
    severity: Literal["error", "warning"]
    ids: NDArray[np.int64]
    message: str


def error(kind: str, ids: ArrayLike, message: str) -> Finding:
    """A reason to refuse the mesh."""
    return Finding(kind, "error", np.asarray(ids, dtype=np.int64), message)


def warning(kind: str, ids: ArrayLike, message: str) -> Finding:
    """Something doubtful."""
    return Finding(kind, "warning", np.asarray(ids, dtype=np.int64), message)
