"""Curves of a run over its iterations or steps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["Curve", "columns_of", "curves_of"]


@dataclass(frozen=True)
class Curve:
    """Columns of a history that are drawn in one frame.

    Attributes
    ----------
    title
        Above it.
    names
        The columns; the first word of each stands beside its line.
    logarithmic
        True where the values go over decades.
    """

    title: str
    names: tuple[str, ...]
    logarithmic: bool = False


def columns_of(history: Sequence[Any]) -> dict[str, NDArray[np.float64]]:
    """The columns of numbers of a history of records, by the names of their fields."""
    names = [one.name for one in fields(history[0])] if history else []
    rows = {name: [getattr(record, name) for record in history] for name in names}
    return {name: np.array(row, np.float64) for name, row in rows.items() if not isinstance(row[0], str)}


def curves_of(
    columns: Mapping[str, NDArray[np.float64]], along: str, over: str, curves: Sequence[Curve]
) -> list[dict[str, Any]]:
    """Curves as a page draws them: those whose columns are there, and hold numbers.

    Parameters
    ----------
    columns
        Of a history, by name.
    along
        The column of the axis.
    over
        What the axis is, in words.
    curves
        What is drawn.

    Examples
    --------
    >>> columns = {"step": np.arange(2.0), "energy": np.array([2.0, np.nan])}
    >>> found = curves_of(columns, "step", "steps", [Curve("energy", ("energy",)), Curve("angle", ("min_angle",))])
    >>> [curve["title"] for curve in found], found[0]["lines"]
    (['energy'], [{'name': 'energy', 'y': [2.0, None]}])
    """
    found = []
    for curve in curves:
        lines = [
            {"name": name.partition("_")[0], "y": [y if np.isfinite(y) else None for y in columns[name].tolist()]}
            for name in curve.names
            if name in columns and np.isfinite(columns[name]).any()
        ]
        if lines and len(lines[0]["y"]) > 1:
            x = columns[along].tolist()
            found.append({"title": curve.title, "over": over, "log": curve.logarithmic, "x": x, "lines": lines})
    return found
