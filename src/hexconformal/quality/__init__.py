"""Quality of a mesh, and checks before work on it.

Belongs here: measures with their statistics, checks, node order, what no valid mesh can have or exceed. Imports
`common`, `elements`, `mesh` and `io`.
"""

from .assessment import MEASURES, MixedQuality, MixedSummary, Quality, Summary, WorstCell, quality
from .attainable_bound import attainable_scaled_jacobian, attainable_scaled_jacobians, nodes_without_room
from .checks import cell_errors, check, require_sound
from .connectivity_bound import connectivity_bound, connectivity_bounds, scaled_jacobian_around_a_node
from .impossible_corners import impossible_corners
from .node_order import orient
from .quadratic_checks import require_linear
from .region_measures import RegionMeasures, measure_regions
from .statistics import Statistics, as_table, distributions, statistics
from .winding_number import inside_out

__all__ = [
    "MEASURES",
    "MixedQuality",
    "MixedSummary",
    "Quality",
    "RegionMeasures",
    "Statistics",
    "Summary",
    "WorstCell",
    "as_table",
    "attainable_scaled_jacobian",
    "attainable_scaled_jacobians",
    "cell_errors",
    "check",
    "connectivity_bound",
    "connectivity_bounds",
    "distributions",
    "impossible_corners",
    "inside_out",
    "measure_regions",
    "nodes_without_room",
    "orient",
    "quality",
    "require_linear",
    "require_sound",
    "scaled_jacobian_around_a_node",
    "statistics",
]
