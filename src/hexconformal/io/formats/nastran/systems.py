"""Coordinate systems of decks: rectangular, cylindrical and spherical ones by three points, in basic coordinates."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ....common import ReadError
from .cards import Card
from .reals import parse_real

__all__ = ["CoordinateSystems", "System"]

Floats = NDArray[np.float64]
_DEPTH = 100


@dataclass(frozen=True)
class System:
    """A coordinate system: "R", "C" or "S", its origin, and its axes as the rows of a matrix."""

    kind: str
    origin: Floats
    axes: Floats

    def to_basic(self, local: Floats) -> Floats:
        """(n, 3) positions of points with these coordinates; angles are in degrees."""
        first, second, third = local.T
        if self.kind == "C":
            angle = np.radians(second)
            local = np.stack([first * np.cos(angle), first * np.sin(angle), third], axis=1)
        elif self.kind == "S":
            polar, angle = np.radians(second), np.radians(third)
            flat = first * np.sin(polar)
            local = np.stack([flat * np.cos(angle), flat * np.sin(angle), first * np.cos(polar)], axis=1)
        return self.origin + local @ self.axes

    def from_basic(self, points: Floats, old: Floats) -> Floats:
        """(n, 3) coordinates of points, with angles in the turn that the old coordinates have."""
        x, y, z = ((points - self.origin) @ self.axes.T).T
        if self.kind == "R":
            return np.stack([x, y, z], axis=1)
        place = 1 if self.kind == "C" else 2
        flat = np.hypot(x, y)
        angle = np.degrees(np.arctan2(y, x))
        angle = np.where(flat > 0, angle + 360 * np.rint((old[:, place] - angle) / 360), old[:, place])
        if self.kind == "C":
            return np.stack([flat, angle, z], axis=1)
        return np.stack([np.hypot(flat, z), np.degrees(np.arctan2(flat, z)), angle], axis=1)


class CoordinateSystems:
    """The systems that a deck defines, each put together when it is asked for."""

    def __init__(self, cards: list[Card]) -> None:
        self._cards: dict[int, Card] = {}
        for card in cards:
            if card.name in ("CORD1R", "CORD1C", "CORD1S"):
                for start in (0, 4):
                    if any(card.fields[start : start + 4]):
                        self._cards[card.integer(start)] = card
            elif card.name.startswith("CORD"):
                self._cards[card.integer(0)] = card
        self._known: dict[int, System] = {0: System("R", np.zeros(3), np.eye(3))}

    def __getitem__(self, number: int) -> System:
        return self._find(number, 0)

    def _find(self, number: int, depth: int) -> System:
        if number not in self._known:
            card = self._cards.get(number)
            if card is None:
                raise ReadError(f"the coordinate system {number} is used, but is not there")
            if card.name not in ("CORD2R", "CORD2C", "CORD2S"):
                raise ReadError(
                    f"nodes in the coordinate system {number} are not supported: it is given by {card.name}; "
                    "give it by CORD2R, CORD2C or CORD2S"
                )
            if depth > _DEPTH:
                raise ReadError(f"the coordinate system {number} is defined by itself")
            reference = self._find(card.integer(1, 0), depth + 1)
            numbers = [parse_real(text) for text in (card.fields + [""] * 9)[2:11]]
            self._known[number] = _by_points(card.name[-1], reference.to_basic(np.reshape(numbers, (3, 3))), number)
        return self._known[number]


def _by_points(kind: str, points: Floats, number: int) -> System:
    """The system with the origin in the first point, its z axis through the second, the third beside its x axis."""
    origin, on_z, beside_x = points
    z = on_z - origin
    y = np.cross(z, beside_x - origin)
    x = np.cross(y, z)
    lengths = [np.linalg.norm(axis) for axis in (x, y, z)]
    if min(lengths) == 0.0:
        raise ReadError(f"the points of the coordinate system {number} are on a line")
    return System(kind, origin, np.stack([x, y, z]) / np.array(lengths)[:, None])
