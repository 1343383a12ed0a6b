"""Real numbers as Nastran has them: no more characters than a field, exponents with E, D or neither."""

from __future__ import annotations

import re
from decimal import Decimal

from ....common import ReadError

__all__ = ["format_real", "parse_real"]

_REAL = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+))(?:[EDed]?([+-]?\d+))?$")


def parse_real(text: str) -> float:
    """The number in a field; 0 if the field is empty.

    >>> parse_real("7.0+4"), parse_real("1.5D-3"), parse_real("-.25"), parse_real("")
    (70000.0, 0.0015, -0.25, 0.0)
    """
    text = text.strip()
    if not text:
        return 0.0
    found = _REAL.match(text)
    if found is None:
        raise ReadError(f"{text!r} is not a number")
    return float(f"{found[1]}e{found[2] or 0}")


def format_real(value: float, width: int) -> str:
    """A number in at most so many characters, with a decimal point, as near to it as they allow.

    >>> format_real(0.5, 8), format_real(-1 / 3, 8), format_real(1e-7 / 3, 8), format_real(-1e-17 / 3, 16)
    ('0.5', '-.333333', '3.3333-8', '-3.3333333333-18')
    """
    value = float(value) + 0.0  # no minus before zero
    text = _with_point(repr(value))
    if len(text) <= width:
        return text
    candidates = [_fixed(value, width), _scientific(value, width)]
    return min((text for text in candidates if text), key=lambda text: abs(parse_real(text) - value))


def _with_point(text: str) -> str:
    mantissa, _, exponent = text.partition("e")
    mantissa = mantissa if "." in mantissa else f"{mantissa}."
    return f"{mantissa}{int(exponent):+d}" if exponent else mantissa


def _fixed(value: float, width: int) -> str:
    for decimals in range(width - 1, 0, -1):
        text = f"{value:.{decimals}f}"
        # The zero before the point is not needed.
        text = re.sub(r"^(-?)0\.", r"\1.", text)
        if len(text) <= width:
            return text
    return ""


def _scientific(value: float, width: int) -> str:
    for decimals in range(width - 3, -1, -1):
        mantissa, _, exponent = f"{Decimal(value):.{decimals}e}".partition("e")
        text = f"{mantissa if '.' in mantissa else mantissa + '.'}{int(exponent):+d}"
        if len(text) <= width:
            return text
    return ""
