"""The page: a mesh, or what came of a run, in one HTML file to look at in a browser, without server or network.

Belongs here: what a page shows, how it is encoded, the file itself; in `viewer` the scripts of the page, which are
packed, with three.js, into `packed`. Imports `common`, `elements`, `mesh`, `io`, `geometry` and `quality`.
"""

from .alike import have_same_cells, require_alike, require_places
from .contents import Cells, Frame, Measure, ReportText
from .curves import Curve, columns_of, curves_of
from .page import PAGE_EXTENSIONS, Page
from .run_result import RunResult
from .schedule import PageSchedule
from .series import SeriesReader, series_page, thinned
from .skin_distance import with_distances
from .volume_page import volume_page

__all__ = [
    "PAGE_EXTENSIONS",
    "Cells",
    "Curve",
    "Frame",
    "Measure",
    "Page",
    "PageSchedule",
    "ReportText",
    "RunResult",
    "SeriesReader",
    "columns_of",
    "curves_of",
    "have_same_cells",
    "require_alike",
    "require_places",
    "series_page",
    "thinned",
    "volume_page",
    "with_distances",
]
