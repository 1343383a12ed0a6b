"""Untangling: unfold the corners of cells (9), then their insides; improve what stays folded.

Belongs here: ways from inverted cells to valid ones, of a whole mesh and of patches. Imports `elements`, `energy`,
`mesh`, `solver` and `formulation`.
"""

from .harmonic import extended, harmonic
from .improve_folded import improve_folded
from .pull_back import go_back, pull_back
from .thin_cells import thicken
from .untangle import folded_cells, untangle
from .untangle_interior import untangle_interior

__all__ = [
    "extended",
    "folded_cells",
    "go_back",
    "harmonic",
    "improve_folded",
    "pull_back",
    "thicken",
    "untangle",
    "untangle_interior",
]
