"""The HTML file of a page."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from functools import cache
from html import escape
from importlib.resources import files
from typing import Any

from ..version import __version__

__all__ = ["document", "inline"]

# What a page may load: nothing. A picture that is saved is made in it.
_POLICY = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:"

_HEIGHT = 620  # pixels of a page in a notebook: a cell's output that fits on a laptop's screen


def document(title: str, contents: Mapping[str, Any], arrays: Sequence[str]) -> str:
    """The text of the file.

    Parameters
    ----------
    title
        Of the window.
    contents
        All but the arrays, in plain types.
    arrays
        The arrays by number, encoded.
    """
    data = json.dumps(contents, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")
    lines = [
        "<!DOCTYPE html>",
        '<html lang="en">',
        "<head>",
        '<meta charset="utf-8">',
        f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f'<meta name="generator" content="hexconformal {__version__}">',
        f"<title>{escape(title)}</title>",
        f'<script type="application/json" id="contents">{data}</script>',
        *(f'<script type="text/plain" id="array-{k}">{text}</script>' for k, text in enumerate(arrays)),
        "</head>",
        "<body>",
        "<p>Opening the mesh ...</p>",
        "<noscript>This page draws a mesh, for which scripts must be allowed. It loads nothing.</noscript>",
        f"<script>{_viewer()}</script>",
        "</body>",
        "</html>",
        "",
    ]
    return "\n".join(lines)


def inline(text: str) -> str:
    """A whole page as part of another one, as notebooks show it."""
    style = "width: 100%; border: 1px solid #8884; border-radius: 6px"
    return f'<iframe srcdoc="{escape(text)}" height="{_HEIGHT}" style="{style}" title="hexconformal"></iframe>'


@cache
def _viewer() -> str:
    return (files(__package__) / "packed" / "viewer.js").read_text(encoding="utf-8")
