"""What a mesh carries beside its hexahedra that is geometry."""

from .embedded import Embedded, find_embedded
from .row_matching import same_rows

__all__ = ["Embedded", "find_embedded", "same_rows"]
