"""Memory that libraries will ask for, asked for beforehand: where they get none, some of them end the process."""

from __future__ import annotations

import numpy as np

__all__ = ["require_memory"]


def require_memory(size: float) -> None:
    """Raise a MemoryError unless there are so many bytes; none of them is used, so that it costs nothing."""
    np.empty(int(size), dtype=np.uint8)
