"""Target shapes: the frames W that the distortion is measured against, and target volumes."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common import MeshError, OptionError, array_of_numbers, first_ids
from ..elements import (
    HEXAHEDRON,
    QUADRATURE_RULES,
    WEDGE,
    TypedRows,
    are_collapsed,
    cell_volumes,
    corner_scaled_jacobian,
    edge_lengths,
    rows_by_type,
    shape_gradients,
)
from ..mesh import SERIAL, HexMesh, NormalizedMesh, Space

__all__ = ["STRETCHED_ASPECTS", "aspect_ratios", "inverse_targets", "inverses_of", "jacobian_matrices"]
__all__ += ["normalized_target", "stretched_boxes", "target_volumes"]

Field = NDArray[np.float64]

_BRICK = 0.8  # scaled Jacobian from which a stretched cell is a brick
_FLAT = 1e6  # aspect ratio from which it has no shape to keep
STRETCHED_ASPECTS = (2.0, 5.0)  # aspect ratios between which a cell passes from a cube to its own box


def jacobian_matrices(points: Field, cells: NDArray[np.int64], quadrature: str = "gauss") -> Field:
    """Jacobian matrices dX / d xi (m, q, 3, 3) at the quadrature points; column i is the derivative along axis i."""
    return _jacobians(points, cells, shape_gradients(QUADRATURE_RULES[quadrature]()[0]))


def _jacobians(points: Field, cells: NDArray[np.int64], gradients: Field) -> Field:
    x = points[cells] - points[cells[:, :1]]
    return np.einsum("qai,mak->mqki", gradients, x)


def normalized_target(target: Any, normalized: NormalizedMesh) -> Any:
    """A target for a normalized mesh: "auto" is decided, points of a reference mesh are scaled, others have no unit."""
    if isinstance(target, str) and target == "auto":
        boxes = stretched_boxes(normalized.points, normalized.cells, normalized.space)
        return "cube" if boxes is None else boxes
    if isinstance(target, str) or np.shape(target) not in (normalized.points.shape, (len(normalized.cells), 3)):
        return target
    values = np.asarray(target, dtype=np.float64)
    if len(values) == len(normalized.points):
        return normalized.from_user(values[normalized.node_ids])
    return values[normalized.cell_ids]


def inverse_targets(
    target: Any, points: Field, cells: NDArray[np.int64], quadrature: str, ids: NDArray[Any] | None = None
) -> Field | None:
    """Inverse target frames W^-1 for :class:`hexconformal.energy.distortion_term.DistortionTerm`.

    Parameters
    ----------
    target
        "cube", of other types their ideal; "a:b:c" or three positive numbers, the edge lengths of a box, where all
        cells are hexahedra; (m, 3) edge lengths of a box for every cell; "input" for the cells' own shapes; or (n, 3)
        points of a reference mesh with the same cells.
    points, cells
        The mesh.
    quadrature
        "gauss" or "corners".
    ids
        (m,) ids by which messages name the cells; default their places.

    Returns
    -------
    (1, 1, 3, 3) or (m, q, 3, 3) inverse frames, None for the cube; of other types than hexahedra, those of the corners
    that are measured come first.

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
            raise OptionError(f"target must be 'auto', 'cube', 'input' or 'a:b:c', not {target!r}") from None
    values = array_of_numbers("target", target, "a name, edge lengths or points")
    if values.shape == (3,):
        if not (np.isfinite(values).all() and (values > 0).all()):
            raise OptionError(f"target must have three positive edge lengths, not {values.tolist()}")
        if others := int(are_collapsed(cells).sum()):
            raise OptionError(
                f"target must not be one box where there are other cells than hexahedra, {others} here, but 'auto', "
                "'cube', 'input', a box for every cell, or points of a reference mesh"
            )
        return np.diag(1.0 / values)[None, None]
    if values.shape == points.shape:
        return _inverted(values, cells, quadrature, ids)
    if values.shape == (len(cells), 3):
        if not (np.isfinite(values).all() and (values > 0).all()):
            raise OptionError("target must have positive edge lengths for every cell")
        inverses = _boxes(values)
        for one in rows_by_type(cells):
            if one.cell_type is not HEXAHEDRON:
                # Stretched along the axes of the ideal, of which wedges alone have one that is like no other.
                inverses[one.rows, 0] = one.cell_type.inverse_target @ inverses[one.rows, 0]
        return inverses
    expected = f"three edge lengths or reference points of shape {points.shape}"
    raise OptionError(f"target must be {expected}, not of shape {values.shape}")


