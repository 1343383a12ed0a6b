"""How good is every cell: measures at the corners of each hexahedron, and certified ones inside it."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .compiled import exact_loop
from .io import as_hex_mesh
from .threads import parallel_ranges
from .validity import bracket, edge_vectors, expand

__all__ = [
    "MEASURES",
    "Quality",
    "Statistics",
    "Summary",
    "WorstCell",
    "corner_scaled_jacobian",
    "json_safe",
    "quality",
    "statistics",
]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

MEASURES = ("scaled_jacobian", "minimum_jacobian", "shape", "conformal_distortion", "edge_ratio", "volume")
PERCENTILES = (1, 5, 25, 50, 75, 95, 99)
_DEPTH = 8


@dataclass(frozen=True)
class Statistics:
    """Distribution of one measure; ``percentiles`` maps 1, 5, 25, 50, 75, 95, 99 to a value of some cell."""

    min: float
    mean: float
    max: float
    percentiles: dict[int, float]


@dataclass(frozen=True)
class WorstCell:
    """One of the cells of smallest scaled Jacobian, and where it is."""

    id: int
    scaled_jacobian: float
    centre: tuple[float, float, float]


@dataclass(frozen=True, repr=False)
class Summary:
    """The quality of a mesh in a few numbers.

    Attributes
    ----------
    count
        Number of cells.
    inverted
        Cells whose scaled Jacobian is not positive at some corner.
    invalid
        Cells that are not proved to have det J > 0 everywhere; contains the inverted ones.
    total_volume
        Sum of the cells' volumes.
    scaled_jacobian, minimum_jacobian, shape, conformal_distortion, edge_ratio, volume
        Distribution of each measure of `Quality`.
    worst
        Cells of smallest scaled Jacobian, worst first.
    """

    count: int
    inverted: int
    invalid: int
    total_volume: float
    scaled_jacobian: Statistics
    minimum_jacobian: Statistics
    shape: Statistics
    conformal_distortion: Statistics
    edge_ratio: Statistics
    volume: Statistics
    worst: tuple[WorstCell, ...]

    def __str__(self) -> str:
        lines = [
            f"{self.count} cells, {self.inverted} inverted, {self.invalid} invalid, volume {self.total_volume:.6g}"
        ]
        lines.append(f"{'':22s}{'min':>11s}{'5 %':>11s}{'median':>11s}{'mean':>11s}{'95 %':>11s}{'max':>11s}")
        for name in MEASURES:
            s: Statistics = getattr(self, name)
            row = (s.min, s.percentiles[5], s.percentiles[50], s.mean, s.percentiles[95], s.max)
            lines.append(f"{name.replace('_', ' '):22s}" + "".join(f"{value:11.4g}" for value in row))
        return "\n".join(lines)

    __repr__ = __str__

    def to_dict(self) -> dict[str, Any]:
        """Plain types, as JSON takes them; what is not finite becomes None."""
        plain: dict[str, Any] = json_safe(self)
        return plain


@dataclass(frozen=True, eq=False, repr=False)
class Quality:
    """Measures of every cell, each an (m,) array.

    Attributes
    ----------
    scaled_jacobian
        det J over the product of the three edge lengths, smallest of the eight corners; in [-1, 1], 1 for
        bricks, 0 at the most where an edge has no length.
    minimum_jacobian
        Certified lower bound of min det J / max |det J| over the whole cell; in [-1, 1], 1 for
        parallelepipeds. Positive exactly where ``valid`` (Johnen, Weill & Remacle 2017), equation (13).
    shape
        Mean ratio 3 det^(2/3) / |J|^2, smallest of the corners; 1 for cubes, 0 where a corner is inverted.
    conformal_distortion
        E / (4 |J|^2), E the quaternionic conformal distortion, largest of the corners; 0 for cubes, at
        most 1. Blind to orientation; below 1 - sqrt(3)/2 det J cannot vanish at the corners. Equation (7).
    edge_ratio
        Longest edge over the shortest; inf where one has no length.
    volume
        Integral of det J, in the mesh's unit of length cubed; exact.
    valid
        Whether det J > 0 is proved everywhere in the cell.
    points, cells
        The mesh that was measured.
    """

    scaled_jacobian: Floats
    minimum_jacobian: Floats
    shape: Floats
    conformal_distortion: Floats
    edge_ratio: Floats
    volume: Floats
    valid: NDArray[np.bool_]
    points: Floats
    cells: Ints

    def __repr__(self) -> str:
        inverted, invalid = int((self.scaled_jacobian <= 0).sum()), int((~self.valid).sum())
        return f"Quality({len(self.valid)} cells, {inverted} inverted, {invalid} invalid)"

    def summary(self, worst: int = 5) -> Summary:
        """Reduce to a few numbers.

        Parameters
        ----------
        worst
            How many of the worst cells to name.

        Examples
        --------
        >>> from hexconformal.generate import box
        >>> summary = quality(box((2, 2, 2))).summary()
        >>> summary.count, summary.invalid, summary.shape.min
        (8, 0, 1.0)
        """
        order = np.argsort(self.scaled_jacobian, kind="stable")[: max(worst, 0)]
        centres = self.points[self.cells[order]].mean(axis=1)
        return Summary(
            count=len(self.cells),
            inverted=int((self.scaled_jacobian <= 0).sum()),
            invalid=int((~self.valid).sum()),
            total_volume=float(self.volume.sum()),
            **{name: statistics(getattr(self, name)) for name in MEASURES},
            worst=tuple(
                WorstCell(int(i), float(self.scaled_jacobian[i]), (float(x), float(y), float(z)))
                for i, (x, y, z) in zip(order, centres, strict=True)
            ),
        )

    def arrays(self) -> dict[str, NDArray[Any]]:
        """All measures by name, and `valid` as zeros and ones, to put them on a mesh."""
        return {**{name: getattr(self, name) for name in MEASURES}, "valid": self.valid.astype(np.uint8)}


def quality(mesh: Any) -> Quality:
    """Measure every cell of a mesh.

    Parameters
    ----------
    mesh
        Anything :func:`hexconformal.as_hex_mesh` takes.

    Returns
    -------
    Quality
        Measures of every cell, each an (m,) array.

    Raises
    ------
    MeshError
        If it is no hexahedral mesh.
    ReadError
        If a file cannot be read.

    Examples
    --------
    >>> from hexconformal.generate import box, sheared_block
    >>> quality(sheared_block(2, shear=1.0)).scaled_jacobian.round(4)
    array([0.7071, 0.7071, 0.7071, 0.7071, 0.7071, 0.7071, 0.7071, 0.7071])
    >>> q = quality(box((1, 1, 1), lengths=(1, 1, 2)))
    >>> q.valid, q.edge_ratio, q.conformal_distortion.round(4)
    (array([ True]), array([2.]), array([0.1667]))
    """
    hexes = as_hex_mesh(mesh)
    points, cells = np.ascontiguousarray(hexes.points), np.ascontiguousarray(hexes.cells)
    columns = np.empty((len(MEASURES), len(cells)))
    parallel_ranges(_measure, len(cells), points, cells, columns)
    return Quality(**dict(zip(MEASURES, columns, strict=True)), valid=columns[1] > 0, points=points, cells=cells)


def corner_scaled_jacobian(points: Floats, cells: Ints) -> Floats:
    """Smallest scaled Jacobian of the eight corners, nothing else: cheap enough for every iteration.

    Parameters
    ----------
    points
        (n, 3) coordinates.
    cells
        (m, 8) nodes in VTK order.

    Returns
    -------
    (m,) values in [-1, 1]; 0 at the most where an edge has no length.

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> corner_scaled_jacobian(*box((1, 1, 2)))
    array([1., 1.])
    """
    smallest = np.empty(len(cells))
    points = np.ascontiguousarray(points, dtype=np.float64)
    parallel_ranges(_corner_range, len(cells), points, np.ascontiguousarray(cells, dtype=np.int64), smallest)
    return smallest


def json_safe(value: Any) -> Any:
    """Turn dataclasses, arrays and numpy numbers into plain types; None for NaN and infinity.

    >>> json_safe({"a": np.array([1.0, np.inf]), 2: (np.int64(3), "x", None)})
    {'a': [1.0, None], '2': [3, 'x', None]}
    """
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {item.name: json_safe(getattr(value, item.name)) for item in dataclasses.fields(value)}
    if isinstance(value, dict):
        return {str(key): json_safe(item) for key, item in value.items()}
    if isinstance(value, (np.ndarray, np.generic)):
        return json_safe(value.tolist())
    if isinstance(value, (list, tuple, set, frozenset)):
        return [json_safe(item) for item in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value if value is None or isinstance(value, (bool, int, str)) else str(value)


def statistics(values: Floats) -> Statistics:
    """The distribution of a measure."""
    # Values of cells, not interpolated: exact, and infinite edge ratios do no harm.
    percentiles = np.percentile(values, PERCENTILES, method="inverted_cdf")
    return Statistics(
        float(values.min()),
        float(values.mean()),
        float(values.max()),
        dict(zip(PERCENTILES, percentiles.tolist(), strict=True)),
    )


@exact_loop
def _edge_lengths(edges, lengths):  # type: ignore[no-untyped-def]
    for k in range(12):
        lengths[k] = np.sqrt(edges[k, 0] ** 2 + edges[k, 1] ** 2 + edges[k, 2] ** 2)


@exact_loop
def _scaled(det, product):  # type: ignore[no-untyped-def]
    return max(-1.0, min(1.0, det / product)) if product > 0.0 else 0.0


@exact_loop
def _corner_range(first, last, points, cells, smallest):  # type: ignore[no-untyped-def]
    edges, lengths = np.empty((12, 3)), np.empty(12)
    for cell in range(first, last):
        edge_vectors(points, cells, cell, edges)
        _edge_lengths(edges, lengths)
        worst = 1.0
        for x in range(2):
            for y in range(2):
                for z in range(2):
                    i, j, k = y + 2 * z, 4 + x + 2 * z, 8 + x + 2 * y
                    det = (
                        (edges[i, 1] * edges[j, 2] - edges[i, 2] * edges[j, 1]) * edges[k, 0]
                        + (edges[i, 2] * edges[j, 0] - edges[i, 0] * edges[j, 2]) * edges[k, 1]
                        + (edges[i, 0] * edges[j, 1] - edges[i, 1] * edges[j, 0]) * edges[k, 2]
                    )
                    worst = min(worst, _scaled(det, lengths[i] * lengths[j] * lengths[k]))
        smallest[cell] = worst


@exact_loop
def _parallelogram(edges, i, j):  # type: ignore[no-untyped-def]
    x = edges[i, 1] * edges[j, 2] - edges[i, 2] * edges[j, 1]
    y = edges[i, 2] * edges[j, 0] - edges[i, 0] * edges[j, 2]
    z = edges[i, 0] * edges[j, 1] - edges[i, 1] * edges[j, 0]
    return np.sqrt(x * x + y * y + z * z)


@exact_loop
def _measure(first, last, points, cells, columns):  # type: ignore[no-untyped-def]
    """Fill the columns in the order of MEASURES."""
    edges, lengths, areas = np.empty((12, 3)), np.empty(12), np.empty((2, 2, 3, 3))
    stack, levels = np.empty((3 * _DEPTH + 1, 27)), np.empty(3 * _DEPTH + 1, np.int64)
    for cell in range(first, last):
        edge_vectors(points, cells, cell, edges)
        _edge_lengths(edges, lengths)
        rounding = expand(edges, areas, stack[0])

        scaled, shape, distortion = 1.0, 1.0, 0.0
        for x in range(2):
            for y in range(2):
                for z in range(2):
                    i, j, k = y + 2 * z, 4 + x + 2 * z, 8 + x + 2 * y
                    det = stack[0, 18 * z + 6 * y + 2 * x]
                    scaled = min(scaled, _scaled(det, lengths[i] * lengths[j] * lengths[k]))
                    norm = lengths[i] ** 2 + lengths[j] ** 2 + lengths[k] ** 2
                    area = _parallelogram(edges, i, j) + _parallelogram(edges, j, k) + _parallelogram(edges, k, i)
                    ratio = 3.0 * max(det, 0.0) ** (2 / 3) / norm if norm > 0.0 else 0.0
                    shape = min(shape, ratio)
                    distortion = max(distortion, 1.0 - area / norm if norm > 0.0 else 1.0)

        longest = shortest = lengths[0]
        for k in range(1, 12):
            longest, shortest = max(longest, lengths[k]), min(shortest, lengths[k])
        volume = largest = 0.0
        for k in range(27):
            volume += stack[0, k] / 27.0
            largest = max(largest, abs(stack[0, k]))
        lower, _ = bracket(stack, levels, rounding, _DEPTH)

        columns[0, cell] = scaled
        columns[1, cell] = max(-1.0, lower / largest) if largest > 0.0 else 0.0
        columns[2, cell] = shape
        columns[3, cell] = distortion
        columns[4, cell] = longest / shortest if shortest > 0.0 else np.inf
        columns[5, cell] = volume
