"""Regularizing a mesh: options, the stages in their order, acceptance, report.

Belongs here: what is done with a mesh, and when. Imports `common`, `elements`, `mesh`, `energy`, `io`, `ranks`,
`geometry`, `quality`, `page`, `solver`, `formulation` and `untangling`.
"""

from .options import CHOICES, Options, Record
from .report import Report
from .run import Regularization, Result
from .run_on_mesh import regularize, run_on

__all__ = [
    "CHOICES",
    "Options",
    "Record",
    "Regularization",
    "Report",
    "Result",
    "regularize",
    "run_on",
]
