"""Changes of files that know their structure: what somebody would send who wants the reader to fail."""

from __future__ import annotations

import base64
import re
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

HUGE = [2**31 - 1, 2**32 - 1, 2**40, 2**62, 2**64 - 1, 10**9, 0, -1]

Change = Callable[[bytes, np.random.Generator], bytes]


def hostile(name: str, data: bytes, rng: np.random.Generator) -> bytes:
    """The bytes with a change that fits to the kind of file."""
    kinds: list[Change] = [_huge_number, _many_lines, _cut_in_a_section, _long_line, _no_line]
    if data.lstrip()[:1] == b"<" or data.startswith(b"\xff\xfe"):
        kinds = [_document_type, _character_reference, _another_encoding, _huge_attribute, _many_elements, _nested]
        kinds += [_array_header, _another_file, _huge_number]
    elif data.startswith(b"\x89HDF"):
        kinds = [_hdf5_size, _hdf5_link, _hdf5_circle]
    elif b"\0" in data[:4096]:
        kinds = [_binary_count, _binary_tail, _cut_in_a_section]
    return kinds[rng.integers(len(kinds))](data, rng)


def _huge(rng: np.random.Generator) -> bytes:
    return str(HUGE[rng.integers(len(HUGE))]).encode()


def _place(data: bytes, pattern: bytes, rng: np.random.Generator) -> tuple[int, int]:
    """Where one of the matches is; an empty place at random if there is none."""
    found = [match.span() for match in re.finditer(pattern, data)]
    at = int(rng.integers(len(data) + 1))
    return found[rng.integers(len(found))] if found else (at, at)


def _put(data: bytes, place: tuple[int, int], new: bytes) -> bytes:
    return data[: place[0]] + new + data[place[1] :]


# ------------------------------------------------------------------------------------------- text
def _huge_number(data: bytes, rng: np.random.Generator) -> bytes:
    return _put(data, _place(data, rb"(?<![\w.])\d+(?![\w.])", rng), _huge(rng))


def _many_lines(data: bytes, rng: np.random.Generator) -> bytes:
    start, end = _place(data, rb"[^\n]*\n", rng)
    return _put(data, (start, end), data[start:end] * int(rng.integers(2, 20000)))


def _cut_in_a_section(data: bytes, rng: np.random.Generator) -> bytes:
    return data[: _place(data, rb"\s\S+", rng)[1]]


def _long_line(data: bytes, rng: np.random.Generator) -> bytes:
    words = [b"# ", b", ", b"((", b"a,a ", b"\t", b'"', b"1 ", b"=", b"*", b"+\n"]
    return _put(
        data, _place(data, rb"\n", rng), words[rng.integers(len(words))] * int(rng.integers(10, 30000)) + b"x\n"
    )


def _no_line(data: bytes, rng: np.random.Generator) -> bytes:
    return _put(data, _place(data, rb"[^\n]*\n", rng), b"")


# ------------------------------------------------------------------------------------------- XML
def _document_type(data: bytes, rng: np.random.Generator) -> bytes:
    laughs = b"".join(b'<!ENTITY l%d "%s">' % (k, b"&l%d;" % (k - 1) * 10 if k else b"x" * 10) for k in range(10))
    attributes = b'<!ATTLIST Piece NumberOfPoints CDATA "%s"><!ATTLIST DataItem Dimensions CDATA "%s">'
    inner = laughs if rng.random() < 0.5 else attributes % (_huge(rng), _huge(rng))
    changed = _put(data, _place(data, rb"(?=<(?:VTKFile|Xdmf))", rng), b"<!DOCTYPE X [" + inner + b"]>\n")
    return _put(changed, _place(changed, rb"(?<=>)\s*(?=[\d<])", rng), b"&l9;")


def _character_reference(data: bytes, rng: np.random.Generator) -> bytes:
    start, end = _place(data, rb"(?<=\")\d+(?=\")", rng)
    return _put(data, (start, end), b"".join(b"&#%d;" % byte for byte in (data[start:end] or _huge(rng)) * 3))


def _another_encoding(data: bytes, rng: np.random.Generator) -> bytes:
    text = re.sub(r"<\?xml.*?\?>", "", data.decode("latin-1"), count=1)
    name = ["utf-16", "utf-32", "utf-7", "cp037"][rng.integers(4)]
    return f'<?xml version="1.0" encoding="{name}"?>{text}'.encode(name, "replace")


