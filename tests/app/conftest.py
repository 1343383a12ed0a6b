"""Working folders of commands."""

import numpy as np
import pytest

import hexconformal as hc
from hexconformal import generate


@pytest.fixture
def here(tmp_path, monkeypatch):
    """An empty working folder that holds a sheared cube with nodes marked in the array "wall"."""
    monkeypatch.chdir(tmp_path)
    points, cells = generate.sheared_cube(5)
    wall = (points[:, 2] == 0).astype(int)
    hc.write("part.vtu", hc.HexMesh(points, cells, {"wall": wall}, {"tag": np.arange(len(cells))}))
    return tmp_path
