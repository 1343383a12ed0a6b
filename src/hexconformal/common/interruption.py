"""Ctrl-C, SIGTERM and SIGHUP: one way to stop, and a way to finish writing first."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

__all__ = ["as_interruption", "interruptible", "interruption_waits", "uninterrupted"]

_SIGNALS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]


class _Postponed:
    """Number of the signal that came while nothing may interrupt, 0 if none did; how deep such code is nested."""

    depth, signal = 0, 0


@contextmanager
def interruptible() -> Iterator[None]:
    """Inside, SIGTERM and SIGHUP raise KeyboardInterrupt as Ctrl-C does; those that are ignored stay so (nohup)."""
    with _handled(), as_interruption():
        yield


@contextmanager
def as_interruption() -> Iterator[None]:
    """Inside, an interruption is a KeyboardInterrupt also where compiled code was entered or left just then.

    Python reports that as a SystemError: a result was returned with an exception set.
    """
    try:
        yield
    except SystemError as problem:
        if isinstance(problem.__cause__, KeyboardInterrupt):
            raise problem.__cause__ from None
        raise


@contextmanager
def uninterrupted() -> Iterator[None]:
    """Inside, Ctrl-C, SIGTERM and SIGHUP wait: what is being written will be complete. They take effect at the end."""
    if not _in_main_thread():
        yield
        return
    depth = _Postponed.depth
    try:
        with _handled():
            try:
                _Postponed.depth = depth + 1
                yield
            finally:
                _Postponed.depth = depth
    finally:
        if depth == 0 and _Postponed.signal:
            number, _Postponed.signal = _Postponed.signal, 0
            signal.raise_signal(number)


def interruption_waits() -> bool:
    """True where a signal has come that will take effect at the end of :func:`uninterrupted`."""
    return _Postponed.signal != 0


def _interrupt(number: int, frame: FrameType | None) -> None:
    if _Postponed.depth:
        _Postponed.signal = number
    else:
        raise KeyboardInterrupt


@contextmanager
def _handled() -> Iterator[None]:
    # Python lets the main thread alone decide about signals.
    if not _in_main_thread():
        yield
        return
    before = {number: signal.getsignal(number) for number in _SIGNALS}
    # A handler that was not set from Python is None, and could not be set again.
    ours = [number for number, old in before.items() if old not in (_interrupt, signal.SIG_IGN, None)]
    try:
        for number in ours:
            signal.signal(number, _interrupt)
        yield
    finally:
        for number in ours:
            signal.signal(number, before[number])


def _in_main_thread() -> bool:
    return threading.current_thread() is threading.main_thread()
