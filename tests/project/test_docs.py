"""What the pages of the documentation show runs as it is written there, and what they point at is there."""

import ast
import importlib
import importlib.util
import re
import shlex
import shutil
import webbrowser
from dataclasses import fields
from pathlib import Path

import pytest
import pyvista
from paths import ROOT

import hexconformal as hc
from hexconformal.app.cli import main

DOCS = ROOT / "docs"
PAGES = [DOCS / f"{name}.md" for name in ("tour", "moving", "compatible", "flows", "paraview")]
PAGES += sorted((DOCS / "howto").glob("*.md"))


def blocks(page: Path) -> list[str]:
    """The Python of a page. A block whose first line is "# needs NAME" is left out where NAME is not installed."""
    found = re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)
    needs = [re.match(r"# needs (\w+)\n", block) for block in found]
    return [b for b, need in zip(found, needs, strict=True) if need is None or importlib.util.find_spec(need[1])]


def page_name(page: Path) -> str:
    return page.relative_to(DOCS).with_suffix("").as_posix()


@pytest.fixture
def folder(example_files, tmp_path, monkeypatch):
    """The working folder, with the files that the pages speak of."""
    shutil.copytree(ROOT / "data", tmp_path / "data")
    shutil.copytree(example_files, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.long
@pytest.mark.parametrize("page", PAGES, ids=page_name)
def test_pages_run(page, folder, monkeypatch, capsys):
    monkeypatch.setattr(pyvista.DataSet, "plot", lambda *_, **__: None)  # opens a window
    names = {}
    for block in blocks(page):
        exec(compile(block, f"{page.name}: {block.splitlines()[0]}", "exec"), names)
        told = capsys.readouterr().out.splitlines()
        for promised in re.findall(r"^print\(.*\)\n# (.+)$", block, re.MULTILINE):
            assert promised in told
    assert names


def commands(page: Path) -> list[str]:
    """The commands of a page, without what is said of them behind a #."""
    lines = re.findall(r"^    hexconformal (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return [shlex.join(shlex.split(line, comments=True)) for line in lines]


WITH_COMMANDS = [page for page in sorted(DOCS.rglob("*.md")) if commands(page)]


def test_most_pages_show_commands():
    assert len(WITH_COMMANDS) > 9


@pytest.mark.long
@pytest.mark.parametrize("page", WITH_COMMANDS, ids=page_name)
def test_commands_run(page, folder, monkeypatch, capsys, request):
    monkeypatch.setattr(webbrowser, "open", lambda _: True)
    for line in commands(page):
        if "picture" in line:
            request.getfixturevalue("rendering")
        # Each command of a flow stands for itself.
        if line.startswith(("flow", "move")) and "--resume" not in line:
            shutil.rmtree("run", ignore_errors=True)
        assert main(shlex.split(line)) == 0, (line, capsys.readouterr().err)


def test_all_options_are_in_the_table():
    rows = re.findall(r"^\| (`.*?) \|", (DOCS / "options.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert sorted(re.findall(r"`(\w+)`", "".join(rows))) == sorted(field.name for field in fields(hc.Options))


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
    assert sorted(tags, key=lambda tag: (int(tag.rstrip("abcde")), tag)) == tags
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


def test_pages_of_the_site_point_at_what_is_in_it():
    inside = [DOCS, ROOT / "benchmarks", ROOT / "examples"]
    for page in [*DOCS.rglob("*.md"), *(ROOT / "benchmarks").glob("*.md")]:
        for link in re.findall(r"\]\(([^)#:]+)[)#]", page.read_text(encoding="utf-8")):
            target = (page.parent / link).resolve()
            assert any(target.is_relative_to(folder) for folder in inside), (page.name, link)


def test_docstrings_name_what_is_there():
    """Every parameter and field that a docstring lists is one, and no field of a class is left out of its list."""
    wrong = []
    for path in sorted((ROOT / "src").rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.FunctionDef | ast.ClassDef) and (text := ast.get_docstring(node)):
                wrong += [f"{path.stem}.{node.name}: {name}" for name in _misnamed(node, text)]
    assert wrong == []


def _misnamed(node: ast.FunctionDef | ast.ClassDef, text: str) -> set[str]:
    listed = {title: _listed(text, title) for title in ("Parameters", "Attributes")}
    if isinstance(node, ast.FunctionDef):
        return listed["Parameters"] - _arguments(node)
    fields = {one.target.id for one in node.body if isinstance(one, ast.AnnAssign)}
    methods = {one.name: one for one in node.body if isinstance(one, ast.FunctionDef)}
    arguments = _arguments(methods["__init__"]) if "__init__" in methods else fields
    known = fields | set(methods) | set(re.findall(r"self\.(\w+)", ast.unparse(node)))
    left_out = {name for name in fields - listed["Attributes"] if listed["Attributes"] and name[0] != "_"}
    return (listed["Parameters"] - arguments) | (listed["Attributes"] - known) | left_out


def _listed(text: str, title: str) -> set[str]:
    section = re.search(rf"^{title}\n-+\n(.*?)(?=\n\n\w+\n-+\n|\Z)", text, re.DOTALL | re.MULTILINE)
    lines = section[1].splitlines() if section else []
    return {name.strip(" *") for line in lines if line[:1].strip() for name in line.split(",")}


def _arguments(function: ast.FunctionDef) -> set[str]:
    found = function.args
    starred = [one for one in (found.vararg, found.kwarg) if one is not None]
    return {one.arg for one in [*found.posonlyargs, *found.args, *found.kwonlyargs, *starred]}
