"""What runs on ranks can do, and what not yet: this is said before the work, with what to do."""

from __future__ import annotations

from typing import Any

from ...common import OptionError
from ..options import Options

__all__ = ["require_options"]

_LESS = "runs on ranks cannot {}: {}"


def require_options(options: Options) -> None:
    """Raise an OptionError unless the options ask for what runs on ranks can do."""
    wanted: tuple[tuple[bool, str, str], ...] = (
        (options.changes_sizes, "give cells other sizes yet", "take sizes='input' or 'free'"),
        (options.surface is not None, "slide on another surface yet", "leave surface out, or run without comm"),
        (options.constraint == "compatible", "keep the compatible constraint yet", "take constraint='barrier'"),
        (_is_given(options.couplings), "move nodes together yet", "take couplings='ignore'"),
        (
            not isinstance(options.target, str),
            "take targets of single cells yet",
            "take target='auto', 'cube', 'input' or 'a:b:c'",
        ),
        (
            not (options.fixed is None or isinstance(options.fixed, str)),
            "take masks of nodes to hold yet",
            "put one into point_data of the pieces, and give its name",
        ),
    )
    for asked, what, advice in wanted:
        if asked:
            raise OptionError(_LESS.format(what, advice))


def _is_given(value: Any) -> bool:
    return not (isinstance(value, str) and value in ("auto", "ignore"))
