"""The work that a phase of a run may take: every phase has an end, whatever the mesh."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

__all__ = ["Work"]


@dataclass(eq=False)
class Work:
    """Newton steps that may still be taken, counted in cells; a share of it is taken from the whole, too.

    Attributes
    ----------
    left
        Cells times steps that are left.
    step
        Cells that a step costs besides those that it is taken on.
    whole
        What this is a share of; None if of nothing.

    Examples
    --------
    >>> work = Work(1000.0, 300)
    >>> work.take(900), work.is_done, work.take(1)
    (True, True, False)
    """

    left: float = inf
    step: int = 0
    whole: Work | None = None

    @property
    def is_done(self) -> bool:
        """True where nothing is left."""
        return self.left <= 0.0 or (self.whole is not None and self.whole.is_done)

    def take(self, cells: int) -> bool:
        """Take a step on so many cells; False where nothing is left for it."""
        if self.is_done:
            return False
        part: Work | None = self
        while part is not None:
            part.left -= cells + self.step
            part = part.whole
        return True

    def share(self, share: float) -> Work:
        """A share of what is left."""
        return Work(share * self.left, self.step, self)
