"""Hooks of mkdocs: formulas become MathML, which browsers draw themselves, and files from outside docs/ come in.

Formulas are written as `$...$` and `$$...$$`, as GitHub shows them too; `\\tag{7}` numbers one and makes it the target
of links to `#eq-7`.
"""

from __future__ import annotations

import html
import re
from pathlib import Path
from typing import Any

from latex2mathml.converter import convert
from mkdocs.structure.files import File, Files

ROOT = Path(__file__).resolve().parents[2]
_FORMULA = re.compile(r'<(span|div) class="arithmatex">(.*?)</\1>', re.DOTALL)
_TAG = re.compile(r"\\tag\{(\d+)\}")


def on_files(files: Files, config: Any) -> Files:
    """The tables of the benchmarks with the scripts that make them, and the list of changes, where they are."""
    for path in [*sorted((ROOT / "benchmarks").glob("*.md")), *sorted((ROOT / "benchmarks").glob("*.py"))]:
        files.append(File.generated(config, f"benchmarks/{path.name}", abs_src_path=str(path)))
    files.append(File.generated(config, "CHANGELOG.md", abs_src_path=str(ROOT / "CHANGELOG.md")))
    return files


def on_page_markdown(markdown: str, page: Any, config: Any, files: Files) -> str:
    """Links to benchmarks/ as they are right in the repository, to where the files are in the site."""
    return re.sub(r"\]\(((?:\.\./)*)\.\./benchmarks/", r"](\1benchmarks/", markdown)


def on_page_content(content: str, page: Any, config: Any, files: Files) -> str:
    """Formulas as MathML."""
    return _FORMULA.sub(_mathml, content)


def _mathml(found: re.Match[str]) -> str:
    text = html.unescape(found[2]).strip()
    if found[1] == "span":
        return convert(text.removeprefix("\\(").removesuffix("\\)").strip())
    text = text.removeprefix("\\[").removesuffix("\\]").strip()
    tag = _TAG.search(text)
    drawn = convert(_TAG.sub("", text).strip(), display="block")
    if tag is None:
        return f'<div class="equation">{drawn}</div>'
    return f'<div class="equation" id="eq-{tag[1]}">{drawn}<span class="number">({tag[1]})</span></div>'
