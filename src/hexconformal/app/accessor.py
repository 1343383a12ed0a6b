"""``grid.hexconformal`` and ``polydata.hexconformal``: the library as methods of pyvista datasets.

pyvista 0.48 and later imports this module when the attribute is first used; with older versions import it yourself.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pyvista

from ..io import as_hex_mesh, as_volume_mesh
from ..quality import quality
from ..regularization import regularize

__all__ = ["HexahedraAccessor", "SurfaceAccessor"]

_NAME = "hexconformal"


class HexahedraAccessor:
    """The methods for grids; each returns a new dataset, as pyvista's filters do.

    Examples
    --------
    >>> import pyvista as pv
    >>> import hexconformal.app.accessor
    >>> grid = pv.ImageData(dimensions=(3, 3, 3)).cast_to_structured_grid()
    >>> measured = grid.hexconformal.quality()
    >>> type(measured).__name__, float(measured["scaled_jacobian"].min())
    ('StructuredGrid', 1.0)
    """

    def __init__(self, dataset: Any) -> None:
        self._dataset = dataset

    def regularize(
        self,
        *,
        other_cells: str = "refuse",
        linearize: bool = False,
        callback: Callable[[Any], None] | None = None,
        **options: Any,
    ) -> Any:
        """The grid with regular cells; see :func:`hexconformal.regularize`, which also returns a report.

        Parameters
        ----------
        other_cells, linearize
            Treatment of cells that are not linear, see :func:`hexconformal.as_volume_mesh`; "keep" keeps all cells but
            the hexahedra where they are.
        callback
            Called with the record of every iteration.
        **options
            Fields of :class:`hexconformal.Options`.

        Returns
        -------
        A grid of the same type with the arrays `scaled_jacobian`, `scaled_jacobian_change` and `moved_by` besides; a
        structured grid for uniform and rectilinear ones, whose points cannot move.

        Raises
        ------
        MeshError
            If the grid cannot be worked on.
        OptionError
            If an option is unknown or makes no sense.
        """
        take_in = as_hex_mesh if other_cells == "keep" else as_volume_mesh
        mesh = take_in(self._dataset, other_cells=other_cells, linearize=linearize)
        return regularize(mesh, callback=callback, **options).mesh.to_source_type()

    def quality(self, *, other_cells: str = "keep", linearize: bool = False) -> Any:
        """The grid with all measures of :class:`hexconformal.Quality` as cell arrays, NaN on cells that have none.

        Parameters
        ----------
        other_cells, linearize
            Treatment of other solid cells, and of those of second order; see :func:`hexconformal.as_volume_mesh`.

        Raises
        ------
        MeshError
            If there are no hexahedra, wedges, pyramids or tetrahedra.
        """
        mesh = as_volume_mesh(self._dataset, other_cells=other_cells, linearize=linearize)
        return mesh.replaced(cell_data=quality(mesh).arrays()).to_source_type()


class SurfaceAccessor:
    """The methods for PolyData; each returns a new one, as pyvista's filters do.

    Examples
    --------
    >>> import pyvista as pv
    >>> import hexconformal.app.accessor
    >>> measured = pv.Plane(i_resolution=2, j_resolution=2).hexconformal.quality()
    >>> measured["min_angle"].tolist()
    [90.0, 90.0, 90.0, 90.0]
    """

    def __init__(self, dataset: Any) -> None:
        self._dataset = dataset

    def remesh(self, *, callback: Callable[[Any], None] | None = None, **options: Any) -> Any:
        """The surface with regular cells; see :func:`surface.remesh`, which also returns a report.

        Parameters
        ----------
        callback
            Called with the record of every iteration.
        **options
            Fields of :class:`surface.Options`.

        Returns
        -------
        A surface of the same cells with the arrays `min_angle` and `min_angle_change` besides.

        Raises
        ------
        MeshError
            If the surface cannot be worked on.
        OptionError
            If an option is unknown or makes no sense.
        """
        import surface

        return surface.remesh(self._dataset, callback=callback, **options).mesh

    def quality(self) -> Any:
        """The surface with all measures of :class:`surface.Quality` as cell arrays, NaN on lines and vertices.

        Raises
        ------
        MeshError
            If there are no triangles or quadrilaterals, or other polygons.
        """
        import surface

        mesh = surface.as_surface_mesh(self._dataset)
        return mesh.replaced(cell_data=surface.quality(mesh).arrays()).to_source_type()


def _attach(dataset: type, accessor: type) -> None:
    register = getattr(pyvista, "register_dataset_accessor", None)
    if register is not None:
        register(_NAME, dataset)(accessor)
    else:
        setattr(dataset, _NAME, property(accessor))


for _grid in (pyvista.UnstructuredGrid, pyvista.StructuredGrid, pyvista.ImageData, pyvista.RectilinearGrid):
    _attach(_grid, HexahedraAccessor)
_attach(pyvista.PolyData, SurfaceAccessor)
