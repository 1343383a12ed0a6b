"""What the pages of the documentation show runs as it is written there, and what they point at is there."""

import importlib.util
import re
import shlex
import shutil
from pathlib import Path

import pytest

from hexconformal.cli import _parser

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
PAGES = [DOCS / "tour.md", *sorted((DOCS / "howto").glob("*.md"))]


def blocks(page: Path) -> list[str]:
    """The Python of a page. A block whose first line is "# needs NAME" is left out where NAME is not installed."""
    found = re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)
    needs = [re.match(r"# needs (\w+)\n", block) for block in found]
    return [b for b, need in zip(found, needs, strict=True) if need is None or importlib.util.find_spec(need[1])]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_pages_run(page, tmp_path, monkeypatch, capsys):
    shutil.copytree(ROOT / "data", tmp_path / "data")
    monkeypatch.chdir(tmp_path)
    names = {}
    for block in blocks(page):
        exec(compile(block, f"{page.name}: {block.splitlines()[0]}", "exec"), names)
    assert names


@pytest.mark.parametrize("page", [*PAGES, *DOCS.glob("*.md")], ids=lambda page: page.stem)
def test_commands_parse(page):
    for line in re.findall(r"^    hexconformal (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE):
        assert _parser().parse_args(shlex.split(line)).run, line
