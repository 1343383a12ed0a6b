"""What the pages of the documentation show runs as it is written there, and what they point at is there."""

import importlib
import importlib.util
import re
import shlex
import shutil
from pathlib import Path

import pytest
from paths import ROOT

from hexconformal.app.cli import parser

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
    text = (DOCS / "mathematics.md").read_text(encoding="utf-8")
    tags = re.findall(r"\\tag\{(.*?)\}", text)
    assert [int(tag) for tag in tags if tag.isdigit()] == list(range(1, int(tags[-1]) + 1))
    assert sorted(tags, key=lambda tag: (int(tag.rstrip("ab")), tag)) == tags
    assert re.findall(r'<div id="eq-(.*?)"></div>\n\n\$\$', equations().anchored(text)) == tags
    pointed = [
        number
        for folder, pattern, words in (
            (ROOT / "src", "*.py", r"[Ee]quation \((\d+[a-z]?)\)"),
            (DOCS, "*.md", r"#eq-(\w+)"),
        )
        for path in sorted(folder.rglob(pattern))
        for number in re.findall(words, path.read_text(encoding="utf-8"))
    ]
    assert {"13a", "13b", "16"} < set(pointed)
    assert set(pointed) <= set(tags)


def equations():
    """What gives the formulas of the site their anchors."""
    spec = importlib.util.spec_from_file_location("equations", DOCS / "site" / "equations.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_pages_point_at_what_exists():
    pages = [*DOCS.rglob("*.md"), *(ROOT / "benchmarks").glob("*.md"), *ROOT.glob("*.md")]
    links = [
        (page, link) for page in pages for link in re.findall(r"\]\(([^)#:]+)[)#]", page.read_text(encoding="utf-8"))
    ]
    assert len(links) > 50
    for page, link in links:
        assert (page.parent / link).exists(), (page.name, link)
