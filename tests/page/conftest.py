"""A browser, where there is one, and pages to open in it."""

import numpy as np
import pytest
from web_pages import browser, why_no_browser

import hexconformal as hc
from hexconformal import generate
from hexconformal.app.cli import main


@pytest.fixture(scope="session")
def started():
    """A browser; tests are skipped where there is none."""
    missing = why_no_browser()
    if missing:
        pytest.skip(missing)
    with browser() as found:
        yield found


@pytest.fixture(scope="session")
def run(tmp_path_factory):
    """A folder with what came of a run: part.vtu of two materials, better.vtu, report.html with frames."""
    folder = tmp_path_factory.mktemp("run")
    points, cells = generate.jittered(*generate.ball(core=4, layers=2), 0.3, seed=3)
    upper = points[cells].mean(axis=1)[:, 2] > 0
    data = {"material": np.where(upper, 7, 3), "load": np.random.default_rng(0).normal(size=(len(cells), 3))}
    hc.write(folder / "part.vtu", hc.HexMesh(points, cells, {"height": points[:, 2]}, data))
    words = f"--html {folder}/report.html --frames {folder}/run.pvd --max-iterations 12 --quiet"
    assert main([*f"regularize {folder}/part.vtu {folder}/better.vtu".split(), *words.split()]) == 0
    return folder
