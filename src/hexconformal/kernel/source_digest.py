"""What source files contain, so that what is compiled of them is known by it."""

from __future__ import annotations

from functools import cache
from hashlib import sha256
from pathlib import Path

__all__ = ["digest"]


@cache
def digest(file: str) -> bytes:
    """Hash of a source file, as it was when the first function in it was marked: what is compiled is of that state."""
    try:
        return sha256(Path(file).read_bytes()).digest()
    except OSError:  # inside an archive, all of which numba itself hashes
        return b""
