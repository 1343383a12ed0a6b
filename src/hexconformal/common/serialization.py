"""Dataclasses in plain types, as JSON takes them."""

from __future__ import annotations

import dataclasses
import json
import math
from typing import Any

import numpy as np

__all__ = ["Serializable", "json_safe"]


class Serializable:
    """Base of dataclasses that are written as JSON.

    Examples
    --------
    >>> @dataclasses.dataclass
    ... class Found(Serializable):
    ...     ratio: float
    >>> Found(np.float64("inf")).to_dict()
    {'ratio': None}
    """

    def to_dict(self) -> dict[str, Any]:
        """Plain types, as JSON takes them; what is not finite becomes None."""
        fields: dict[str, Any] = json_safe(self)
        return fields

    def to_json(self) -> str:
        """The dictionary as indented JSON."""
        return json.dumps(self.to_dict(), indent=2, allow_nan=False)


def json_safe(value: Any) -> Any:
    """Turn dataclasses, arrays and numpy numbers into plain types; None for NaN and infinity.

    >>> json_safe({"a": np.array([1.0, np.inf]), 2: (np.int64(3), "x", None)})
    {'a': [1.0, None], '2': [3, 'x', None]}
    """
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {item.name: json_safe(getattr(value, item.name)) for item in dataclasses.fields(value)}
    if isinstance(value, dict):
        return {str(key): json_safe(item) for key, item in value.items()}
    if isinstance(value, (np.ndarray, np.generic)):
        return json_safe(value.tolist())
    if isinstance(value, (list, tuple, set, frozenset)):
        return [json_safe(item) for item in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value if value is None or isinstance(value, (bool, int, str)) else str(value)
