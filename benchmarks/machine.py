"""What a figure depends on besides the code: the machine, its load, the versions; and a process by itself."""

from __future__ import annotations

import os
import platform
import resource
import signal
import subprocess
import tempfile
import time
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

__all__ = ["Finished", "described", "run"]


@dataclass(frozen=True)
class Finished:
    """A process that has ended: its exit code (None after the limit), CPU and wall seconds, output."""

    code: int | None
    cpu: float
    wall: float
    output: str


def run(command: list[str], limit: float, folder: Path | None = None) -> Finished:
    """Run a process until it ends or the limit is reached: CPU seconds, or ten times as many of wall time."""
    began = time.perf_counter()
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    with tempfile.TemporaryFile("w+") as log:
        try:
            process = subprocess.run(
                ["prlimit", f"--cpu={max(round(limit), 1)}", *command],
                stdout=log, stderr=subprocess.STDOUT, cwd=folder, timeout=10.0 * limit,
            )  # fmt: skip
            code = None if process.returncode in (-signal.SIGXCPU, -signal.SIGKILL) else process.returncode
        except subprocess.TimeoutExpired:
            code = None
        log.seek(0)
        output = log.read()
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return Finished(code, cpu, time.perf_counter() - began, output)


def described(load: tuple[float, float, float]) -> str:
    """One paragraph: processor, cores, system, versions, commit, and the load before the first run."""
    versions = ", ".join(f"{name} {metadata.version(name)}" for name in ("numpy", "scipy", "numba", "pyamg"))
    return (
        f"{_processor()}, {len(os.sched_getaffinity(0))} cores, load average {load[0]:.1f} before the runs; "
        f"{platform.system()}, Python {platform.python_version()}, {versions}; hexconformal, commit {_commit()}."
    )


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    return next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), "processor")


def _commit() -> str:
    def git(*arguments: str) -> str:
        folder = Path(__file__).parent
        return subprocess.run(["git", *arguments], cwd=folder, capture_output=True, text=True).stdout.strip()

    changed = git("status", "--porcelain", "--untracked-files=no", "../src")
    return (git("rev-parse", "--short", "HEAD") or "unknown") + (" with changes in src" if changed else "")
