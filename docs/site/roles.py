"""Docstrings speak of objects as :func:`name`, and of equations by number: make links of both for mkdocstrings."""

from __future__ import annotations

import ast
import re
from pathlib import Path
from typing import Any

import griffe

SOURCE = Path(__file__).resolve().parents[2] / "src"
# What has pages: these packages, under their public names, and these modules.
PACKAGES = ("hexconformal", "surface", "surface.flow")
MODULES = (
    "hexconformal.generate",
    "hexconformal.kernel.distortion",
    "hexconformal.elements.table_measures",
    "hexconformal.elements.validity",
    "hexconformal.kernel.quaternion",
)

_ROLE = re.compile(r":(?:func|class|mod|meth|attr|data):`~?([\w.]+)`")
_EQUATION = re.compile(r"\b([Ee]quation) \((\d+[a-z]?)\)")
_RETURNS = re.compile(r"^(Returns\n-------)\n((?:.+\n?)+)", re.MULTILINE)
_ANGLE = re.compile(r"<(?=[A-Za-z])")  # inner products <N, v> are no tags
_DOCTEST = re.compile(r"^(>>> )", re.MULTILINE)
_LITERAL = re.compile(r"::$", re.MULTILINE)


def defined() -> dict[str, str]:
    """Public names, and where what they stand for is defined: hexconformal.Options in hexconformal.options."""
    places = {}
    for package in PACKAGES:
        tree = ast.parse((SOURCE / package.replace(".", "/") / "__init__.py").read_text(encoding="utf-8"))
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom) and node.module:
                for name in node.names:
                    places[f"{package}.{name.asname or name.name}"] = f"{package}.{node.module}.{name.name}"
    # A package may pass on what another one below it has.
    return {name: places.get(place, place) for name, place in places.items()}


def _typed(found: re.Match[str], function: Any) -> str:
    """What is returned, said in plain sentences, below the type that the signature has."""
    lines = found[2].splitlines()
    if any(line.startswith(" ") for line in lines):
        return found[0]
    return "\n".join([found[1], str(function.returns), *(f"    {line}" for line in lines), ""])


class Roles(griffe.Extension):
    """Rewrites every docstring as it is loaded."""

    def __init__(self) -> None:
        super().__init__()
        self._defined = defined()

    def on_instance(self, *, obj: griffe.Object, **kwargs: Any) -> None:
        if obj.docstring is None:
            return
        text = _ROLE.sub(self._role, obj.docstring.value)
        text = _EQUATION.sub(r"[\1 (\2)](../mathematics.md#eq-\2)", text)
        text = _ANGLE.sub("&lt;", _LITERAL.sub(":", text))
        if "Examples\n-----" not in text:
            text = _DOCTEST.sub(r"Examples\n--------\n\1", text, count=1)
        obj.docstring.value = _RETURNS.sub(lambda found: _typed(found, obj), text) if obj.is_function else text

    def _role(self, found: re.Match[str]) -> str:
        name = found[1]
        if name in self._defined:
            return f"[`{name}`][{self._defined[name]}]"
        return f"[`{name}`][{name}]" if name.rpartition(".")[0] in MODULES else f"`{name}`"
