"""What a perfect cell looks like: the target frames W that the distortion is measured against."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .elements import corner_rule, gauss_rule, shape_gradients
from .errors import MeshError, OptionError, first_ids

__all__ = ["cell_frames", "cell_volumes", "inverse_targets"]

Field = NDArray[np.float64]


def cell_frames(points: Field, cells: NDArray[np.int64], quadrature: str = "gauss") -> Field:
    """Frames dX / d xi (m, q, 3, 3) at the quadrature points; column i is the derivative along axis i."""
    rule = gauss_rule() if quadrature == "gauss" else corner_rule()
    x = points[cells] - points[cells[:, :1]]
    return np.einsum("qai,mak->mqki", shape_gradients(rule[0]), x)


def cell_volumes(points: Field, cells: NDArray[np.int64]) -> Field:
    """Volume (m,) of every trilinear cell, exact by the 2 x 2 x 2 Gauss rule."""
    return np.linalg.det(cell_frames(points, cells)).mean(axis=1)


def inverse_targets(target: Any, points: Field, cells: NDArray[np.int64], quadrature: str) -> Field | None:
    """Inverse target frames W^-1 for :class:`hexconformal.assembly.Distortion`.

    Parameters
    ----------
    target
        "cube"; "a:b:c" or three positive numbers, the edge lengths of a box; "input" for the cells' own
        shapes; or (n, 3) points of a reference mesh with the same cells.
    points, cells
        The mesh.
    quadrature
        "gauss" or "corners".

    Returns
    -------
    (1, 1, 3, 3) or (m, q, 3, 3) inverse frames, None for the cube.

    Raises
    ------
    OptionError
        If the target is none of these.
    MeshError
        If a reference cell is inverted or flat.

    Examples
    --------
    >>> inverse_targets("1:1:2", np.zeros((0, 3)), np.zeros((0, 8), int), "gauss")[0, 0].diagonal()
    array([1. , 1. , 0.5])
    """
    if isinstance(target, str):
        if target == "cube":
            return None
        if target == "input":
            return _inverted(points, cells, quadrature)
        try:
            target = [float(part) for part in target.split(":")]
        except ValueError:
            raise OptionError(f"target is 'cube', 'input' or 'a:b:c', not {target!r}") from None
    values = np.asarray(target, dtype=np.float64)
    if values.shape == (3,):
        if not (np.isfinite(values).all() and (values > 0).all()):
            raise OptionError(f"a box target has three positive edge lengths, not {values.tolist()}")
        return np.diag(1.0 / values)[None, None]
    if values.shape == points.shape:
        return _inverted(values, cells, quadrature)
    raise OptionError(f"a target is three edge lengths or reference points of shape {points.shape}, not {values.shape}")


def _inverted(points: Field, cells: NDArray[np.int64], quadrature: str) -> Field:
    frames = cell_frames(points, cells, quadrature)
    bad = np.flatnonzero((np.linalg.det(frames) <= 0).any(axis=1))
    if len(bad):
        raise MeshError(f"target shapes need a valid reference mesh; its inverted or flat cells: {first_ids(bad)}")
    inverses: Field = np.linalg.inv(frames)
    return inverses
