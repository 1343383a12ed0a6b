"""HDF5 and netCDF files, of any format: what they announce is held against their size before anything is read."""

from __future__ import annotations

from pathlib import Path

from ....common import ReadError
from .reader_trial import REFUSED, try_reader
from .references import referenced_file

__all__ = ["check_hdf5", "check_hdf5_beside"]

_HDF5, _NETCDF = b"\x89HDF\r\n\x1a\n", b"CDF"
# What a compressed byte may stand for is 1032 bytes with zlib, the filter that is in use.
_REASONS = (
    "it announces more than a file of its size can hold",
    "it names other files: links and data outside of an HDF5 file are not followed",
    "its groups must not be nested in a circle, or more than a thousand deep",
)
# Every dataset is read, a block at a time, so that what h5py would die of is found here.
_READ_HDF5 = f"""
import os, h5py
most = 1100 * os.path.getsize(sys.argv[1]) + (1 << 20)
seen, groups, total = set(), [], 0
def visit(group, depth):
    global total
    if depth > 200:
        os._exit({REFUSED + 2})
    for name in group:
        link = group.get(name, getlink=True)
        if isinstance(link, h5py.ExternalLink):
            os._exit({REFUSED + 1})
        if isinstance(link, h5py.SoftLink):
            continue
        item = group[name]
        place = h5py.h5o.get_info(item.id).addr
        if place in seen:
            continue
        seen.add(place)
        if isinstance(item, h5py.Group):
            visit(item, depth + 1)
        elif isinstance(item, h5py.Dataset):
            if item.external or item.is_virtual:
                os._exit({REFUSED + 1})
            size = 1
            for side in item.shape or ():
                size *= int(side)
            total += size * item.dtype.itemsize
            if total > most:
                os._exit({REFUSED})
            if size:
                item[()]
with h5py.File(sys.argv[1], "r") as file:
    visit(file, 0)
"""
_READ_NETCDF = f"""
import os, netCDF4
most = os.path.getsize(sys.argv[1]) + (1 << 20)
with netCDF4.Dataset(sys.argv[1], "r") as file:
    file.set_auto_maskandscale(False)
    total = 0
    for variable in file.variables.values():
        size = 1
        for side in variable.shape:
            size *= int(side)
        total += size * variable.dtype.itemsize
    if total > most:
        os._exit({REFUSED})
    for variable in file.variables.values():
        variable[...]
"""


def check_hdf5(path: Path) -> None:
    """Raise a ReadError if a file is HDF5, or netCDF, and reading it would end or overcome the process.

    Files that say they are something else are left to their own readers.
    """
    with path.open("rb") as file:
        head = file.read(1 << 14)
    if any(head.startswith(_HDF5, place) for place in (0, 512, 1024, 2048, 4096, 8192)):
        try_reader(_READ_HDF5, path, "HDF5", _REASONS)
    elif head.startswith(_NETCDF):
        try_reader(_READ_NETCDF, path, "netCDF", _REASONS)


def check_hdf5_beside(path: Path, name: str) -> None:
    """Raise a ReadError if the file that the one at `path` names is not in its folder, or is no sound HDF5 file."""
    place = referenced_file(path, name)
    with place.open("rb") as file:
        if file.read(8) != _HDF5:
            raise ReadError(f"it names {name!r}, which must be an HDF5 file")
    check_hdf5(place)
