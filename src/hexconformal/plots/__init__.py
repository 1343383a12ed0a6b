"""Pictures: histograms, meshes before and after, the worst cells in their place.

Belongs here: pictures of meshes, and the drawing that they share. Imports `common`, `elements`, `mesh`, `io` and
`quality`.
"""

from . import canvas
from .canvas import PICTURE_EXTENSIONS, require_rendering
from .drawn_faces import DrawnFaces
from .volume_plots import before_after, histogram, worst_cells

__all__ = [
    "PICTURE_EXTENSIONS",
    "DrawnFaces",
    "before_after",
    "canvas",
    "histogram",
    "require_rendering",
    "worst_cells",
]
