"""Nodes that move together in a run, as the options ask for it."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..mesh import NormalizedMesh, find_couplings
from ..solver import CoupledNodes, coupled_groups

__all__ = ["coupled_nodes"]


def coupled_nodes(normalized: NormalizedMesh, couplings: Any) -> tuple[CoupledNodes, tuple[str, ...]]:
    """The groups of nodes that move together, in the order of a normalized mesh, and notes on them.

    Raises
    ------
    OptionError
        If pairs that are given make no sense.
    """
    found = find_couplings(normalized.mesh, couplings)
    return coupled_groups(np.argsort(normalized.node_ids)[found.pairs], found.rotations), found.notes
