"""Regularizing a mesh: options, the stages in their order, acceptance, report.

Belongs here: what is done with a mesh, and when. Imports `common`, `elements`, `mesh`, `energy`, `io`, `ranks`,
`runs`, `geometry`, `quality`, `page`, `solver`, `formulation` and `untangling`.
"""

from typing import TYPE_CHECKING

from ..common import loaded_later
from .options import CHOICES, Options, Record

if TYPE_CHECKING:
    from .quadratic import Curved, curved
    from .report import Report, Result
    from .resuming import Checkpoint, Start
    from .run import Regularization
    from .run_on_mesh import regularize, run_on
else:
    # Commands that have some of the options alone are a third faster.
    __getattr__ = loaded_later(
        __name__,
        quadratic="Curved curved",
        report="Report Result",
        resuming="Checkpoint Start",
        run="Regularization",
        run_on_mesh="regularize run_on",
    )

__all__ = [
    "CHOICES",
    "Checkpoint",
    "Curved",
    "Options",
    "Record",
    "Regularization",
    "Report",
    "Result",
    "Start",
    "curved",
    "regularize",
    "run_on",
]
