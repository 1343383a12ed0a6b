"""The measures of every region of a mesh."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..mesh import SERIAL, Regions, Space
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


def measure_regions(regions: Regions, measured: Quality, space: Space = SERIAL) -> RegionMeasures:
    """Measure the regions of a mesh by its cells, of which every part of a space may have some.

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
    cells = space.totals(np.bincount(labels, minlength=count))
    least = np.full(count, np.inf)
    np.minimum.at(least, labels, measured.scaled_jacobian)
    sums = [np.bincount(labels, values, count) for values in (measured.volume, measured.scaled_jacobian)]
    volume, scaled_jacobian = space.totals(np.array(sums, dtype=np.float64))
    return RegionMeasures(
        cells=cells,
        inverted=space.totals(np.bincount(labels[measured.scaled_jacobian <= 0], minlength=count)),
        volume=volume,
        min_scaled_jacobian=space.least(least),
        mean_scaled_jacobian=scaled_jacobian / cells,
    )
