"""Pictures of surfaces and of flows.

Belongs here: pictures of surface meshes and of the history of a flow. Imports `hexconformal.common`, `mesh`,
`hexconformal.plots`, `io` and `quality`.
"""

from .flow_plots import plot_history
from .surface_plots import before_after, histogram, worst_cells

__all__ = [
    "before_after",
    "histogram",
    "plot_history",
    "worst_cells",
]
