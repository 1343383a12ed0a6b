"""Where points are on the screen, and what drawing needs and leaves."""

import subprocess
import sys

import numpy as np
import pytest

import hexconformal as hc
from hexconformal.plots import canvas
from hexconformal.plots.canvas import require_rendering


def test_points_are_found_on_the_screen(rendering):
    with canvas.plotter_of([-1.0, 1.0] * 3) as plotter:
        plotter.screenshot(None, return_img=True)
        found = canvas.to_pixels(plotter, np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [1.0, 1.0, 0.0]]))
    middle = canvas.PIXELS / 2
    np.testing.assert_allclose(found[0], middle, atol=1e-6 * middle)
    assert found[1, 0] == pytest.approx(middle, abs=1e-3)  # straight up
    assert found[1, 1] < middle
    assert found[2, 0] > middle  # to the right


def test_without_a_graphics_driver_the_error_says_what_to_install(monkeypatch):
    def crashed(*words, **options):
        return subprocess.CompletedProcess(words, -11)

    monkeypatch.setattr(subprocess, "run", crashed)
    with pytest.raises(hc.WriteError, match="libegl1"):
        require_rendering.__wrapped__()


def test_drawing_leaves_no_trace_of_pyplot(tmp_path):
    code = "import sys\nfrom hexconformal import generate, plots\n"
    code += "plots.histogram('q.png', generate.box((1, 1, 1)))\nassert 'matplotlib.pyplot' not in sys.modules\n"
    subprocess.run([sys.executable, "-c", code], cwd=tmp_path, check=True, timeout=120)
