"""The `remesh` command, and what `quality` needs for surfaces."""

from __future__ import annotations

import os
from argparse import Namespace
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from hexconformal.commands import Kind, carry_out
from hexconformal.errors import OptionError

from .convert import as_pyvista
from .io import EXTENSIONS, read, write
from .mesh import SurfaceMesh
from .options import Options, Record
from .plots import before_after, histogram, worst_cells
from .quality import Quality, quality, smallest_angles
from .reference import REFERENCES
from .remesh import Remeshing

__all__ = ["KIND", "line", "remesh"]

KIND = Kind(quality, Quality.arrays, histogram, worst_cells, write, EXTENSIONS, "conformality")


def remesh(arguments: Namespace) -> int:
    """Remesh a surface; an interruption leaves what was reached."""
    known = {
        name: value for name, value in vars(arguments).items() if name in {field.name for field in fields(Options)}
    }
    options = Options(**{**known, "features": _angle(arguments.features), "reference": _reference(arguments.reference)})

    def prepare() -> _Remesh:
        mesh = read(arguments.input)
        return _Remesh(mesh, replace(options, fixed=_nodes(mesh, arguments.fixed)))

    return carry_out(arguments, EXTENSIONS, prepare)


def line(record: Record) -> str:
    """One iteration in one line.

    Examples
    --------
    >>> line(Record(7, 0.4685, 0.01336, 0.25, 31.5, 52.25, 0, 3, 1.36))
    '7  energy 4.685e-01  decrease 1.3e-02  smallest angle 31.50  mean 52.25  1.4 s'
    """
    return (
        f"{record.iteration}  energy {record.energy:.3e}  decrease {record.decrease:.1e}  smallest angle "
        f"{record.min_angle:.2f}  mean {record.mean_angle:.2f}  {record.seconds:.1f} s"
    )


@dataclass(frozen=True)
class _Remesh:
    """Remesh a surface, as a :class:`hexconformal.job.Work`."""

    mesh: SurfaceMesh
    options: Options
    rescue = "rescued.vtu"

    def start(self) -> Remeshing:
        return Remeshing(self.mesh, self.options)

    def rehearsed(self) -> SurfaceMesh:
        zero = np.zeros(len(self.mesh.cells))
        return self.mesh.replaced(cell_data={"min_angle": zero, "min_angle_change": zero})

    def write(self, path: str | os.PathLike[str], mesh: Any) -> list[str]:
        return write(path, mesh)

    def told(self, record: Any) -> str:
        return line(record)

    def frame(self, run: Any) -> Any:
        points = run.points
        return as_pyvista(self.mesh.replaced(points, {"min_angle": smallest_angles(points, self.mesh.cells)}))

    def histogram(self, path: str, result: Any) -> None:
        histogram(path, self.mesh, self.mesh.replaced(result.points))

    def picture(self, path: str, result: Any) -> None:
        before_after(path, self.mesh, self.mesh.replaced(result.points))

    def worst(self, path: str, result: Any) -> None:
        worst_cells(path, self.mesh, self.mesh.replaced(result.points))


def _angle(given: Any) -> float | None:
    if given == "none":
        return None
    try:
        return float(given)
    except ValueError as problem:
        raise OptionError(f"features is an angle in degrees, or none, not {given!r}") from problem


def _reference(given: str) -> Any:
    """A name, or the points of a mesh in a file."""
    return given if given in REFERENCES or not os.path.splitext(given)[1] else read(given).points


def _nodes(mesh: SurfaceMesh, name: str | None) -> Any:
    """Nodes where the point array of that name is not zero."""
    if name is None:
        return None
    if name not in mesh.point_data:
        names = ", ".join(sorted(mesh.point_data)) or "none"
        raise OptionError(f"fixed={name!r} names no point array; there are: {names}")
    return np.asarray(mesh.point_data[name]).reshape(len(mesh.points), -1).any(axis=1)
