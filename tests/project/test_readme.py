"""What the README shows runs as it is written there."""

import re
import shlex
import shutil
import webbrowser

import pytest
from paths import ROOT

from hexconformal.app.cli import main
from hexconformal.app.commands import COMMANDS

README = ROOT / "README.md"


@pytest.fixture(scope="module")
def folder(example_files, tmp_path_factory):
    """A folder with the files that the examples speak of."""
    return shutil.copytree(example_files, tmp_path_factory.mktemp("readme"), dirs_exist_ok=True)


def test_python_examples_run(folder, monkeypatch, capsys):
    monkeypatch.chdir(folder)
    blocks = re.findall(r"```python\n(.*?)```", README.read_text(encoding="utf-8"), re.DOTALL)
    names = {}
    for block in blocks:
        exec(block, names)
    assert len(blocks) == 3
    assert names["measured"].valid.all()
    assert names["result"].report.after.scaled_jacobian.min > 0.5


def commands():
    lines = re.findall(r"^    hexconformal (.*?)(?: +#.*)?$", README.read_text(encoding="utf-8"), re.MULTILINE)
    return [line.strip() for line in lines]


def test_every_command_is_shown():
    shown = {line.split()[0] for line in commands()}
    assert shown == set(COMMANDS) - {"demo"}


@pytest.mark.parametrize("line", commands())
def test_commands_run(line, folder, monkeypatch, capsys, request):
    monkeypatch.chdir(folder)
    monkeypatch.setattr(webbrowser, "open", lambda _: True)
    if "picture" in line:
        request.getfixturevalue("rendering")
    assert main(shlex.split(line)) == 0
