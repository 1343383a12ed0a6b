"""Common to every room: errors, validation of options, files that are written whole or not at all, interruption.

Belongs here: what knows nothing of meshes. Imports no other room.
"""

from .errors import MeshError, OptionError, ReadError, WriteError, first_ids, first_names, unusable_points
from .files import check_writable, reading, save_atomically, temporary_folder_beside, write_text
from .interruption import as_interruption, interruptible, uninterrupted
from .serialization import Serializable, json_safe
from .validation import (
    array_of_numbers,
    as_mask,
    is_number,
    options_from,
    require_choice,
    require_choices,
    require_counts,
    require_flags,
    require_number,
    require_numbers,
)

__all__ = [
    "MeshError",
    "OptionError",
    "ReadError",
    "Serializable",
    "WriteError",
    "array_of_numbers",
    "as_interruption",
    "as_mask",
    "check_writable",
    "first_ids",
    "first_names",
    "interruptible",
    "is_number",
    "json_safe",
    "options_from",
    "reading",
    "require_choice",
    "require_choices",
    "require_counts",
    "require_flags",
    "require_number",
    "require_numbers",
    "save_atomically",
    "temporary_folder_beside",
    "uninterrupted",
    "unusable_points",
    "write_text",
]
