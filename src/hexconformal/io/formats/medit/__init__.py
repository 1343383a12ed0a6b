"""Files named .mesh: those of Medit, as text and binary (.meshb), and those of MFEM (.mfem too)."""

from .format import MEDIT, MFEM

__all__ = ["MEDIT", "MFEM"]
