"""Names of a package whose rooms are loaded when one of them is first asked for."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any

__all__ = ["loaded_later"]


def loaded_later(package: str, **rooms: str) -> Callable[[str], Any]:
    """The ``__getattr__`` of a package that does not load all of its rooms at once.

    Parameters
    ----------
    package
        Its name.
    rooms
        Rooms, each with the names that the package hands out of it, separated by spaces.

    Examples
    --------
    >>> attribute = loaded_later("hexconformal", runs="Series")
    >>> attribute("Series")
    <class 'hexconformal.runs.series.Series'>
    """
    homes = {name: f"{package}.{room}" for room, names in rooms.items() for name in names.split()}

    def attribute(name: str) -> Any:
        if name in homes:
            return getattr(import_module(homes[name]), name)
        if name in rooms:
            return import_module(f"{package}.{name}")
        raise AttributeError(f"module {package!r} has no attribute {name!r}")

    return attribute
