"""Colour maps of the field, as the page holds them."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np

__all__ = ["colour_maps"]

# Matplotlib's names; reversed ones are not needed, as the page can turn each round.
_MAPS = ("viridis", "cividis", "plasma", "turbo", "RdYlBu", "coolwarm", "gray")


def colour_maps() -> list[dict[str, Any]]:
    """Names of colour maps with their 256 colours, three bytes each, in base64.

    Examples
    --------
    >>> first = colour_maps()[0]
    >>> first["name"], list(base64.b64decode(first["colours"])[:3])
    ('viridis', [68, 1, 84])
    """
    from matplotlib import colormaps

    found = []
    for name in _MAPS:
        colours = colormaps[name](np.linspace(0.0, 1.0, 256), bytes=True)[:, :3]
        found.append({"name": name, "colours": base64.b64encode(np.ascontiguousarray(colours).tobytes()).decode()})
    return found
