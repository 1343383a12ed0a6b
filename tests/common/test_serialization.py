"""Values for JSON."""

import numpy as np
import pytest

from hexconformal.common.serialization import json_safe


def test_json_safe_leaves_no_foreign_type():
    value = json_safe({"b": np.bool_(True), "n": np.float32(np.nan), "s": {1}, "p": pytest})
    assert value["b"] is True
    assert value["n"] is None
    assert value["s"] == [1]
    assert isinstance(value["p"], str)
