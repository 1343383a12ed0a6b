"""Statements of decks: how each is read, without what others say."""

from .couplings import Coupling, Find, pairs_of, read_couplings
from .elements import ELEMENT_NAMES, cell_type_of, in_vtk_order, written_name
from .lines import Section, keyword_line, line_ending, sections, split_fields, split_lines
from .reals import format_real
from .sets import LabelIndex, SetKey, SetMember, WorkLimit, read_members, resolve
from .surfaces import SURFACE, read_sides, sides_of
from .systems import Placement, System, read_placement, read_system
from .tables import read_integers, read_nodes

__all__ = [
    "ELEMENT_NAMES",
    "SURFACE",
    "Coupling",
    "Find",
    "LabelIndex",
    "Placement",
    "Section",
    "SetKey",
    "SetMember",
    "System",
    "WorkLimit",
    "cell_type_of",
    "format_real",
    "in_vtk_order",
    "keyword_line",
    "line_ending",
    "pairs_of",
    "read_couplings",
    "read_integers",
    "read_members",
    "read_nodes",
    "read_placement",
    "read_sides",
    "read_system",
    "resolve",
    "sections",
    "sides_of",
    "split_fields",
    "split_lines",
    "written_name",
]
