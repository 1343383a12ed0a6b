"""The minimum of a polynomial on the unit cube, bracketed by its Bernstein coefficients.

Those at the corners are values of the polynomial, and all bound it; where they do not decide its sign the cube is
bisected (de Casteljau) until they do (Johnen, Weill & Remacle 2017).
"""

from __future__ import annotations

import numpy as np

from ..kernel import strict_loop

__all__ = ["DEPTH", "bracket_minimum", "corner_places"]

DEPTH = 8  # largest number of times that a cell is halved in each direction
# Bisections of one cell before it counts as undecided: only a polynomial that touches zero comes near.
_BUDGET = 4096


def corner_places(degree: int) -> tuple[int, ...]:
    """Where the eight corners are among the coefficients of a polynomial of a degree in each coordinate.

    Examples
    --------
    >>> corner_places(2)
    (0, 2, 6, 8, 18, 20, 24, 26)
    """
    size = degree + 1
    return tuple(degree * (i + size * j + size * size * k) for k in range(2) for j in range(2) for i in range(2))


@strict_loop
def _bisect(parent, left, right, stride, line):  # type: ignore[no-untyped-def]
    """Halve a block of coefficients along the axis of a stride; left may be the parent."""
    size = len(line)
    for p in range(len(parent)):
        if (p // stride) % size == 0:
            for m in range(size):
                line[m] = parent[p + m * stride]
            for r in range(size):
                left[p + r * stride], right[p + (size - 1 - r) * stride] = line[0], line[size - 1 - r]
                for m in range(size - 1 - r):
                    line[m] = 0.5 * (line[m] + line[m + 1])


@strict_loop
def _bounds(block, corners):  # type: ignore[no-untyped-def]
    """Smallest coefficient, and smallest of the eight at the corners, which are values."""
    lower, upper = block[0], block[0]
    for p in range(1, len(block)):
        lower = min(lower, block[p])
    for p in corners:
        upper = min(upper, block[p])
    return lower, upper


@strict_loop
def bracket_minimum(stack, levels, line, corners, rounding, depth):  # type: ignore[no-untyped-def]
    """(lower, upper) of the polynomial whose coefficients are stack[0]; bisects while undecided.

    There is room in the rows of stack and levels for 3 depth more, and in line for the coefficients along an axis.
    """
    first, upper = _bounds(stack[0], corners)
    first -= rounding
    # Written so that NaN ends here and is never valid.
    if first > 0.0 or not upper > 0.0:
        return first, upper
    lower = np.inf
    levels[0] = 0
    size = 1
    for _ in range(_BUDGET):
        block, level = stack[size - 1], levels[size - 1]
        bound, corner = _bounds(block, corners)
        bound -= rounding
        upper = min(upper, corner)
        if upper <= 0.0:
            break
        if bound > 0.0:
            lower = min(lower, bound)
            size -= 1
            if size == 0:
                return lower, upper
        elif level == 3 * depth:
            break
        else:
            _bisect(block, block, stack[size], len(line) ** (level % 3), line)
            levels[size - 1] = levels[size] = level + 1
            size += 1
    return first, upper