def _inverted(points: Field, cells: NDArray[np.int64], quadrature: str, ids: NDArray[Any] | None) -> Field:
    if not np.isfinite(points[cells]).all():
        raise MeshError("the reference mesh of target must be valid; this one has NaN or infinite coordinates")
    frames = _frames(points, cells, quadrature)
    bad = np.flatnonzero((np.linalg.det(frames) <= 0).any(axis=1))
    if len(bad):
        bad = bad if ids is None else np.sort(ids[bad])
        raise MeshError(f"the reference mesh of target must be valid; its inverted or flat cells: {first_ids(bad)}")
    return np.linalg.inv(frames).astype(np.float64, copy=False)


def _frames(points: Field, cells: NDArray[np.int64], quadrature: str) -> Field:
    """(m, q, 3, 3) Jacobian matrices where cells are measured; those of types with fewer such places come first."""
    parts = [(one, _jacobians(points, cells[one.rows], one.rule(quadrature)[0])) for one in rows_by_type(cells)]
    if len(parts) == 1:
        return parts[0][1]
    frames = np.tile(np.eye(3), (len(cells), max(part.shape[1] for _, part in parts), 1, 1))
    for one, part in parts:
        frames[one.rows, : part.shape[1]] = part
    return frames


def inverses_of(inverses: Field, one: TypedRows, count: int) -> Field:
    """Of inverse target frames of `count` cells those of the cells of a type, whose ideal it is where none are given.

    Parameters
    ----------
    inverses
        As :func:`inverse_targets` has them, empty for cubes.
    """
    if len(inverses) == count:
        return inverses[one.rows]
    return inverses if one.cell_type is HEXAHEDRON else np.array(one.cell_type.inverse_target)[None, None]


def stretch_of(inverses: Field) -> Field:
    """Ratio (m,) of the longest to the shortest edge that inverse target frames ask for, 1 for cubes.

    Examples
    --------
    >>> stretch_of(np.diag([1.0, 0.5, 0.25])[None, None])
    array([4.])
    """
    edges = np.linalg.norm(np.linalg.inv(inverses), axis=2)
    return np.asarray(edges.max(axis=(1, 2)) / edges.min(axis=(1, 2)))


def aspect_ratios(points: Field, cells: NDArray[np.int64]) -> Field:
    """Aspect ratio (m,) of every cell: its longest over its shortest mean edge, of the three directions.

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> aspect_ratios(*box((1, 1, 1), (1.0, 2.0, 3.0)))
    array([3.])
    """
    lengths = _mean_lengths(points, cells)
    return np.asarray(lengths.max(axis=1) / lengths.min(axis=1))


def _mean_lengths(points: Field, cells: NDArray[np.int64]) -> Field:
    means = edge_lengths(points, cells).reshape(-1, 3, 4).mean(axis=2)
    for one in rows_by_type(cells):
        if one.cell_type is WEDGE:
            # Both directions of the triangles are one: they stay equilateral.
            nodes = one.own_nodes(cells)[:, WEDGE.edges]
            lengths = np.linalg.norm(points[nodes[..., 1]] - points[nodes[..., 0]], axis=2)
            means[one.rows, :2], means[one.rows, 2] = lengths[:, :6].mean(axis=1)[:, None], lengths[:, 6:].mean(axis=1)
        elif one.cell_type is not HEXAHEDRON:
            means[one.rows] = 1.0
    return np.maximum(means, 1e-300)


