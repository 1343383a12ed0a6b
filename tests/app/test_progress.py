"""Iterations on a terminal."""

import io
import sys
import time

from hexconformal.app.progress import Progress
from hexconformal.regularization.options import Record


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_a_terminal_sees_iterations(monkeypatch):
    monkeypatch.setattr(sys, "stderr", Terminal())
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "120")
    with Progress() as progress:
        progress.show(str(Record(7, "lbfgs", 4.685, 0.01336, 1.0, 0.98728, 0.99937, 0, 1.36)))
        time.sleep(0.3)
        assert "7 lbfgs  energy 4.685e+00" in sys.stderr.getvalue()
