"""The program as tests run it: in this process, or in one of its own that is interrupted."""

import csv
import json
import subprocess
import sys
import time
from xml.etree import ElementTree

from hexconformal.app.cli import main


def run(words):
    """Exit code of a command."""
    return main(words.split())


def error_line(capsys):
    """The one line on stderr."""
    said = capsys.readouterr()
    assert said.err.count("\n") == 1
    assert "Traceback" not in said.err
    return said.err


def interrupted(folder, words, number, lines):
    """The report of a run, writing run.csv and report.json, that got a signal once its history had so many lines."""
    output, words = words.split()[2], [*words.split(), "--history", "run.csv", "--report", "report.json"]
    program = subprocess.Popen(
        [sys.executable, "-m", "hexconformal", *words], cwd=folder, stderr=subprocess.PIPE, text=True
    )
    history, until = folder / "run.csv", time.monotonic() + 100
    while time.monotonic() < until and program.poll() is None:
        if history.exists() and history.read_text().count("\n") >= lines:
            break
        time.sleep(0.02)
    program.send_signal(number)
    _, said = program.communicate(timeout=60)
    assert program.returncode == 130, said
    report = json.loads((folder / "report.json").read_text())
    assert said.splitlines()[-1] == f"interrupted: the mesh of iteration {report['iterations']} is in {output}"
    assert report["reason"] == "interrupted"
    return report


def history(path, *volatile):
    """Rows of a history, without the columns that differ from run to run."""
    with open(path, newline="") as file:
        return [{key: row[key] for key in row if key not in volatile} for row in csv.DictReader(file)]


def frames(path):
    """Times and files of a series."""
    entries = ElementTree.parse(path).iter("DataSet")
    return [(float(entry.attrib["timestep"]), path.parent / entry.attrib["file"]) for entry in entries]
