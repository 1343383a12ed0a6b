"""What every kind of options checks: names that are known, choices, numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields
from numbers import Real
from typing import Any, TypeVar

from .errors import OptionError

__all__ = ["made_of", "require_choice", "require_choices", "require_numbers"]

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
    if value not in allowed:
        names = ", ".join(repr(c) for c in allowed[:-1]) + f" or {allowed[-1]!r}"
        raise OptionError(f"{name} is {names}, not {value!r}")


def require_numbers(options: Any, *names: str) -> None:
    """Refuse text and the like in fields of options that are numbers (or None).

    >>> require_numbers(range(3), "start")
    >>> require_numbers("text", "upper")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    hexconformal.errors.OptionError: upper is a number, not <built-in method upper of str object at 0x...>
    """
    for name in names:
        value = getattr(options, name)
        if value is not None and not isinstance(value, Real):
            raise OptionError(f"{name} is a number, not {value!r}")
