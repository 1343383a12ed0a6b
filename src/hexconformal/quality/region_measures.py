"""The measures of every region of a mesh."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..mesh import Regions
from .assessment import Quality

__all__ = ["RegionMeasures", "measure_regions"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class RegionMeasures:
    """Measures of k regions.

    Attributes
    ----------
    cells, inverted
        (k,) number of cells, and of those whose scaled Jacobian is not positive.
    volume
        (k,) sum of the cells' volumes, in the mesh's unit of length cubed.
    min_scaled_jacobian, mean_scaled_jacobian
        (k,) of the cells' scaled Jacobians.
    """

    cells: Ints
    inverted: Ints
    volume: Field
    min_scaled_jacobian: Field
    mean_scaled_jacobian: Field


def measure_regions(regions: Regions, measured: Quality) -> RegionMeasures:
    """Measure the regions of a mesh by its cells.

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> from hexconformal.mesh import HexMesh, find_regions
    >>> from hexconformal.quality import quality
    >>> mesh = HexMesh(*box((4, 1, 1)), cell_data={"part": np.array([0, 0, 0, 1])})
    >>> measure_regions(find_regions(mesh), quality(mesh)).volume
    array([0.75, 0.25])
    """
    labels, count = regions.labels, len(regions.names)
    cells = np.bincount(labels, minlength=count)
    least = np.full(count, np.inf)
    np.minimum.at(least, labels, measured.scaled_jacobian)
    return RegionMeasures(
        cells=cells,
        inverted=np.bincount(labels[measured.scaled_jacobian <= 0], minlength=count),
        volume=np.bincount(labels, measured.volume, count).astype(np.float64),
        min_scaled_jacobian=least,
        mean_scaled_jacobian=np.bincount(labels, measured.scaled_jacobian, count) / cells,
    )