def _huge_attribute(data: bytes, rng: np.random.Generator) -> bytes:
    return _put(data, _place(data, rb"(?<==\")-?\d+(?=[ \"])", rng), _huge(rng))


def _many_elements(data: bytes, rng: np.random.Generator) -> bytes:
    start, end = _place(data, rb"<(\w+)[^>]*/>|<DataArray.*?</DataArray>", rng)
    return _put(data, (start, end), data[start:end] * int(rng.integers(2, 3000)))


def _nested(data: bytes, rng: np.random.Generator) -> bytes:
    count = int(rng.integers(10, 100000))
    return _put(
        data, _place(data, rb"(?<=>)\s*(?=<)", rng), b"<a>" * count + (b"</a>" * count if rng.random() < 0.5 else b"")
    )


def _array_header(data: bytes, rng: np.random.Generator) -> bytes:
    numbers = np.array([HUGE[k] % 2**64 for k in rng.integers(len(HUGE), size=4)], dtype=np.uint64)
    header = numbers.astype(["<u4", "<u8", ">u8"][rng.integers(3)]).tobytes()
    start, _ = _place(data, rb"(?<=>)\s*(?=[A-Za-z0-9+/=]{8})|(?<=_)(?=[A-Za-z0-9+/=]{8})", rng)
    encoded = base64.b64encode(header)
    return _put(data, (start, start + len(encoded)), encoded)


def _another_file(data: bytes, rng: np.random.Generator) -> bytes:
    names = [b"/dev/zero", b"../../etc/passwd", b"/etc/passwd", b"", b"\x1b[2J", b".", b"http://localhost/x.h5"]
    return _put(data, _place(data, rb"[\w.-]+\.(?:h5|vtu)", rng), names[rng.integers(len(names))])


# ------------------------------------------------------------------------------------------- HDF5 and other bytes
def _with_hdf5(data: bytes, change: Callable[..., None]) -> bytes:
    import h5py

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.h5"
        path.write_bytes(data)
        with h5py.File(path, "r+") as file:
            names: list[str] = []
            file.visititems(lambda name, item: names.append(name) if hasattr(item, "shape") else None)
            change(h5py, file, names)
        return path.read_bytes()


def _hdf5_size(data: bytes, rng: np.random.Generator) -> bytes:
    def change(h5py: object, file: dict, names: list[str]) -> None:
        name = names[rng.integers(len(names))]
        kind, shape = file[name].dtype, list(file[name].shape) or [1]
        shape[0] = int(HUGE[rng.integers(4)] % 2**62) + 1
        del file[name]
        file.create_dataset(name, tuple(shape), kind, chunks=tuple(min(max(side, 1), 64) for side in shape))

    return _with_hdf5(data, change)


def _hdf5_link(data: bytes, rng: np.random.Generator) -> bytes:
    def change(h5py: object, file: dict, names: list[str]) -> None:
        name = names[rng.integers(len(names))]
        del file[name]
        if rng.random() < 0.5:
            file[name] = h5py.ExternalLink("/etc/passwd", "/x")
        else:
            file.create_dataset(name, (64,), "f8", external=[("/dev/zero", 0, 512)])

    return _with_hdf5(data, change)


def _hdf5_circle(data: bytes, rng: np.random.Generator) -> bytes:
    def change(h5py: object, file: dict, names: list[str]) -> None:
        name = names[rng.integers(len(names))]
        del file[name]
        file[name] = file["/"] if rng.random() < 0.5 else h5py.SoftLink("/" + name)

    return _with_hdf5(data, change)


def _binary_count(data: bytes, rng: np.random.Generator) -> bytes:
    width, order = int(rng.choice([4, 8])), str(rng.choice(["little", "big"]))
    at = 4 * int(rng.integers(max(min(len(data), 800) // 4, 1)))
    return _put(data, (at, at + width), (HUGE[rng.integers(len(HUGE))] % 2 ** (8 * width)).to_bytes(width, order))


def _binary_tail(data: bytes, rng: np.random.Generator) -> bytes:
    return data + rng.bytes(8) * int(rng.integers(1, 20000))
