"""Regularizing a mesh: options, the stages in their order, acceptance, report.

Belongs here: what is done with a mesh of hexahedra, and when. Imports `common`, `elements`, `mesh`, `energy`, `io`,
`geometry`, `quality`, `solver`, `formulation` and `untangling`.
"""

from .options import CHOICES, Options, Record
from .report import Report
from .run import Regularization, Result, regularize

__all__ = [
    "CHOICES",
    "Options",
    "Record",
    "Regularization",
    "Report",
    "Result",
    "regularize",
]
