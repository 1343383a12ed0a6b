"""A value that all ranks have, with its arrays in memory once for each machine."""

from __future__ import annotations

import pickle
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from .mpi import mpi

__all__ = ["on_every_machine"]

Value = TypeVar("Value")

_ALIGNED = 64  # bytes; arrays begin at multiples of it
_MESSAGE = 1 << 30  # bytes that are sent at once: counts have 32 bits
_windows: list[Any] = []  # they stay until the program ends, as arrays in them may


def on_every_machine(comm: Any, value: Value | None) -> Value:
    """The value that rank 0 has, on all ranks; all must call it.

    Arrays in it are in memory that the ranks of a machine share, which none may write to; where MPI has no such memory
    for them each has its own.
    """
    MPI, parts = mpi(), list[Any]()
    text = pickle.dumps(value, protocol=5, buffer_callback=parts.append) if comm.rank == 0 else b""
    buffers = [np.frombuffer(part.raw(), np.uint8) for part in parts]
    text, sizes = comm.bcast((text, [len(one) for one in buffers]))
    ends = np.cumsum([-(-size // _ALIGNED) * _ALIGNED for size in sizes], dtype=np.int64)
    starts, total = np.concatenate([[0], ends[:-1]]).astype(np.int64), int(ends[-1]) if len(sizes) else 0
    machine = comm.Split_type(MPI.COMM_TYPE_SHARED)
    firsts = comm.Split(0 if machine.rank == 0 else MPI.UNDEFINED)
    memory, shared = _memory(machine, total)
    for start, one in zip(starts.tolist(), buffers, strict=False):
        memory[start : start + len(one)] = one
    if machine.rank == 0:
        _send(firsts, memory)
        firsts.Free()
    if not shared:
        _send(machine, memory)
    machine.Barrier()
    machine.Free()
    whole: Value = pickle.loads(
        text, buffers=[memory[start : start + size] for start, size in zip(starts.tolist(), sizes, strict=True)]
    )
    return whole


def _memory(machine: Any, size: int) -> tuple[NDArray[np.uint8], bool]:
    """Bytes that the ranks of a machine share, and True; bytes of each rank, and False, where that cannot be."""
    MPI = mpi()
    try:
        window = MPI.Win.Allocate_shared(size if machine.rank == 0 else 0, 1, comm=machine)
    except MPI.Exception:
        return np.empty(size, np.uint8), False
    _windows.append(window)
    return np.frombuffer(window.Shared_query(0)[0], np.uint8, size), True


def _send(comm: Any, memory: NDArray[np.uint8]) -> None:
    for start in range(0, len(memory), _MESSAGE):
        comm.Bcast([memory[start : start + _MESSAGE], mpi().BYTE])
