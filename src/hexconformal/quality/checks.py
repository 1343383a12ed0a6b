"""Checks of a mesh before work on it: every reason why it is impossible or doubtful."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common import MeshError, first_ids
from ..elements import cell_volumes
from ..io import as_volume_mesh
from ..mesh import HexMesh, MixedMesh, face_table
from .face_checks import check_hanging, check_pieces, check_sides
from .finding import Finding, error, warning
from .impossible_corners import impossible_corners
from .mixed_checks import check_mixed
from .node_order import centre_determinants, detect_order
from .point_checks import check_numbers, check_places, repeated_rows

__all__ = ["Finding", "cell_errors", "check", "require_sound"]

_FLAT_VOLUME = 1e-10  # relative to the product of the edges
_SAMPLED_CELLS = 20_000
# Of the bounding box: what reaches across it, and what the typical cell is short of.
_SPANNING_SHARE, _SHORT_SHARE = 0.95, 0.7


def require_sound(mesh: HexMesh | MixedMesh) -> tuple[Finding, ...]:
    """Raise a MeshError that lists all errors found by :func:`check`; otherwise return the warnings."""
    findings = check(mesh)
    errors = [finding.message for finding in findings if finding.severity == "error"]
    if errors:
        raise MeshError("; ".join(errors))
    return findings


def check(mesh: Any) -> tuple[Finding, ...]:
    """Find everything in a mesh that makes work on it impossible or doubtful.

    Inverted cells are not among it: those are what the work is for.

    Parameters
    ----------
    mesh
        Anything :func:`hexconformal.as_hex_mesh` takes, or a mesh of several types of cells, as
        :func:`hexconformal.quality` does.

    Returns
    -------
    The findings, errors first. Ids that point nowhere, and points that are not finite, hide what comes after.

    Examples
    --------
    >>> from hexconformal.elements.hexahedron import CORNERS
    >>> [finding.message for finding in check(HexMesh(CORNERS, [[0, 1, 2, 2, 4, 5, 6, 6]]))][0][:75]
    'cells with a repeated node (collapsed hexahedra such as wedges): 1 (ids 0);'
    >>> check(HexMesh(CORNERS, [range(8)]))
    ()
    """
    mesh = as_volume_mesh(mesh)
    if isinstance(mesh, MixedMesh):
        return check_mixed(mesh)
    found = check_numbers(mesh)
    if not found:
        found = [*_check_cells(mesh), *check_places(mesh, "hexahedron")]
        if not any(finding.kind == "repeated nodes" for finding in found):
            found += _check_faces(mesh)
    return tuple(sorted(found, key=lambda finding: finding.severity))


def cell_errors(mesh: HexMesh) -> list[str]:
    """Errors that points and cells show one by one, whatever is beside them; there may be no cells."""
    found = check_numbers(mesh)
    if not found and len(mesh.cells):
        found = [finding for finding in _check_cells(mesh) if finding.severity == "error"]
    return [finding.message for finding in found]


def _check_cells(mesh: HexMesh) -> list[Finding]:
    found = []
    cell_labels = mesh.cell_labels
    nodes = np.sort(mesh.cells, axis=1)
    bad = np.flatnonzero((nodes[:, 1:] == nodes[:, :-1]).any(axis=1))
    if len(bad):
        text = f"cells with a repeated node (collapsed hexahedra such as wedges): {first_ids(bad, cell_labels)}"
        found.append(error("repeated nodes", bad, f"{text}; give them by their type, as (points, {{'wedge': cells}})"))
    repeated = repeated_rows(nodes)
    if len(repeated):
        text = f"cells with the same nodes as an earlier one: {first_ids(repeated, cell_labels)}; remove them"
        found.append(error("duplicate cells", repeated, text))
    volumes, sizes = centre_determinants(mesh.points, mesh.cells)
    flat = np.flatnonzero(np.abs(volumes) <= _FLAT_VOLUME * sizes)
    if len(flat):
        found.append(warning("flat cells", flat, f"cells without volume: {first_ids(flat, cell_labels)}"))
    wrapped = _wrapped(mesh, np.flatnonzero(volumes < 0))
    if len(wrapped):
        text = f"inverted cells that reach from one end of the mesh to the other: {first_ids(wrapped, cell_labels)}"
        advice = "if the mesh is periodic, give them nodes of their own at one end"
        found.append(warning("wrapped cells", wrapped, f"{text}; {advice}"))
    return found


def _wrapped(mesh: HexMesh, inverted: NDArray[np.int64]) -> NDArray[np.int64]:
    """Inverted cells that span the mesh along an axis along which others are short: where a periodic one is closed."""
    if not 0 < len(inverted) < len(mesh.cells) / 2:
        return inverted[:0]
    whole = np.ptp(mesh.points, axis=0)
    typical = np.median(np.ptp(mesh.points[mesh.cells[:: _sampling_stride(mesh)]], axis=1), axis=0)
    spans = np.ptp(mesh.points[mesh.cells[inverted]], axis=1) > _SPANNING_SHARE * whole
    return inverted[(spans & (typical < _SHORT_SHARE * whole)).any(axis=1)]


def _sampling_stride(mesh: HexMesh) -> int:
    # A sample tells what holds for most cells.
    return max(len(mesh.cells) // _SAMPLED_CELLS, 1)


def _check_faces(mesh: HexMesh) -> list[Finding]:
    cell_labels = mesh.cell_labels
    faces = face_table(mesh.cells)
    found = check_sides(mesh, faces)
    if any(finding.kind == "no boundary" for finding in found):
        return found
    order = detect_order(mesh.points, mesh.cells[:: _sampling_stride(mesh)])
    opposed = faces.cells[(faces.orientation != 1) & (faces.counts == 2)]
    if order.name != "VTK":
        text = f"most cells are sound only in another node order ({order.name}); orient() puts it right"
        found.append(error("foreign order", np.arange(len(mesh.cells)), text))
    elif len(opposed):
        ids = np.unique(opposed)
        text = f"neighbours that disagree on which side is out (mirrored cells): {first_ids(ids, cell_labels)}"
        found.append(error("mirrored", ids, f"{text}; orient() turns them round"))
    elif cell_volumes(mesh.points, mesh.cells).sum() < 0.0:  # whatever is tangled inside, that is what they enclose
        text = "the cells are mirrored (negative volume); orient() turns them round"
        found.append(error("mirrored", np.arange(len(mesh.cells)), text))
    found += check_pieces(mesh, mesh.cells)
    doubled = impossible_corners(faces, mesh.cells)
    if len(doubled):
        text = f"nodes with two faces between the same two edges: {first_ids(doubled, mesh.node_labels)}"
        advice = "cells there cannot all be valid, wherever the nodes are; mesh this part anew"
        found.append(warning("doubled corners", doubled, f"{text}; {advice}"))
    return [*found, *check_hanging(mesh, faces)]
