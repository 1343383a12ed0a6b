"""What a mesh and the options say of its nodes and faces, before any geometry is looked at."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...mesh import NormalizedMesh
from ...solver import CoupledNodes, coupled_nodes, fixed_components
from ..options import Options
from .kept_geometry import KeptGeometry, kept_geometry

__all__ = ["Said", "what_is_said"]


@dataclass(frozen=True, eq=False)
class Said:
    """Nodes that are held or move together, and geometry to keep, in the node ids of a normalized mesh.

    Attributes
    ----------
    fixed
        (n, 3) components that are held.
    kept
        Faces inside, curves, tags.
    coupled
        Nodes that move together.
    notes
        What was found of these, in words.
    """

    fixed: NDArray[np.bool_]
    kept: KeptGeometry
    coupled: CoupledNodes
    notes: tuple[str, ...]


def what_is_said(normalized: NormalizedMesh, options: Options) -> Said:
    """All of it.

    Raises
    ------
    OptionError
        If masks, pairs or names make no sense.
    """
    fixed = fixed_components(normalized.mesh, options.fixed)[normalized.node_ids]
    return Said(fixed, kept_geometry(normalized, options), *coupled_nodes(normalized, options.couplings))
