"""Shared fixtures: where the large reference meshes are, if this machine has them."""

import pytest
from paths import SHARED


@pytest.fixture(scope="session")
def shared():
    """Folder of the reference meshes; the test is skipped where it is absent."""
    if not (SHARED / "meshes").is_dir():
        pytest.skip("the reference meshes are not on this machine")
    return SHARED


@pytest.fixture(scope="session")
def rendering():
    """Skips the test where pictures in three dimensions cannot be drawn."""
    from hexconformal import WriteError
    from hexconformal.plots.canvas import require_rendering

    try:
        require_rendering()
    except WriteError as problem:
        pytest.skip(str(problem))
