"""Hooks of mkdocs: formulas become MathML, which browsers draw themselves, and files from outside docs/ come in.

Formulas are written as `$...$` and `$$...$$`, as GitHub shows them too. Links are those of the repository.
"""

from __future__ import annotations

import argparse
import html
import os
import re
from pathlib import Path
from typing import Any

from equations import TAG, anchored
from latex2mathml.converter import convert
from mkdocs.structure.files import File, Files

ROOT = Path(__file__).resolve().parents[2]
_FORMULA = re.compile(r'<(span|div) class="arithmatex">(.*?)</\1>', re.DOTALL)
_BAR = '<mo stretchy="false">&#x0007C;</mo>'
# Folders beside docs/, which are inside it in the site.
_BESIDE = re.compile(r"\]\(((?:\.\./)*)\.\./(?=(?:benchmarks|examples)/)")


def on_files(files: Files, config: Any) -> Files:
    """The benchmarks' tables and the scripts that make them, the examples, and the list of changes."""
    for pattern in ("benchmarks/*.md", "benchmarks/*.py", "examples/*.ipynb", "examples/*.py"):
        for path in sorted(ROOT.glob(pattern)):
            files.append(File.generated(config, path.relative_to(ROOT).as_posix(), abs_src_path=str(path)))
    files.append(File.generated(config, "CHANGELOG.md", abs_src_path=str(ROOT / "CHANGELOG.md")))
    return files


def on_page_markdown(markdown: str, page: Any, config: Any, files: Files) -> str:
    """Numbered formulas get an anchor; links into and out of docs/, right in the repository, are right in the site."""
    markdown = anchored(markdown)
    if page.file.src_uri == "api/cli.md":
        markdown = markdown.replace("<!-- help of all commands -->", _help_of_commands())
    if page.file.src_uri.startswith("benchmarks/"):
        return markdown.replace("](../docs/", "](../")
    return _BESIDE.sub(r"](\1", markdown)


def _help_of_commands() -> str:
    """What --help says, command by command."""
    os.environ["COLUMNS"], os.environ["NO_COLOR"] = "88", "1"
    from hexconformal.app.cli import parser

    whole = parser()
    (commands,) = (action for action in whole._actions if isinstance(action, argparse._SubParsersAction))
    parts = [f"```text\n{whole.format_help()}```"]
    parts += [f"## {name}\n\n```text\n{command.format_help()}```" for name, command in commands.choices.items()]
    return "\n\n".join(parts)


def on_page_content(content: str, page: Any, config: Any, files: Files) -> str:
    """Formulas as MathML."""
    return _FORMULA.sub(_mathml, content)


def _mathml(found: re.Match[str]) -> str:
    return _drawn(found).replace(_BAR, _BAR.replace(">", ' lspace="0" rspace="0">', 1))


def _drawn(found: re.Match[str]) -> str:
    text = html.unescape(found[2]).strip()
    if found[1] == "span":
        return convert(text.removeprefix("\\(").removesuffix("\\)").strip())
    text = text.removeprefix("\\[").removesuffix("\\]").strip()
    tag = TAG.search(text)
    drawn = convert(TAG.sub("", text).strip(), display="block")
    if tag is None:
        return f'<div class="equation">{drawn}</div>'
    return f'<div class="equation">{drawn}<span class="number">({tag[1]})</span></div>'
