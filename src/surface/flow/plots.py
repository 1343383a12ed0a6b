"""What happened along a flow, in one picture."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import numpy as np

from hexconformal import canvas
from hexconformal.io import check_writable

__all__ = ["plot_history"]

_COLOUR = "#2a6f97"


def plot_history(path: Any, history: Any) -> None:
    """Draw energy, what is conserved, angles and time step of a history against time.

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
    check_writable(path, canvas.PICTURES)
    with open(history, newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    columns = {name: np.array([float(row[name]) for row in rows]) for name in (rows[0] if rows else ())}
    figure = Figure(figsize=(9, 6.4), layout="constrained")
    panels = figure.subplots(2, 2)
    for axes, (title, names) in zip(panels.flat, _PANELS, strict=True):
        for name, style in zip(names, ("-", "--"), strict=False):
            if columns:
                axes.plot(columns["time"], columns[name], style, color=_COLOUR, label=name.replace("_", " "))
        axes.set_title(title, loc="left", fontsize=10, fontweight="bold")
        axes.set_xlabel("time", fontsize=9)
        axes.spines[["top", "right"]].set_visible(False)
        axes.tick_params(labelsize=9)
        if len(names) > 1:
            axes.legend(frameon=False, fontsize=9)
    panels[1, 1].set_yscale("log")
    canvas.save(path, figure)


_PANELS = (
    ("energy", ("energy",)),
    ("reduced volume", ("reduced_volume",)),
    ("smallest angle of a cell, degrees", ("mean_angle", "min_angle")),
    ("time step", ("tau",)),
)
