"""Checkpoints: what is no sound one is refused before anything large is made of it."""

import io
import os
import zipfile

import numpy as np
import pytest

from hexconformal.common import OptionError, ReadError
from hexconformal.runs import load_state, save_state


def load(path):
    return load_state(path, 1, "this run", "another run")


@pytest.fixture
def sound(tmp_path):
    path = tmp_path / "checkpoint.npz"
    save_state(path, 1, "this run", {"step": 3, "points": np.arange(6.0).reshape(2, 3)})
    return path


def header(text):
    head = text.encode().ljust(118) + b"\n"
    return b"\x93NUMPY\x01\x00" + len(head).to_bytes(2, "little") + head


def test_what_was_written_is_read(sound):
    found = load(sound)
    assert found["step"] == 3
    np.testing.assert_array_equal(found["points"], np.arange(6.0).reshape(2, 3))
    with pytest.raises(OptionError, match="belongs to another run"):
        load_state(sound, 1, "that run", "another run")
    with pytest.raises(ReadError, match="of this version"):
        load_state(sound, 2, "this run", "another run")


@pytest.mark.parametrize(
    ("data", "packing"),
    [
        (header("{'descr': '<f8', 'fortran_order': False, 'shape': (1099511627776,), }"), zipfile.ZIP_STORED),
        (header("{'descr': '|O', 'fortran_order': False, 'shape': (1,), }") + b"cos\nsystem\n.", zipfile.ZIP_STORED),
        (header("{'descr': '<f8', 'fortran_order': False, 'shape': (1000000,), }") + bytes(10**6), zipfile.ZIP_LZMA),
        (b"nothing", zipfile.ZIP_STORED),
    ],
)  # fmt: skip
def test_bombs_and_pickles_are_refused(sound, data, packing):
    with zipfile.ZipFile(sound, "a") as archive:
        archive.writestr("bomb.npy", data, packing)
    with pytest.raises(ReadError, match="cannot read the checkpoint"):
        load(sound)


def test_damage_is_one_clear_error(sound):
    data = sound.read_bytes()
    rng = np.random.default_rng(0)
    for number in range(150):
        damaged = bytearray(data)
        damaged[int(rng.integers(len(data)))] ^= 1 << int(rng.integers(8))
        sound.write_bytes(bytes(damaged) if number % 3 else data[: int(rng.integers(len(data)))])
        try:
            load(sound)
        except (ReadError, OptionError):
            continue
    sound.unlink()
    with pytest.raises(ReadError, match="does not exist"):
        load(sound)
    buffer = io.BytesIO()
    np.savez(buffer, version=1)
    sound.write_bytes(buffer.getvalue())
    with pytest.raises(ReadError, match="problem"):
        load(sound)
    if hasattr(os, "mkfifo"):
        sound.unlink()
        os.mkfifo(sound)
        with pytest.raises(ReadError, match="regular file"):
            load(sound)
