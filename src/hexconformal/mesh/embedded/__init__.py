"""What a mesh carries beside its hexahedra that is geometry."""

from .embedded import Embedded, find_embedded

__all__ = ["Embedded", "find_embedded"]
