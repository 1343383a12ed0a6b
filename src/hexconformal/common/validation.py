"""Validation of options: known names, choices, numbers, booleans, masks of nodes."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields
from numbers import Integral, Real
from reprlib import repr as shortened
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from .errors import OptionError, first_ids, first_names

__all__ = [
    "array_of_numbers",
    "as_mask",
    "is_number",
    "options_from",
    "require_choice",
    "require_choices",
    "require_counts",
    "require_flags",
    "require_items",
    "require_number",
    "require_numbers",
]

OptionsType = TypeVar("OptionsType")
ItemType = TypeVar("ItemType")


def options_from(kind: type[OptionsType], given: Mapping[str, Any]) -> OptionsType:
    """Options of a dataclass from keywords; an unknown one is refused with the names that there are.

    >>> from hexconformal import Options
    >>> options_from(Options, {"bounday": "fixed"})  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    hexconformal.OptionError: unknown option 'bounday'; there are: boundary, conserve_volume, ...
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
    hexconformal.OptionError: operator must be 'harmonic' or 'elastic', not 'plastic'
    """
    if not isinstance(value, str) or value not in allowed:
        names = ", ".join(repr(c) for c in allowed[:-1]) + f" or {allowed[-1]!r}"
        raise OptionError(f"{name} must be {names}, not {value!r}")


def is_number(value: Any) -> bool:
    """True for a real number, of Python or numpy; True and False are none.

    >>> is_number(np.float32(0.5)), is_number(True), is_number("1"), is_number(1j)
    (True, False, False, False)
    """
    return isinstance(value, Real) and not isinstance(value, bool)


def require_number(name: str, value: Any) -> None:
    """Refuse what is no number.

    >>> require_number("eps", None)
    Traceback (most recent call last):
    hexconformal.OptionError: eps must be a number, not None
    """
    if not is_number(value):
        raise OptionError(f"{name} must be a number, not {shortened(value)}")


def require_numbers(options: Any, *names: str, optional: Sequence[str] = ()) -> None:
    """Refuse fields of options that are no numbers; those that are optional may be None."""
    for name in (*names, *optional):
        value = getattr(options, name)
        if value is not None or name not in optional:
            require_number(name, value)


def require_counts(options: Any, *names: str, optional: Sequence[str] = ()) -> None:
    """Refuse fields that are no whole numbers, negative or too large; those that are optional may be None."""
    for name in (*names, *optional):
        value = getattr(options, name)
        if value is None and name in optional:
            continue
        if not isinstance(value, Integral) or isinstance(value, bool):
            raise OptionError(f"{name} must be a whole number, not {shortened(value)}")
        if value < 0:
            raise OptionError(f"{name} must be 0 or more, not {value!r}")
        if int(value) > sys.maxsize:
            raise OptionError(f"{name} must be at most {sys.maxsize}, not {value!r}")


def require_flags(options: Any, *names: str, optional: Sequence[str] = ()) -> None:
    """Refuse fields of options that are neither True nor False; those that are optional may be None."""
    for name in (*names, *optional):
        value = getattr(options, name)
        if not isinstance(value, (bool, np.bool_)) and (value is not None or name not in optional):
            raise OptionError(f"{name} must be True or False, not {shortened(value)}")


def require_items(name: str, values: Iterable[ItemType], kind: type[ItemType]) -> list[ItemType]:
    """The values as a list; refuses what holds none, or others than those of a kind.

    >>> require_items("lengths", [1.5, "2"], float)
    Traceback (most recent call last):
    hexconformal.OptionError: lengths must hold nothing but float, and at index 1 has '2'
    """
    if not isinstance(values, Iterable) or isinstance(values, str):
        raise OptionError(f"{name} must be a sequence of {kind.__name__}, not {shortened(values)}")
    found = list(values)
    if not found:
        raise OptionError(f"{name} must hold at least one {kind.__name__}")
    for index, value in enumerate(found):
        if not isinstance(value, kind):
            raise OptionError(
                f"{name} must hold nothing but {kind.__name__}, and at index {index} has {shortened(value)}"
            )
    return found


def array_of_numbers(name: str, values: Any, expected: str = "an array of numbers") -> NDArray[np.float64]:
    """The values as an array of float64; refuses those that are not `expected`, text and complex numbers among them.

    >>> array_of_numbers("outputs", ["1", "2"])
    Traceback (most recent call last):
    hexconformal.OptionError: outputs must be an array of numbers, not ['1', '2']
    """
    try:
        array = np.asarray(values)
    except ValueError:  # rows of different lengths
        array = np.empty(0, dtype=object)
    if array.dtype.kind not in "iuf":
        raise OptionError(f"{name} must be {expected}, not {shortened(values)}")
    return array.astype(np.float64)


def as_mask(value: Any, count: int, name: str, arrays: Mapping[str, NDArray[Any]] | None = None) -> NDArray[np.bool_]:
    """A mask over the points from what a user may hand in.

    Parameters
    ----------
    value
        None (nothing), booleans (n,), node ids, or booleans (n, 3) that choose components x, y, z; or the name of one
        of the `arrays`, which chooses where it is not zero.
    count
        Number of points n.
    name
        Name of the option in messages.
    arrays
        Arrays over the points, where these have names.

    Returns
    -------
    (n,) booleans, or (n, 3) if components were given.

    Raises
    ------
    OptionError
        If it is none of those, there is no such array, or ids are outside 0..n-1.

    Examples
    --------
    >>> as_mask([0, 2], 4, "fixed")
    array([ True, False,  True, False])
    >>> as_mask("wall", 2, "fixed", {"wall": np.array([0.0, 0.5])})
    array([False,  True])
    """
    if isinstance(value, str) and arrays is not None:
        if value not in arrays:
            known = first_names(map(repr, arrays)) or "none"
            raise OptionError(f"{name}={value!r} names no point array or group of the file; there are: {known}")
        value = np.asarray(arrays[value]) != 0
    try:
        array = np.asarray([] if value is None else value)
    except ValueError as problem:
        raise OptionError(f"{name} must be booleans per point or a list of point ids: {problem}") from problem
    if array.dtype == bool:
        if array.shape not in ((count,), (count, 3)):
            raise OptionError(f"{name} must be booleans of shape ({count},) or ({count}, 3), not {array.shape}")
        return array.copy()
    if array.size == 0:
        return np.zeros(count, dtype=bool)
    if array.dtype.kind not in "iu" or array.ndim != 1:
        raise OptionError(f"{name} must be booleans per point or a list of point ids, not {array.dtype} {array.shape}")
    if len(array) == count > 2 and np.isin(array, (0, 1)).all():
        raise OptionError(f"{name} must be booleans or ids, not zeros and ones: pass them as booleans")
    bad = array[(array < 0) | (array >= count)]
    if len(bad):
        raise OptionError(f"{name} must be ids in 0..{count - 1}; outside: {first_ids(bad)}")
    mask = np.zeros(count, dtype=bool)
    mask[array] = True
    return mask
