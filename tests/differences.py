"""Derivatives against central differences."""

import numpy as np


def observed_order(value, derivative, steps):
    """Order at which the central difference of ``value(t)`` at t = 0 approaches the derivative, from two steps."""
    errors = [np.abs((value(t) - value(-t)) / (2 * t) - derivative).max() for t in steps]
    return np.log2(errors[0] / errors[1])
