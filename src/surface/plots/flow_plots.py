"""The history of a flow in one picture."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import numpy as np

from hexconformal.common import check_writable
from hexconformal.plots import canvas

__all__ = ["plot_history"]

_COLOUR = "#2a6f97"
_MIN_RELATIVE_RANGE = 1e-3
_LABELS = {"tau": "time step"}


def plot_history(path: Any, history: Any) -> None:
    """Draw energy, reduced volume, angles, and time with its step, against the number of steps.

    Adaptive steps go over many decades: against time most of a run would be one point.

    Parameters
    ----------
    path
        A .png, .pdf or .svg file.
    history
        The CSV file with a row per step.

    Raises
    ------
    WriteError
        If the file cannot be written.
    """
    from matplotlib.figure import Figure

    path = Path(path)
    check_writable(path, canvas.PICTURE_EXTENSIONS)
    with open(history, newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    columns = {name: np.array([float(row[name]) for row in rows]) for name in (rows[0] if rows else ())}
    figure = Figure(figsize=(9, 6.4), layout="constrained")
    panels = figure.subplots(2, 2)
    for axes, (title, names) in zip(panels.flat, _PANELS, strict=True):
        for name, style in zip(names, ("-", "--"), strict=False):
            if columns:
                axes.plot(
                    columns["step"],
                    columns[name],
                    style,
                    color=_COLOUR,
                    label=_LABELS.get(name, name.replace("_", " ")),
                )
        axes.set_title(title, loc="left", fontsize=10, fontweight="bold")
        axes.set_xlabel("step", fontsize=9)
        axes.spines[["top", "right"]].set_visible(False)
        axes.ticklabel_format(useOffset=False)
        axes.tick_params(labelsize=9)
        low, high = axes.get_ylim()
        if high - low < _MIN_RELATIVE_RANGE * abs(high):
            # A quantity that is constant up to rounding shows as a straight line.
            axes.set_ylim(
                (low + high) / 2 - _MIN_RELATIVE_RANGE * abs(high), (low + high) / 2 + _MIN_RELATIVE_RANGE * abs(high)
            )
        if columns and len(names) > 1:
            axes.legend(frameon=False, fontsize=9)
    if columns and any((columns[name] > 0.0).any() for name in _PANELS[-1][1]):
        panels[1, 1].set_yscale("log", nonpositive="mask")
    canvas.save(path, figure)


_PANELS = (
    ("energy", ("energy",)),
    ("reduced volume", ("reduced_volume",)),
    ("smallest angle of a cell, degrees", ("mean_angle", "min_angle")),
    ("time", ("time", "tau")),
)
