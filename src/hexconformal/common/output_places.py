"""Places of outputs: none of them is an input, or another output, whatever name or link leads there."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from .errors import OptionError

__all__ = ["OutputPlace", "require_distinct_places", "same_file"]


@dataclass(frozen=True)
class OutputPlace:
    """A file to be written, and those that will come with it.

    Attributes
    ----------
    path
        The file.
    comes_with
        Tells of another path whether it would be written, or removed, along with the file.
    replaces
        The input that it may replace, if any, and with it what comes with it.
    advice
        To do where it is an input.
    """

    path: Path
    comes_with: Callable[[Path], bool] = lambda other: False
    replaces: Path | None = None
    advice: str = "write elsewhere"

    def harms(self, other: Path) -> bool:
        """Whether writing here would change or remove another file."""
        return same_file(self.path, other) or self.comes_with(other)

    def may_replace(self, other: Path) -> bool:
        """Whether it is meant to replace another file."""
        return self.replaces is not None and (same_file(self.replaces, other) or self.comes_with(other))


def same_file(one: Path, other: Path) -> bool:
    """Whether two paths lead to one file, through links of either kind too; neither needs to be there.

    >>> same_file(Path("run.csv"), Path("folder/../run.csv")), same_file(Path("run.csv"), Path("run2.csv"))
    (True, False)
    """
    if os.path.realpath(one) == os.path.realpath(other):
        return True
    try:
        return os.path.samefile(one, other)
    except OSError:  # one is not there, so they are two
        return False


def require_distinct_places(outputs: Iterable[OutputPlace], inputs: Mapping[Path, str]) -> None:
    """Raise unless the outputs are different from each other and from the inputs.

    Parameters
    ----------
    outputs
        All that a run will write.
    inputs
        The files that it reads, with what they are, such as "the input".

    Raises
    ------
    OptionError
        If one of them would be lost.
    """
    seen: list[OutputPlace] = []
    for place in outputs:
        for path, name in inputs.items():
            if place.harms(path) and not place.may_replace(path):
                raise OptionError(f"{place.path} {_relation(place, path)} {name} already: {place.advice}")
        for other in seen:
            for one, two in ((place, other.path), (other, place.path)):
                if one.harms(two):
                    raise OptionError(f"{one.path} {_relation(one, two)} an output already: write elsewhere")
        seen.append(place)


def _relation(place: OutputPlace, other: Path) -> str:
    return "is" if same_file(place.path, other) else f"would replace {other}, which is"
