"""How good is every cell of a surface."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from hexconformal.quality import json_safe

from .geometry import Cells, Floats, cell_angles, cell_areas
from .reference import reference_shapes

__all__ = ["Quality", "Summary", "quality", "smallest_angles"]


@dataclass(frozen=True)
class Summary:
    """The quality of a surface in a few numbers.

    Attributes
    ----------
    count
        Number of cells.
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
    """

    count: int
    min_angle: float
    mean_angle: float
    max_angle: float
    radius_ratio: float
    scaled_jacobian: float
    dilatation: float
    mean_dilatation: float
    area_ratio: float
    area: float

    def to_dict(self) -> dict[str, Any]:
        """Plain types, as JSON takes them; what is not finite becomes None."""
        plain: dict[str, Any] = json_safe(self)
        return plain


@dataclass(frozen=True, eq=False)
class Quality:
    """Measures of every cell, each an (m,) array: triangles first, then quadrilaterals.

    Attributes
    ----------
    min_angle, max_angle
        Degrees.
    radius_ratio
        Twice the inradius over the circumradius of triangles, 1 if equilateral; NaN for quadrilaterals.
    scaled_jacobian
        Sine of the worst corner of a quadrilateral, signed by its area vector; NaN for triangles.
    conformal_distortion
        2 (s1 - s2)^2 / (s1 s2) against the equilateral triangle or the square, worst corner.
    dilatation
        s1 / s2 there.
    area
        In squares of the mesh's unit.
    """

    min_angle: Floats
    max_angle: Floats
    radius_ratio: Floats
    scaled_jacobian: Floats
    conformal_distortion: Floats
    dilatation: Floats
    area: Floats

    def summary(self) -> Summary:
        """Reduce to a few numbers."""

        def least(values: Floats) -> float:
            return float(np.nanmin(values)) if np.isfinite(values).any() else float("nan")

        return Summary(
            count=len(self.area),
            min_angle=float(self.min_angle.min()),
            mean_angle=float(self.min_angle.mean()),
            max_angle=float(self.max_angle.max()),
            radius_ratio=least(self.radius_ratio),
            scaled_jacobian=least(self.scaled_jacobian),
            dilatation=float(self.dilatation.max()),
            mean_dilatation=float(self.dilatation.mean()),
            area_ratio=float(self.area.max() / max(self.area.min(), 1e-300)),
            area=float(self.area.sum()),
        )

    def arrays(self) -> dict[str, Floats]:
        """All measures by name, to put them on a mesh."""
        return {field.name: getattr(self, field.name) for field in fields(self)}


def smallest_angles(points: Floats, cells: Cells) -> Floats:
    """(m,) smallest corner angle of each cell, degrees."""
    return np.degrees(np.concatenate([cell_angles(points, table).min(axis=1) for table in cells.groups()]))


def quality(mesh: Any) -> Quality:
    """Measure every cell of a surface.

    Parameters
    ----------
    mesh
        Anything :func:`surface.as_surface_mesh` takes.

    Examples
    --------
    >>> corners = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    >>> measured = quality((corners, [[0, 1, 2], [0, 2, 3]]))
    >>> measured.min_angle.round(6), measured.radius_ratio.round(4)
    (array([45., 45.]), array([0.8284, 0.8284]))
    >>> float(quality((corners, [[0, 1, 2, 3]])).dilatation[0])
    1.0
    """
    from .energy import corner_frames
    from .mesh import as_surface_mesh

    surface = as_surface_mesh(mesh)
    x, cells = surface.points, surface.cells
    t, q = len(cells.triangles), len(cells.quads)
    angles = [np.degrees(cell_angles(x, table)) for table in cells.groups()]
    a, b, c = (np.linalg.norm(x[cells.triangles[:, i]] - x[cells.triangles[:, i - 1]], axis=1) for i in range(3))
    product = a * b * c
    ratio = (b + c - a) * (c + a - b) * (a + b - c) / np.where(product > 0, product, np.inf)
    frames = corner_frames(cells, reference_shapes("equilateral", x, cells))
    f1, f2 = (np.stack(f, axis=1) for f in frames.derivatives(x))
    area = np.linalg.norm(np.cross(f1, f2), axis=1)
    dirichlet = (f1**2).sum(axis=1) + (f2**2).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        distortion = np.where(area > 0, np.maximum(2 * dirichlet / area - 4, 0.0), np.inf)
    worst = np.zeros(t + q)
    np.maximum.at(worst, frames.owners, distortion)
    # 2 (K + 1 / K) - 4 = g
    half = 1 + worst / 4
    return Quality(
        min_angle=np.concatenate([part.min(axis=1) for part in angles]),
        max_angle=np.concatenate([part.max(axis=1) for part in angles]),
        radius_ratio=np.concatenate([ratio, np.full(q, np.nan)]),
        scaled_jacobian=np.concatenate([np.full(t, np.nan), _scaled_jacobian(x, cells)]),
        conformal_distortion=worst,
        dilatation=half + np.sqrt(np.maximum(half**2 - 1, 0.0)),
        area=cell_areas(x, cells),
    )


def _scaled_jacobian(points: Floats, cells: Cells) -> Floats:
    x = points[cells.quads]
    a, b = np.roll(x, -1, axis=1) - x, np.roll(x, 1, axis=1) - x
    normal = np.cross(x[:, 2] - x[:, 0], x[:, 3] - x[:, 1])
    normal = normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    size = np.linalg.norm(a, axis=2) * np.linalg.norm(b, axis=2)
    sine = (np.cross(a, b) * normal[:, None]).sum(axis=2) / np.where(size > 0, size, np.inf)
    return np.asarray(sine.min(axis=1)) if len(sine) else np.empty(0)
