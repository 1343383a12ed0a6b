"""Coordinates in the 20 characters that CalculiX reads of a number."""

from __future__ import annotations

import numpy as np

__all__ = ["LARGEST_LENGTH", "format_real"]

LARGEST_LENGTH = 20


def format_real(value: float) -> str:
    """A number in at most 20 characters: itself if there is room, otherwise the nearest that there is room for.

    >>> format_real(0.1), format_real(1e-300), format_real(-1 / 3)
    ('0.1', '1e-300', '-0.3333333333333333')
    >>> format_real(-7.049960123456789e-10), format_real(9.716542197571454e-11)
    ('-704996012345679e-24', '9716542197571454e-26')
    """
    text = repr(value)
    if len(text) <= LARGEST_LENGTH:
        return text
    for digits in range(17, 0, -1):
        # Digits that are not needed to tell the number from its neighbours are not written.
        mantissa, _, exponent = np.format_float_scientific(
            value, precision=digits - 1, unique=True, exp_digits=1, trim="-"
        ).partition("e")
        text = _shortest(mantissa, int(exponent))
        if len(text) <= LARGEST_LENGTH:
            return text
    raise AssertionError(value)


def _shortest(mantissa: str, exponent: int) -> str:
    """A number by its digits: with a point alone, with a point and an exponent, or as a whole number with one."""
    sign, digits = mantissa[: mantissa.startswith("-")], mantissa.lstrip("-").replace(".", "")
    texts = []
    if -4 <= exponent < 0:
        texts.append(f"{sign}.{'0' * (-1 - exponent)}{digits}")
    elif 0 <= exponent < len(digits):
        texts.append(f"{sign}{digits[: exponent + 1]}.{digits[exponent + 1 :]}")
    if exponent:
        texts.append(f"{mantissa}{'' if '.' in mantissa else '.'}e{exponent}")
    texts.append(f"{sign}{digits}e{exponent - len(digits) + 1}")
    return min(texts, key=len)
