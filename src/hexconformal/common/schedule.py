"""Schedules: tuned numbers, each with its range, in frozen dataclasses."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from math import isfinite
from typing import Any

from .errors import OptionError

__all__ = ["Schedule", "tuned"]


def tuned(default: Any, low: float = 0.0, high: float = float("inf")) -> Any:
    """A field for a number that was tuned, or a tuple of such, and the range it must lie in."""
    return field(default=default, metadata={"range": (low, high)})


@dataclass(frozen=True)
class Schedule:
    """Base of schedules: the numbers of one stage, which are checked when one is made.

    The docstring of a schedule says what each number is, its unit, and why it has its value. The rows of
    `benchmarks/ablation.md` show what happens where it has another.

    Raises
    ------
    OptionError
        If a number is not finite, or out of its range.

    Examples
    --------
    >>> @dataclass(frozen=True)
    ... class Steps(Schedule):
    ...     share: float = tuned(0.5, 0.0, 1.0)
    >>> Steps(2.0)
    Traceback (most recent call last):
        ...
    hexconformal.OptionError: Steps: share must lie in [0, 1], not 2.0
    """

    def __post_init__(self) -> None:
        for number in fields(self):
            if "range" not in number.metadata:
                continue
            low, high = number.metadata["range"]
            values = getattr(self, number.name)
            for value in values if isinstance(values, tuple) else (values,):
                if not (isfinite(value) and low <= value <= high):
                    name = f"{type(self).__name__}: {number.name}"
                    raise OptionError(f"{name} must lie in [{low:g}, {high:g}], not {value!r}")
