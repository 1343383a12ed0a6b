"""Output of parsers that print: it is captured, one thread at a time."""

from __future__ import annotations

import contextlib
import io
import threading
import warnings
from collections.abc import Iterator

__all__ = ["captured_output", "captured_vtk_messages"]

# The streams and VTK's window are those of the whole process: two threads would put them back in the wrong order.
_LOCK = threading.RLock()


@contextlib.contextmanager
def captured_output() -> Iterator[io.StringIO]:
    """Collect what is printed to the standard streams; warnings are ignored."""
    output = io.StringIO()
    with _LOCK, contextlib.redirect_stdout(output), contextlib.redirect_stderr(output), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield output


@contextlib.contextmanager
def captured_vtk_messages() -> Iterator[list[str]]:
    """Collect what VTK would print; meant for use within :func:`captured_output`."""
    from vtkmodules.vtkCommonCore import vtkLogger, vtkOutputWindow, vtkStringOutputWindow

    messages: list[str] = []
    window, before = vtkStringOutputWindow(), vtkOutputWindow.GetInstance()
    verbosity = vtkLogger.GetCurrentVerbosityCutoff()
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)
    vtkOutputWindow.SetInstance(window)
    try:
        yield messages
    finally:
        output: str | bytes = window.GetOutput()
        text = output if isinstance(output, str) else output.decode("utf-8", "replace")
        messages += [line for line in text.splitlines() if line.strip()]
        vtkOutputWindow.SetInstance(before)
        vtkLogger.SetStderrVerbosity(vtkLogger.ConvertToVerbosity(verbosity))
