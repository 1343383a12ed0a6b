"""What a perfect cell looks like: the target frames W that the distortion is measured against, and how large it is."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common import MeshError, OptionError, array_of_numbers, first_ids
from ..elements import RULES, cell_volumes, corner_scaled_jacobian, edge_lengths, shape_gradients
from ..mesh import HexMesh, NormalizedMesh

__all__ = ["STRETCHED", "aspects", "cell_frames", "inverse_targets", "normalized_target"]
__all__ += ["stretched_boxes", "wanted_volumes"]

Field = NDArray[np.float64]

_BRICK = 0.8  # scaled Jacobian from which a stretched cell is a brick
STRETCHED = (2.0, 5.0)  # aspect ratios between which a cell passes from a cube to its own box


def cell_frames(points: Field, cells: NDArray[np.int64], quadrature: str = "gauss") -> Field:
    """Frames dX / d xi (m, q, 3, 3) at the quadrature points; column i is the derivative along axis i."""
    places, _ = RULES[quadrature]()
    x = points[cells] - points[cells[:, :1]]
    return np.einsum("qai,mak->mqki", shape_gradients(places), x)


def normalized_target(target: Any, frame: NormalizedMesh) -> Any:
    """A target in the frame of a run: "auto" is decided, points of a reference mesh are scaled, others have no unit."""
    if isinstance(target, str) and target == "auto":
        boxes = stretched_boxes(frame.start, frame.cells)
        return "cube" if boxes is None else boxes
    if isinstance(target, str) or np.shape(target) not in (frame.start.shape, (len(frame.cells), 3)):
        return target
    values = np.asarray(target, dtype=np.float64)
    return frame.from_user(values[frame.nodes]) if len(values) == len(frame.nodes) else values[frame.order]


def inverse_targets(
    target: Any, points: Field, cells: NDArray[np.int64], quadrature: str, ids: NDArray[np.int64] | None = None
) -> Field | None:
    """Inverse target frames W^-1 for :class:`hexconformal.energy.distortion_energy.Distortion`.

    Parameters
    ----------
    target
        "cube"; "a:b:c" or three positive numbers, the edge lengths of a box; (m, 3) edge lengths of a box for
        every cell; "input" for the cells' own shapes; or (n, 3) points of a reference mesh with the same cells.
    points, cells
        The mesh.
    quadrature
        "gauss" or "corners".
    ids
        (m,) what to call the cells in messages, if not by their places.

    Returns
    -------
    (1, 1, 3, 3) or (m, q, 3, 3) inverse frames, None for the cube.

    Raises
    ------
    OptionError
        If the target is none of these.
    MeshError
        If a reference cell is inverted or flat, or has coordinates that are not finite.

    Examples
    --------
    >>> inverse_targets("1:1:2", np.zeros((0, 3)), np.zeros((0, 8), int), "gauss")[0, 0].diagonal()
    array([1. , 1. , 0.5])
    """
    if isinstance(target, str):
        if target == "cube":
            return None
        if target == "input":
            return _inverted(points, cells, quadrature, ids)
        try:
            target = [float(part) for part in target.split(":")]
        except ValueError:
            raise OptionError(f"target is 'auto', 'cube', 'input' or 'a:b:c', not {target!r}") from None
    values = array_of_numbers("target", target, "a name, edge lengths or points")
    if values.shape == (3,):
        if not (np.isfinite(values).all() and (values > 0).all()):
            raise OptionError(f"a box target has three positive edge lengths, not {values.tolist()}")
        return np.diag(1.0 / values)[None, None]
    if values.shape == points.shape:
        return _inverted(values, cells, quadrature, ids)
    if values.shape == (len(cells), 3):
        if not (np.isfinite(values).all() and (values > 0).all()):
            raise OptionError("box targets have positive edge lengths")
        return _boxes(values)
    raise OptionError(f"a target is three edge lengths or reference points of shape {points.shape}, not {values.shape}")


def _inverted(points: Field, cells: NDArray[np.int64], quadrature: str, ids: NDArray[np.int64] | None) -> Field:
    if not np.isfinite(points[cells]).all():
        raise MeshError("target shapes need a valid reference mesh; this one has NaN or infinite coordinates")
    frames = cell_frames(points, cells, quadrature)
    bad = np.flatnonzero((np.linalg.det(frames) <= 0).any(axis=1))
    if len(bad):
        bad = bad if ids is None else np.sort(ids[bad])
        raise MeshError(f"target shapes need a valid reference mesh; its inverted or flat cells: {first_ids(bad)}")
    return np.linalg.inv(frames).astype(np.float64, copy=False)


def aspects(points: Field, cells: NDArray[np.int64]) -> Field:
    """Aspect (m,) of every cell: its longest over its shortest mean edge, of the three directions.

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> aspects(*box((1, 1, 1), (1.0, 2.0, 3.0)))
    array([3.])
    """
    lengths = _mean_lengths(points, cells)
    return np.asarray(lengths.max(axis=1) / lengths.min(axis=1))


def _mean_lengths(points: Field, cells: NDArray[np.int64]) -> Field:
    return np.maximum(edge_lengths(points, cells).reshape(-1, 3, 4).mean(axis=2), 1e-300)


def stretched_boxes(points: Field, cells: NDArray[np.int64]) -> Field | None:
    """Boxes for cells that are stretched on purpose, cubes for the others; None where no cell is.

    Stretched cells that are bricks, as in boundary layers, are meant to be so; where most of them are skewed, the
    mesh is distorted instead, and no cell counts. A cell of aspect 5 or more keeps its proportions, one of aspect up
    to 2, or inverted, becomes a cube; between, it keeps a part.

    Returns
    -------
    (m, 3) edge lengths whose geometric mean is one.
    """
    lengths = _mean_lengths(points, cells)
    aspect = lengths.max(axis=1) / lengths.min(axis=1)
    low, high = STRETCHED
    degree = np.clip(np.log(aspect / low) / np.log(high / low), 0.0, 1.0)
    if not degree.any():
        return None
    quality = corner_scaled_jacobian(points, cells)
    degree[quality <= 0.0] = 0.0
    if not degree.any() or np.median(quality[degree > 0.0]) < _BRICK:
        return None
    mean = np.exp(np.log(lengths).mean(axis=1, keepdims=True))
    return (lengths / mean) ** degree[:, None]


def _boxes(lengths: Field) -> Field:
    inverses = np.zeros((len(lengths), 1, 3, 3))
    inverses[:, 0, [0, 1, 2], [0, 1, 2]] = 1.0 / lengths
    return inverses


def wanted_volumes(sizes: Any, mesh: HexMesh, valid: NDArray[np.bool_]) -> Field:
    """Volumes that the cells of a mesh should have.

    Parameters
    ----------
    sizes
        "input": those they have, if they are valid; "free"; the name of a cell array; or (m,) volumes.
    mesh
        The mesh; its unit is that of the volumes.
    valid
        (m,) which cells are valid.

    Returns
    -------
    (m,) volumes, 0 for cells without; empty if none has one.

    Raises
    ------
    OptionError
        If the name is unknown, or the volumes are not one for every cell, finite and positive.

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> mesh = HexMesh(*box((1, 1, 2), (1.0, 2.0, 3.0)))
    >>> wanted_volumes("input", mesh, np.array([True, False]))
    array([3., 0.])
    """
    if isinstance(sizes, str):
        if sizes == "free":
            return np.empty(0)
        if sizes == "input":
            return np.where(valid, cell_volumes(mesh.points, mesh.cells), 0.0)
        if sizes not in mesh.cell_data:
            known = ", ".join(map(repr, mesh.cell_data)) or "none"
            raise OptionError(f"sizes is 'input', 'free' or a cell array, not {sizes!r}; there are: {known}")
        sizes = mesh.cell_data[sizes]
    try:
        wanted = np.array(sizes, dtype=np.float64)
    except (TypeError, ValueError):
        raise OptionError(f"sizes is 'input', 'free', the name of a cell array, or volumes, not {sizes!r}") from None
    if wanted.shape != (len(mesh.cells),):
        raise OptionError(f"sizes has one volume for each of the {len(mesh.cells)} cells, not shape {wanted.shape}")
    bad = np.flatnonzero(~(np.isfinite(wanted) & (wanted > 0.0)))
    if len(bad):
        raise OptionError(f"sizes are volumes, finite and positive; those of cells {first_ids(bad)} are not")
    return wanted
