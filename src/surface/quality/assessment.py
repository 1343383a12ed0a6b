"""Measures of every cell of a surface."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hexconformal.common import Serializable
from hexconformal.geometry import Faces, corner_angles, face_area_vectors, face_areas
from hexconformal.quality import Statistics, as_table, statistics

from ..energy import corner_frames, target_shapes
from ..io import as_surface_mesh
from ..mesh import Floats, Ints, SurfaceMesh
from .checks import require_numbers

__all__ = ["MEASURES", "Quality", "Summary", "WorstCell", "quality", "smallest_angles"]


@dataclass(frozen=True)
class WorstCell:
    """One of the cells of smallest conformality, and where it is."""

    id: int
    conformality: float
    min_angle: float
    centre: tuple[float, float, float]


@dataclass(frozen=True, repr=False)
class Summary(Serializable):
    """The quality of a surface in a few numbers.

    Attributes
    ----------
    count
        Number of cells.
    inverted
        Cells that have no area at some corner, or are folded there.
    min_angle, mean_angle, max_angle
        Smallest corner angle, mean over cells of their smallest, largest; degrees.
    radius_ratio, scaled_jacobian
        Smallest over the triangles, over the quadrilaterals; NaN if there are none.
    dilatation, mean_dilatation
        Largest and mean quasiconformal dilatation s1 / s2 against equilateral triangles and squares; 1 is perfect.
    area_ratio
        Largest cell area over the smallest.
    area
        Of the whole surface.
    distributions
        Of each measure of `Quality` that its cells have, by name.
    worst
        Cells of smallest conformality, worst first.
    """

    count: int
    inverted: int
    min_angle: float
    mean_angle: float
    max_angle: float
    radius_ratio: float
    scaled_jacobian: float
    dilatation: float
    mean_dilatation: float
    area_ratio: float
    area: float
    distributions: dict[str, Statistics]
    worst: tuple[WorstCell, ...]

    def __str__(self) -> str:
        ratio = f"largest cell over smallest {self.area_ratio:.4g}"
        head = f"{self.count} cells, {self.inverted} inverted, area {self.area:.6g}, {ratio}"
        return "\n".join([head, *as_table(self.distributions)])

    __repr__ = __str__


@dataclass(frozen=True, eq=False, repr=False)
class Quality:
    """Measures of every cell, each an (m,) array: triangles first, then quadrilaterals.

    s1 >= s2 are the singular values of the derivative of the map from the equilateral triangle, or at a corner of the
    square, to the cell; of a quadrilateral the worst corner counts.

    Attributes
    ----------
    min_angle, max_angle
        Degrees; the largest is more than 180 where a quadrilateral is not convex.
    radius_ratio
        Twice the inradius over the circumradius of triangles, 1 if equilateral; NaN for quadrilaterals.
    scaled_jacobian
        Sine of the worst corner of a quadrilateral, signed by its area vector; NaN for triangles.
    conformality
        s2 / s1, negative at corners that are turned over against the cell's area vector; in [-1, 1], 1 is perfect.
    dilatation
        Quasiconformal dilatation K = s1 / s2; inf where a corner has no area.
    conformal_distortion
        2 (s1 - s2)^2 / (s1 s2) = 2 (K + 1 / K) - 4; 0 is perfect.
    area
        In squares of the mesh's unit.
    mesh
        The surface that was measured.
    """

    min_angle: Floats
    max_angle: Floats
    radius_ratio: Floats
    scaled_jacobian: Floats
    conformality: Floats
    dilatation: Floats
    conformal_distortion: Floats
    area: Floats
    mesh: SurfaceMesh

    def __repr__(self) -> str:
        return f"Quality({len(self.area)} cells, smallest angle {self.min_angle.min():.4g})"

    def summary(self, worst: int = 0) -> Summary:
        """Reduce to a few numbers.

        Parameters
        ----------
        worst
            How many of the worst cells to name.

        Examples
        --------
        >>> quality((np.eye(3), [[0, 1, 2]])).summary().dilatation
        1.0
        """
        present = {name: values[~np.isnan(values)] for name, values in self.arrays().items()}
        found = {name: statistics(values) for name, values in present.items() if len(values)}
        nothing = float("nan")
        return Summary(
            count=len(self.area),
            inverted=int((self.conformality <= 0).sum()),
            min_angle=found["min_angle"].min,
            mean_angle=found["min_angle"].mean,
            max_angle=found["max_angle"].max,
            radius_ratio=found["radius_ratio"].min if "radius_ratio" in found else nothing,
            scaled_jacobian=found["scaled_jacobian"].min if "scaled_jacobian" in found else nothing,
            dilatation=found["dilatation"].max,
            mean_dilatation=found["dilatation"].mean,
            area_ratio=float(self.area.max() / self.area.min()) if self.area.min() > 0 else float("inf"),
            area=float(self.area.sum()),
            distributions=found,
            worst=tuple(self._described(place) for place in self.worst(worst).tolist()),
        )

    def worst(self, count: int) -> Ints:
        """Places (count,) of the cells of smallest conformality, worst first."""
        return np.argsort(self.conformality, kind="stable")[: max(count, 0)]

    def corners(self, place: int) -> Floats:
        """(3 or 4, 3) corners of a cell."""
        cells, t = self.mesh.cells, len(self.mesh.cells.triangles)
        return self.mesh.points[cells.triangles[place] if place < t else cells.quads[place - t]]

    def _described(self, place: int) -> WorstCell:
        x, y, z = self.corners(place).mean(axis=0).tolist()
        labels = self.mesh.rows if self.mesh.cell_labels is None else self.mesh.cell_labels
        number = place if labels is None else labels[place].item()
        return WorstCell(number, float(self.conformality[place]), float(self.min_angle[place]), (x, y, z))

    def arrays(self) -> dict[str, Floats]:
        """All measures by name, to put them on a mesh."""
        return {name: getattr(self, name) for name in MEASURES}


MEASURES = tuple(field.name for field in fields(Quality) if field.name != "mesh")


def smallest_angles(points: Floats, cells: Faces) -> Floats:
    """(m,) smallest corner angle of each cell, degrees."""
    return np.degrees(np.concatenate([corner_angles(points, table).min(axis=1) for table in cells.tables]))


def quality(mesh: Any) -> Quality:
    """Measure every cell of a surface.

    Parameters
    ----------
    mesh
        Anything :func:`surface.as_surface_mesh` takes.

    Raises
    ------
    MeshError
        If it is no surface of triangles and quadrilaterals, or has points that are not finite.

    Examples
    --------
    >>> corners = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    >>> measured = quality((corners, [[0, 1, 2], [0, 2, 3]]))
    >>> measured.min_angle.round(6), measured.radius_ratio.round(4)
    (array([45., 45.]), array([0.8284, 0.8284]))
    >>> float(quality((corners, [[0, 1, 2, 3]])).dilatation[0])
    1.0
    """
    surface = as_surface_mesh(mesh)
    require_numbers(surface)
    x, cells = surface.points, surface.cells
    t, q = len(cells.triangles), len(cells.quads)
    least, largest = _angles(x, cells)
    inverse, distortion = _corners(x, cells)
    return Quality(
        min_angle=least,
        max_angle=largest,
        radius_ratio=np.concatenate([_radius_ratio(x, cells.triangles), np.full(q, np.nan)]),
        scaled_jacobian=np.concatenate([np.full(t, np.nan), _scaled_jacobian(x, cells.quads)]),
        conformality=inverse,
        dilatation=_dilatation(distortion),
        conformal_distortion=distortion,
        area=face_areas(x, cells),
        mesh=surface,
    )


def _angles(points: Floats, cells: Faces) -> tuple[Floats, Floats]:
    """Smallest and largest angle of each cell, degrees."""
    triangles, quads = (np.degrees(corner_angles(points, table)) for table in (cells.triangles, cells.quads))
    inside = np.where(_sines(points, cells.quads) < 0, 360 - quads, quads)
    least = np.concatenate([triangles.min(axis=1), quads.min(axis=1)])
    return least, np.concatenate([triangles.max(axis=1), inside.max(axis=1)])


def _corners(points: Floats, cells: Faces) -> tuple[Floats, Floats]:
    """Worst conformality and worst distortion of the corners of each cell."""
    frames = corner_frames(cells, target_shapes("equilateral", points, cells))
    f1, f2 = (np.stack(f, axis=1) for f in frames.derivatives(points))
    normal = np.cross(f1, f2)
    area = np.linalg.norm(normal, axis=1)
    dirichlet = (f1**2).sum(axis=1) + (f2**2).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        distortion = np.where(area > 0, np.maximum(2 * dirichlet / area - 4, 0.0), np.inf)
    turned: NDArray[np.bool_] = (normal * face_area_vectors(points, cells)[frames.owners]).sum(axis=1) < 0
    worst, least = np.zeros(len(cells)), np.ones(len(cells))
    np.maximum.at(worst, frames.owners, distortion)
    np.minimum.at(least, frames.owners, np.where(turned, -1.0, 1.0) / _dilatation(distortion))
    return least, worst


def _dilatation(distortion: Floats) -> Floats:
    """K >= 1 from 2 (K + 1 / K) - 4."""
    half = 1 + distortion / 4
    return np.asarray(half + np.sqrt(np.maximum((half - 1) * (half + 1), 0.0)))


def _radius_ratio(points: Floats, triangles: Ints) -> Floats:
    x = points[triangles]
    a, b, c = (np.linalg.norm(x[:, i] - x[:, i - 1], axis=1) for i in range(3))
    product = a * b * c
    return np.asarray((b + c - a) * (c + a - b) * (a + b - c) / np.where(product > 0, product, np.inf))


def _scaled_jacobian(points: Floats, quads: Ints) -> Floats:
    return _sines(points, quads).min(axis=1, initial=1.0)


def _sines(points: Floats, quads: Ints) -> Floats:
    """(q, 4) sine of each corner, signed by the area vector."""
    x = points[quads]
    a, b = np.roll(x, -1, axis=1) - x, np.roll(x, 1, axis=1) - x
    normal = np.cross(x[:, 2] - x[:, 0], x[:, 3] - x[:, 1])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = normal / np.where(length > 0, length, np.inf)
    size = np.linalg.norm(a, axis=2) * np.linalg.norm(b, axis=2)
    return np.asarray((np.cross(a, b) * normal[:, None]).sum(axis=2) / np.where(size > 0, size, np.inf))
