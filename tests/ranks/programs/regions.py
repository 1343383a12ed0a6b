"""Every case with faces between regions on ranks, into the file that is named."""

from unittest.mock import patch

from cases import GOOD_REGIONS, HELD, REGIONS
from final_points import run_all, write

saved = run_all(REGIONS | GOOD_REGIONS)
with patch("hexconformal.regularization.stages.sheets_distance", lambda *_: 1.0):
    saved |= run_all(HELD)
write(saved)
