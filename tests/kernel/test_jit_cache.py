"""Compiled code on disk: announced, kept, or done without."""

import errno

import numba
import pytest
from numba import njit

from hexconformal.app.progress import Progress
from hexconformal.kernel import loop, numba_compiler, strict_loop


@pytest.mark.parametrize("quiet", [False, True])
def test_compiling_is_announced_once(monkeypatch, tmp_path, caplog, quiet):
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(numba_compiler._ANNOUNCEMENT, "_said", False)
    with Progress(quiet):
        njit(slowly_compiled)(3)
        assert not caplog.records  # not ours
        for _ in range(2):
            loop(slowly_compiled)(3)
            loop(slowly_compiled)(3.0)
    assert [record.name for record in caplog.records] == ["hexconformal"] * (not quiet)


def test_without_a_folder_to_keep_it_in_the_code_is_compiled_at_every_run(monkeypatch, caplog):
    monkeypatch.setattr(numba_compiler.FunctionCache._impl_class, "_locator_classes", [])
    monkeypatch.setattr(numba_compiler._ANNOUNCEMENT, "_said", False)
    monkeypatch.setattr(numba_compiler._ANNOUNCEMENT, "kept", True)
    assert loop(slowly_compiled)(3) == strict_loop(slowly_compiled)(3) == 3.0
    assert ["NUMBA_CACHE_DIR" in record.message for record in caplog.records] == [True]


def test_a_full_disk_does_not_stop_what_is_compiled(monkeypatch, tmp_path):
    def full(*words):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    monkeypatch.setattr("numba.core.caching.IndexDataCacheFile.save", full)
    assert loop(slowly_compiled)(4) == 6.0


def slowly_compiled(count):
    total = 0.0
    for row in range(count):
        total += row
    return total
