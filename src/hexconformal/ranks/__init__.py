"""Meshes that are shared out between the ranks of MPI: pieces, their distribution, and how values are summed up.

Belongs here: what is exchanged between ranks, and PETSc; files of pieces. Nothing that is done with a mesh, which is
the same wherever it is. Imports `common`, `elements`, `mesh`,
`io` and `quality`.
"""

from .distribution import Distribution, distributed, taken_in
from .gathered_cells import GatheredCells
from .gathered_faces import GatheredFaces
from .halo import Halo, Traffic
from .kept_faces import FacesBeside, KeptFaces
from .mesh_piece import MeshPiece, cell_ids_of, node_ids_of
from .mpi import mpi, petsc, require_alike
from .normalized_piece import NormalizedPiece
from .rank_space import RankSpace
from .rank_summary import rank_summary
from .reading import are_nodes_numbered, read_piece
from .routes import Routes, dealt, each_once, gathered, rows_by_id, rows_of_copies
from .shared_memory import on_every_machine
from .writing import check_piece_writable, piece_path, write_piece

__all__ = [
    "Distribution",
    "FacesBeside",
    "GatheredCells",
    "GatheredFaces",
    "Halo",
    "KeptFaces",
    "MeshPiece",
    "NormalizedPiece",
    "RankSpace",
    "Routes",
    "Traffic",
    "are_nodes_numbered",
    "cell_ids_of",
    "check_piece_writable",
    "dealt",
    "distributed",
    "each_once",
    "gathered",
    "mpi",
    "node_ids_of",
    "on_every_machine",
    "petsc",
    "piece_path",
    "rank_summary",
    "read_piece",
    "require_alike",
    "rows_by_id",
    "rows_of_copies",
    "taken_in",
    "write_piece",
]
