"""Arguments that are options of a run, with the defaults that these have."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ...regularization import CHOICES, Options

__all__ = ["add_choice", "add_interfaces"]


def add_choice(group: Any, name: str, text: str, choices: Sequence[str] = (), options: type = Options) -> None:
    """Add an option that `options` has, with its default; that class refuses other values, in the same words."""
    default = getattr(options, name)
    metavar = "|".join(choices or CHOICES[name])
    group.add_argument(f"--{name}", default=default, metavar=metavar, help=f"{text} (default {default})")


def add_interfaces(group: Any, what: str) -> None:
    """Add the option for what lies between regions; `what` tells what becomes of it."""
    group.add_argument(
        "--interfaces", default=Options.interfaces, metavar="auto|ignore|NAME", help=f"{what}: those that the file"
        " tells apart, none, or those of a cell array (default %(default)s)",
    )  # fmt: skip
