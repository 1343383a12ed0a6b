"""Pictures: histograms, meshes before and after, the worst cells in their place.

Belongs here: what draws. Imports `common`, `mesh`, `io` and `quality`.
"""

from . import canvas
from .canvas import PICTURES, require_rendering
from .volume_plots import before_after, histogram, worst_cells

__all__ = [
    "PICTURES",
    "before_after",
    "canvas",
    "histogram",
    "require_rendering",
    "worst_cells",
]
