"""What the pages of the documentation show runs as it is written there, and what they point at is there."""

import importlib
import importlib.util
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from hexconformal.cli import parser

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
        told = capsys.readouterr().out.splitlines()
        for promised in re.findall(r"^print\(.*\)\n# (.+)$", block, re.MULTILINE):
            assert promised in told
    assert names


@pytest.mark.parametrize("page", [*PAGES, *DOCS.glob("*.md")], ids=lambda page: page.stem)
def test_commands_parse(page):
    for line in re.findall(r"^    hexconformal (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE):
        assert parser().parse_args(shlex.split(line, comments=True)).run, line


def test_mathematics_points_at_code():
    text = (DOCS / "mathematics.md").read_text(encoding="utf-8")
    names = set(re.findall(r"`((?:hexconformal|surface)\.[\w.]+)`", text))
    assert len(names) > 30
    for name in names:
        assert _found(name) is not None


def _found(name: str) -> object:
    """What a dotted name stands for. Modules first: a function may hide the module it is in."""
    parts = name.split(".")
    for k in range(len(parts), 0, -1):
        try:
            found: object = importlib.import_module(".".join(parts[:k]))
        except ModuleNotFoundError:
            continue
        for part in parts[k:]:
            found = getattr(found, part)
        return found
    raise ModuleNotFoundError(name)


def test_equations_are_numbered_and_known():
    tags = re.findall(r"\\tag\{(\d+)\}", (DOCS / "mathematics.md").read_text(encoding="utf-8"))
    assert [int(tag) for tag in tags] == list(range(1, len(tags) + 1))
    pointed = [
        number
        for path in sorted((ROOT / "src").rglob("*.py"))
        for number in re.findall(r"[Ee]quation \((\d+)\)", path.read_text(encoding="utf-8"))
    ]
    assert len(pointed) > 10
    assert set(pointed) <= set(tags)


def test_architecture_is_up_to_date():
    found = subprocess.run(
        [sys.executable, DOCS / "architecture.py", "--check"], capture_output=True, text=True, check=False
    )
    assert found.returncode == 0, found.stderr


def test_pictures_of_pages_exist():
    for page in DOCS.rglob("*.md"):
        for image in re.findall(r"!\[[^]]*\]\(([^)]+)\)", page.read_text(encoding="utf-8")):
            assert (page.parent / image).is_file(), (page.name, image)