def stretched_boxes(points: Field, cells: NDArray[np.int64], space: Space = SERIAL) -> Field | None:
    """Box targets for cells that are stretched on purpose, cubes for the others; None if no cell is stretched.

    Stretched cells that are bricks, as in boundary layers, are meant to be so; where most of them are skewed, the
    mesh is distorted instead, and no cell counts. A cell of aspect 5 or more keeps its proportions, one of aspect up
    to 2, inverted or as good as flat, becomes a cube; between, it keeps a part. Wedges keep the ratio of their height
    to their triangles in the same way, where they stand upright; tetrahedra and pyramids become their ideals.

    Returns
    -------
    (m, 3) edge lengths whose geometric mean is one.
    """
    lengths = _mean_lengths(points, cells)
    aspect = lengths.max(axis=1) / lengths.min(axis=1)
    low, high = STRETCHED_ASPECTS
    degree = np.clip(np.log(aspect / low) / np.log(high / low), 0.0, 1.0)
    if not space.anywhere(bool(degree.any())):
        return None
    quality = corner_scaled_jacobian(points, cells)
    for one in rows_by_type(cells):
        if one.cell_type is WEDGE:
            quality[one.rows] = _uprightness(points, one.own_nodes(cells))
    degree[(quality <= 0.0) | (aspect >= _FLAT)] = 0.0
    if not space.anywhere(bool(degree.any())) or space.median(quality[degree > 0.0]) < _BRICK:
        return None
    mean = np.exp(np.log(lengths).mean(axis=1, keepdims=True))
    return (lengths / mean) ** degree[:, None]


def _uprightness(points: Field, wedges: NDArray[np.int64]) -> Field:
    """(k,) smallest cosine between the heights of a wedge (k, 6) and the normals of its triangles."""
    edges = points[wedges[:, WEDGE.neighbours]] - points[wedges][:, :, None]
    normals = np.cross(edges[:, :, 0], edges[:, :, 1])
    sizes = np.linalg.norm(normals, axis=2) * np.linalg.norm(edges[:, :, 2], axis=2)
    return np.asarray(((normals * edges[:, :, 2]).sum(axis=2) / np.maximum(sizes, 1e-300)).min(axis=1))


def _boxes(lengths: Field) -> Field:
    inverses = np.zeros((len(lengths), 1, 3, 3))
    inverses[:, 0, [0, 1, 2], [0, 1, 2]] = 1.0 / lengths
    return inverses


def target_volumes(sizes: Any, mesh: HexMesh, valid: NDArray[np.bool_]) -> Field:
    """Target volumes of the cells of a mesh.

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
    >>> target_volumes("input", mesh, np.array([True, False]))
    array([3., 0.])
    """
    if isinstance(sizes, str):
        if sizes == "free":
            return np.empty(0)
        if sizes == "input":
            return np.where(valid, cell_volumes(mesh.points, mesh.cells), 0.0)
        if sizes not in mesh.cell_data:
            known = ", ".join(map(repr, mesh.cell_data)) or "none"
            raise OptionError(f"sizes must be 'input', 'free' or a cell array, not {sizes!r}; there are: {known}")
        sizes = mesh.cell_data[sizes]
    try:
        volumes = np.array(sizes, dtype=np.float64)
    except (TypeError, ValueError):
        raise OptionError(f"sizes must be 'input', 'free', a cell array or volumes, not {sizes!r}") from None
    if volumes.shape != (len(mesh.cells),):
        shape = volumes.shape
        raise OptionError(f"sizes must be one volume for each of the {len(mesh.cells)} cells, not of shape {shape}")
    bad = np.flatnonzero(~(np.isfinite(volumes) & (volumes > 0.0)))
    if len(bad):
        ids = first_ids(bad, mesh.cell_labels)
        raise OptionError(f"sizes must be volumes, finite and positive; those of cells {ids} are not")
    return volumes
