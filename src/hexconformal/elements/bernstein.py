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
def _bisect(block, right, stride, size):  # type: ignore[no-untyped-def]
    """Halve a block of coefficients along the axis of a stride: the left half takes its place."""
    last = (size - 1) * stride
    for start in range(0, len(block), size * stride):
        for p in range(start, start + stride):  # de Casteljau's triangle, a row after the other
            right[p + last] = block[p + last]
        for row in range(1, size):
            for m in range(size - 1, row - 1, -1):
                for p in range(start + m * stride, start + (m + 1) * stride):
                    block[p] = 0.5 * (block[p - stride] + block[p])
            for p in range(start, start + stride):
                right[p + last - row * stride] = block[p + last]


@strict_loop
def _bounds(block, corners, size):  # type: ignore[no-untyped-def]
    """Smallest coefficient, and smallest of the eight at the corners, which are values."""
    lower, upper, third = block[0], block[0], len(block) // 3
    for p in range(third):  # three minima that do not wait for each other: 27 and 216 are multiples of three
        lower = min(lower, min(min(block[p], block[p + third]), block[p + 2 * third]))
    for p in corners:
        upper = min(upper, block[p])
    return lower, upper


@strict_loop
def bracket_minimum(stack, levels, corners, size, rounding, depth):  # type: ignore[no-untyped-def]
    """(lower, upper) of the polynomial whose coefficients are stack[0], so many along an axis; bisects while undecided.

    There is room in the rows of stack and levels for 3 depth more. Where any coefficient is NaN, so is the rounding or
    one at a corner.
    """
    first, upper = _bounds(stack[0], corners, size)
    first -= rounding
    # Written so that NaN is never valid, here and below.
    if first > 0.0 or not upper > 0.0:
        return first, upper
    lower = np.inf
    levels[0] = 0
    count = 1
    for _ in range(_BUDGET):
        block, level = stack[count - 1], levels[count - 1]
        bound, corner = _bounds(block, corners, size)
        bound -= rounding
        upper = min(upper, corner)
        if upper <= 0.0:
            break
        if bound > 0.0:
            lower = min(lower, bound)
            count -= 1
            if count == 0:
                return lower, upper
        elif level == 3 * depth:
            break
        else:
            _bisect(block, stack[count], size ** (level % 3), size)
            levels[count - 1] = levels[count] = level + 1
            count += 1
    return first, upper
