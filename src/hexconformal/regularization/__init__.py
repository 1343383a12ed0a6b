"""Regularizing a mesh: options, the stages in their order, acceptance, report.

Belongs here: what is done with a mesh, and when. Imports `common`, `elements`, `mesh`, `energy`, `io`, `ranks`,
`runs`, `geometry`, `quality`, `page`, `solver`, `formulation` and `untangling`.
"""

from .options import CHOICES, Options, Record
from .quadratic import Curved, curved
from .report import Report, Result
from .resuming import Checkpoint, Start
from .run import Regularization
from .run_on_mesh import regularize, run_on

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
