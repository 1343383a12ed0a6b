"""Formulas are numbered by `\\tag{7}` or `\\tag{7a}` at their end, which makes them the target of links to `#eq-7`."""

from __future__ import annotations

import re

__all__ = ["TAG", "anchored"]

TAG = re.compile(r"\\tag\{(\d+[a-z]?)\}")
_FORMULA = re.compile(r"^\$\$.*?\$\$", re.DOTALL | re.MULTILINE)


def anchored(markdown: str) -> str:
    """The text with an anchor before every numbered formula."""
    return _FORMULA.sub(_with_anchor, markdown)


def _with_anchor(found: re.Match[str]) -> str:
    tag = TAG.search(found[0])
    return found[0] if tag is None else f'<div id="eq-{tag[1]}"></div>\n\n{found[0]}'
