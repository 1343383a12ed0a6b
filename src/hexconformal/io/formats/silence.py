"""Parsers that print: what they say is collected, one thread at a time."""

from __future__ import annotations

import contextlib
import io
import threading
import warnings
from collections.abc import Iterator

__all__ = ["quiet", "vtk_messages"]

# The streams and VTK's window are those of the whole process: two threads would put them back in the wrong order.
_LOCK = threading.RLock()


@contextlib.contextmanager
def quiet() -> Iterator[io.StringIO]:
    """Keep parsers from printing, and return what they say."""
    said = io.StringIO()
    with _LOCK, contextlib.redirect_stdout(said), contextlib.redirect_stderr(said), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield said


@contextlib.contextmanager
def vtk_messages() -> Iterator[list[str]]:
    """Collect what VTK would print; meant for use within :func:`quiet`."""
    from vtkmodules.vtkCommonCore import vtkLogger, vtkOutputWindow, vtkStringOutputWindow

    messages: list[str] = []
    window, before = vtkStringOutputWindow(), vtkOutputWindow.GetInstance()
    verbosity = vtkLogger.GetCurrentVerbosityCutoff()
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)
    vtkOutputWindow.SetInstance(window)
    try:
        yield messages
    finally:
        said: str | bytes = window.GetOutput()
        text = said if isinstance(said, str) else said.decode("utf-8", "replace")
        messages += [line for line in text.splitlines() if line.strip()]
        vtkOutputWindow.SetInstance(before)
        vtkLogger.SetStderrVerbosity(vtkLogger.ConvertToVerbosity(verbosity))
