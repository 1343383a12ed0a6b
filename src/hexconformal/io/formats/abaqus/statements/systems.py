"""Coordinate systems of nodes (*SYSTEM, *NODE with SYSTEM), and the places of instances of parts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from .....common import ReadError
from .lines import split_fields
from .tables import read_real

__all__ = ["Placement", "System", "read_placement", "read_system"]

Field = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Placement:
    """A rigid motion x -> rotation (x + before) + after; None stands for what does not move."""

    rotation: Field | None = None
    before: Field | None = None
    after: Field | None = None

    def apply(self, points: Field) -> Field:
        """Points (n, 3) of the part in their place."""
        moved = points if self.before is None else points + self.before
        moved = moved if self.rotation is None else moved @ self.rotation.T
        return moved if self.after is None else moved + self.after

    def invert(self, points: Field) -> Field:
        """Points (n, 3) in their place as the part has them."""
        moved = points if self.after is None else points - self.after
        moved = moved if self.rotation is None else moved @ self.rotation
        return moved if self.before is None else moved - self.before


@dataclass(frozen=True, eq=False)
class System:
    """Rectangular ("R"), cylindrical ("C") or spherical ("S") coordinates, angles in degrees, in a placed frame."""

    kind: Literal["R", "C", "S"] = "R"
    place: Placement = Placement()

    def to_points(self, coordinates: Field) -> Field:
        """Points (n, 3) of coordinates (n, 3): x y z, r theta z, or r theta phi."""
        x, y, z = coordinates.T
        if self.kind == "C":
            cos, sin = _cos_sin(y)
            x, y = x * cos, x * sin
        elif self.kind == "S":
            (cos, sin), (cos_up, sin_up) = _cos_sin(y), _cos_sin(z)
            x, y, z = x * cos_up * cos, x * cos_up * sin, x * sin_up
        return self.place.apply(np.stack([x, y, z], axis=1))

    def from_points(self, points: Field, near: Field) -> Field:
        """Coordinates (n, 3) of points; angles are those nearest to the angles of other coordinates."""
        x, y, z = self.place.invert(points).T
        if self.kind != "R":
            radius, angle = np.hypot(x, y), np.degrees(np.arctan2(y, x))
            angle += 360.0 * np.round((near[:, 1] - angle) / 360.0)
            if self.kind == "S":
                radius, z = np.sqrt(radius**2 + z**2), np.degrees(np.arctan2(z, radius))
            x, y = radius, angle
        return np.stack([x, y, z], axis=1)


def _cos_sin(degrees: Field) -> tuple[Field, Field]:
    """Exact where the angle is a multiple of 90 degrees."""
    turns = np.round(degrees / 90.0)
    rest = np.radians(degrees - 90.0 * turns)
    cos, sin = np.cos(rest), np.sin(rest)
    quarter = np.mod(turns, 4)
    return np.select([quarter == 0, quarter == 1, quarter == 2], [cos, -sin, -cos], sin), np.select(
        [quarter == 0, quarter == 1, quarter == 2], [sin, cos, -sin], -cos
    )


def read_system(data: list[str]) -> Placement:
    """The frame of *SYSTEM: its origin, a point on its x axis, and a point in its x-y plane.

    Without the last its z axis is that of space; without lines it is that of space altogether.

    Raises
    ------
    ReadError
        If the points lie on a line.
    """
    if not data:
        return Placement()
    fields = split_fields(data[0])
    numbers = [*map(read_real, fields), *[0.0] * 6][:6]
    origin = np.array(numbers[:3])
    if not any(fields[3:6]):
        return Placement(after=origin)
    x = np.array(numbers[3:]) - origin
    z = np.array([0.0, 0.0, 1.0])
    if len(data) > 1:
        z = np.cross(x, np.array([*map(read_real, split_fields(data[1])), 0.0, 0.0, 0.0][:3]) - origin)
    else:
        x[2] = 0.0
    if not x.any() or not z.any():
        raise ReadError("the points of *SYSTEM must not lie on a line")
    x, z = x / np.linalg.norm(x), z / np.linalg.norm(z)
    return Placement(rotation=np.stack([x, np.cross(z, x), z], axis=1), after=origin)


def read_placement(data: list[str]) -> Placement:
    """The place of an instance: a translation, and after it a turn about the axis through two points by an angle.

    Raises
    ------
    ReadError
        If the two points are one.
    """
    if not data:
        return Placement()
    shift = np.array([*map(read_real, split_fields(data[0])), 0.0, 0.0, 0.0][:3])
    before = shift if shift.any() else None
    if len(data) == 1:
        return Placement(before=before)
    numbers = [*map(read_real, split_fields(data[1])), *[0.0] * 7]
    start, axis, angle = np.array(numbers[:3]), np.array(numbers[3:6]) - np.array(numbers[:3]), numbers[6]
    if not axis.any():
        raise ReadError("the axis that an instance is turned about must go through two points")
    x, y, z = axis / np.linalg.norm(axis)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    cos, sin = (part.item() for part in _cos_sin(np.array([angle])))
    rotation = np.eye(3) + sin * cross + (1.0 - cos) * (cross @ cross)
    return Placement(rotation, shift - start, start)
