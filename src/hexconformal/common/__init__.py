"""Common to every room: errors, validation of options, files that are written whole or not at all, interruption,
processes that may die, errors that ranks raise together.

Belongs here: what knows nothing of meshes. Imports no other room.
"""

from .agreement import agreed, is_agreed
from .child_process import python_can_be_started, run_python
from .errors import MeshError, OptionError, ReadError, WriteError, first_ids, first_names, unusable_points
from .files import check_writable, companion_file, reading, save_atomically, temporary_folder_beside, write_text
from .interruption import as_interruption, interruptible, interruption_waits, uninterrupted
from .loaded_later import loaded_later
from .output_places import OutputPlace, require_distinct_places, same_file
from .schedule import Schedule, tuned
from .serialization import Serializable, json_safe
from .tables import aligned
from .validation import (
    array_of_numbers,
    as_mask,
    is_number,
    options_from,
    require_choice,
    require_choices,
    require_counts,
    require_flags,
    require_items,
    require_number,
    require_numbers,
)

__all__ = [
    "MeshError",
    "OptionError",
    "OutputPlace",
    "ReadError",
    "Schedule",
    "Serializable",
    "WriteError",
    "agreed",
    "aligned",
    "array_of_numbers",
    "as_interruption",
    "as_mask",
    "check_writable",
    "companion_file",
    "first_ids",
    "first_names",
    "interruptible",
    "interruption_waits",
    "is_agreed",
    "is_number",
    "json_safe",
    "loaded_later",
    "options_from",
    "python_can_be_started",
    "reading",
    "require_choice",
    "require_choices",
    "require_counts",
    "require_distinct_places",
    "require_flags",
    "require_items",
    "require_number",
    "require_numbers",
    "run_python",
    "same_file",
    "save_atomically",
    "temporary_folder_beside",
    "tuned",
    "uninterrupted",
    "unusable_points",
    "write_text",
]
