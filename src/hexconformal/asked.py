"""What every kind of options checks: names that are known, choices, numbers, yes or no."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields
from numbers import Real
from reprlib import repr as shortened
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from .errors import OptionError

__all__ = [
    "array_of_numbers",
    "is_number",
    "made_of",
    "require_choice",
    "require_choices",
    "require_flags",
    "require_number",
    "require_numbers",
]

Made = TypeVar("Made")


def made_of(kind: type[Made], given: Mapping[str, Any]) -> Made:
    """Options of a dataclass from keywords; an unknown one is refused with the names that there are.

    >>> from hexconformal import Options
    >>> made_of(Options, {"bounday": "fixed"})  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    hexconformal.errors.OptionError: unknown option 'bounday'; there are: boundary, conserve_volume, ...
    """
    known = {field.name for field in fields(kind)}  # type: ignore[arg-type]
    unknown = sorted(set(given) - known)
    if unknown:
        raise OptionError(f"unknown option {unknown[0]!r}; there are: {', '.join(sorted(known))}")
    return kind(**given)


def require_choices(options: Any, choices: Mapping[str, Sequence[str]]) -> None:
    """Refuse values that are none of the choices of their field."""
    for name, allowed in choices.items():
        require_choice(name, getattr(options, name), allowed)


def require_choice(name: str, value: Any, allowed: Sequence[str]) -> None:
    """Refuse a value that is none of the choices.

    >>> require_choice("operator", "plastic", ("harmonic", "elastic"))
    Traceback (most recent call last):
    hexconformal.errors.OptionError: operator is 'harmonic' or 'elastic', not 'plastic'
    """
    if not isinstance(value, str) or value not in allowed:
        names = ", ".join(repr(c) for c in allowed[:-1]) + f" or {allowed[-1]!r}"
        raise OptionError(f"{name} is {names}, not {value!r}")


def is_number(value: Any) -> bool:
    """Whether it is a real number, of Python or numpy; True and False are none.

    >>> is_number(np.float32(0.5)), is_number(True), is_number("1"), is_number(1j)
    (True, False, False, False)
    """
    return isinstance(value, Real) and not isinstance(value, bool)


def require_number(name: str, value: Any) -> None:
    """Refuse what is no number.

    >>> require_number("tolerance", None)
    Traceback (most recent call last):
    hexconformal.errors.OptionError: tolerance is a number, not None
    """
    if not is_number(value):
        raise OptionError(f"{name} is a number, not {shortened(value)}")


def require_numbers(options: Any, *names: str, optional: Sequence[str] = ()) -> None:
    """Refuse fields of options that are no numbers; those that are optional may be None."""
    for name in (*names, *optional):
        value = getattr(options, name)
        if value is not None or name not in optional:
            require_number(name, value)


def require_flags(options: Any, *names: str, optional: Sequence[str] = ()) -> None:
    """Refuse fields of options that are neither True nor False; those that are optional may be None."""
    for name in (*names, *optional):
        value = getattr(options, name)
        if not isinstance(value, (bool, np.bool_)) and (value is not None or name not in optional):
            raise OptionError(f"{name} is True or False, not {shortened(value)}")


def array_of_numbers(name: str, values: Any, expected: str = "an array of numbers") -> NDArray[np.float64]:
    """The values as an array of float64; refuses those that are not `expected`, text and complex numbers among them.

    >>> array_of_numbers("outputs", ["1", "2"])
    Traceback (most recent call last):
    hexconformal.errors.OptionError: outputs is an array of numbers, not ['1', '2']
    """
    try:
        array = np.asarray(values)
    except ValueError:  # rows of different lengths
        array = np.empty(0, dtype=object)
    if array.dtype.kind not in "iuf":
        raise OptionError(f"{name} is {expected}, not {shortened(values)}")
    return array.astype(np.float64)
