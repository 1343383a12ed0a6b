"""Options of a run, and the record of one iteration."""

from __future__ import annotations

import os
from dataclasses import dataclass, fields
from math import isnan
from typing import Any

import numpy as np

from ..common import OptionError, array_of_numbers, require_choices, require_counts, require_flags, require_numbers

__all__ = ["CHOICES", "Options", "Record"]

CHOICES = {
    "boundary": ("slide", "fixed", "free"),
    "constraint": ("barrier", "compatible"),
    "features": ("auto", "keep", "soft"),
    "energy": ("barrier", "quaternionic"),
    "weight": ("reference", "volume"),
    "quadrature": ("auto", "gauss", "corners"),
    "method": ("auto", "lbfgs", "newton", "majorize"),
    "emphasis": ("auto", "worst", "mean"),
}


@dataclass(frozen=True)
class Options:
    """Options of :func:`hexconformal.regularize`.

    Attributes
    ----------
    boundary
        "slide": boundary nodes move in the flat faces and along the straight edges they lie on, and along
        curved parts within `hausdorff`; "fixed": they stay; "free": nothing holds them but `fixed`.
    hausdorff
        Distance that a curved boundary may move, in both directions, as a share of the bounding box's diagonal.
        0: curved parts stay.
    constraint
        How curved parts are kept while the distortion is minimized: "barrier": by a penalty on the distance from the
        input, which becomes infinite at `hausdorff`; "compatible": by the constraint of Gruber & Aulisa, displacements
        orthogonal to the middle normal in every step, as long as `hausdorff` is kept. Where cells are unfolded or the
        worst ones raised, the barrier keeps them.
    eps
        Relaxation of the compatible constraint, in squares of the mesh's mean edge.
    features
        Sharp edges and corners: "keep"; "soft": they may be rounded within `hausdorff`; "auto": kept unless
        they are noise, or the stair steps of a voxel mesh; where the worst cells stall at curves, these are let go as
        far as the surface if that is worth it, which the report tells.
    feature_band
        Share of `hausdorff` that curves and corners which are kept may move, above 0; None for a fifth. Less keeps them
        sharper, more leaves cells there more room.
    surface
        Surface to slide on instead of the input's own: a path or a pyvista mesh, which may be finer.
        Its sharp curves and corners, lines between its tags (arrays as on quadrilaterals of the mesh), and lines that
        it holds are matched with edges and nodes of the mesh's skin, which is put there: on flat faces, straight edges
        and corners exactly. Curves between tags go to those between the same tags, where the mesh has them, others to
        where they are near. Not with `features` "soft", or where "auto" takes them for noise. The skin may be tangled.
        Cells may lose quality on the way, but none folds; the report says what is matched, and if the bound is not
        reached. Refused if its bounding box is not about that of the mesh.
    interfaces
        Regions of the mesh (materials, parts, blocks), the faces between which are kept: "auto": what the mesh says, by
        sections of a deck, by an array such as material or gmsh:physical, or by sets of cells; "ignore": none; the name
        of an array on cells; or (m,) integers. Flat ones are kept in their planes, curved ones within `hausdorff`, with
        the curves where they meet; where the boundary does not slide, or `hausdorff` is 0, nodes stay on curved ones.
    couplings
        Pairs of nodes that move together, exactly, by the rigid map that takes them to each other (periodic faces,
        sectors): "auto": what the file says (Gmsh's $Periodic, *EQUATION and *MPC of decks), and nodes of parts that
        share no node, where they are at the same place; "ignore": none; or (k, 2) ids of nodes, the first of each pair
        being the image of the second. What one node of a pair may not do, the other may not either.
    conserve_volume
        With "slide": give the result the volume of the input to rounding. (Without, only what is more than .3 %, and by
        the barrier, is made up for.) What the run has changed is made up for at its end, by the least change of shape
        within `hausdorff`; the report says if that is not enough. Where the mesh has regions (see `interfaces`), each
        gets the volume of its own.
    fixed
        Nodes that stay: (n,) booleans, (n, 3) booleans by component, node ids, or the name of a point array that is
        not zero there.
    target
        Perfect shape: "auto" (cubes, but valid cells that are clearly stretched keep their proportions, as in
        boundary layers; cubes with the quaternionic energy), "cube" (of other types their ideal), "a:b:c" or three
        numbers (a box, where all cells are hexahedra), "input" (the cells' own shapes), (m, 3) edge lengths of a box
        for every cell, or the (n, 3) points of a reference mesh with the same cells.
    sizes
        Volumes of cells: "input": as they are, so that valid cells do not shrink or swell more than
        their shape is worth, inverted ones having no size; "free"; (m,) target volumes, in the mesh's unit of length
        cubed, or the name of a cell array with them: quality may be lost on the way to these, but no cell folds.
        What counts is the ratio of the two; the report has the smallest and largest. Without effect where the
        distortion alone is minimized: in meshes with flat or fixed boundary, by the quaternionic energy always and by
        the other, where they are valid, until the worst cells are raised.
    weight
        "reference": every cell counts the same; "volume": by its volume in the input, the dV of Gruber & Aulisa.
    energy
        "barrier": the conformally invariant distortion: every cell counts the same whatever its size, and none can
        collapse; "quaternionic": the distortion int |*df - N df|^2 of Gruber & Aulisa itself, blind to orientation,
        kept valid by the line search alone.
    quadrature
        "gauss" (2 x 2 x 2), "corners", or "auto": Gauss points for the quaternionic energy; corners for the barrier,
        which at the Gauss points would not see a corner fold.
    method
        "lbfgs"; "newton": with the exact Hessian; "majorize": with a convex part of it, normals frozen as by Gruber &
        Aulisa, equation (11); "auto": L-BFGS, then Newton for what it leaves, where nothing but the distortion counts,
        else "majorize", as far as it is worth before the worst cells are raised.
    emphasis
        "mean" makes the cells good on the whole, "worst" raises the worst ones once the distortion is low: from then
        on the smallest scaled Jacobian counts more than the sum (of the barrier only); "auto" is "worst" with the
        barrier, "mean" with the quaternionic energy.
    gradient_tolerance
        Stop where the gradient is this much smaller than at the start; with `emphasis` on the worst cells, that is
        only reached by meshes that become regular, others go on to the worst cells where the energy stalls.
    max_iterations
        Stop after so many.

    Raises
    ------
    OptionError
        If a value, or a combination of values, makes no sense.

    Examples
    --------
    >>> Options(boundary="slippery")
    Traceback (most recent call last):
        ...
    hexconformal.OptionError: boundary must be 'slide', 'fixed' or 'free', not 'slippery'
    """

    boundary: str = "slide"
    fixed: Any = None
    hausdorff: float = 0.005
    constraint: str = "barrier"
    eps: float = 1e-7
    features: str = "auto"
    feature_band: float | None = None
    surface: Any = None
    interfaces: Any = "auto"
    couplings: Any = "auto"
    conserve_volume: bool = False
    target: Any = "auto"
    sizes: Any = "input"
    weight: str = "reference"
    energy: str = "barrier"
    quadrature: str = "auto"
    method: str = "auto"
    emphasis: str = "auto"
    gradient_tolerance: float = 1e-6
    max_iterations: int = 200

    def __post_init__(self) -> None:
        require_choices(self, CHOICES)
        require_numbers(self, "eps", "gradient_tolerance", "hausdorff", optional=["feature_band"])
        require_counts(self, "max_iterations")
        require_flags(self, "conserve_volume")
        if not isinstance(self.target, str):
            array_of_numbers("target", self.target, "a name, edge lengths or points")
        if not 0.0 <= self.gradient_tolerance < 1.0:
            raise OptionError(f"gradient_tolerance must lie in [0, 1), not {self.gradient_tolerance!r}")
        if not 0.0 <= self.hausdorff < 1.0:
            raise OptionError(
                f"hausdorff must be a share of the bounding box's diagonal in [0, 1), not {self.hausdorff!r}"
            )
        if self.feature_band is not None and not 0.0 < self.feature_band <= 1.0:
            raise OptionError(f"feature_band must be a share of hausdorff in (0, 1], not {self.feature_band!r}")
        if not 0.0 < self.eps < float("inf"):
            raise OptionError(f"eps must be positive, not {self.eps!r}")
        if self.constraint == "compatible" and self.surface is not None:
            raise OptionError("constraint='compatible' must go without another surface to slide on")
        if self.surface is not None and (self.boundary != "slide" or not self.hausdorff):
            raise OptionError("surface must go with boundary='slide' and hausdorff > 0")
        if self.conserve_volume and (self.boundary == "free" or self.surface is not None):
            raise OptionError("conserve_volume must go with boundary='slide', and without another surface to slide on")
        if self.changes_sizes and self.energy != "barrier":
            raise OptionError("sizes that cells should get must go with energy='barrier'")
        if isinstance(self.target, str) and self.target == "auto" and self.energy == "quaternionic":
            object.__setattr__(self, "target", "cube")
        if self.emphasis == "worst" and self.energy == "quaternionic":
            raise OptionError(
                "emphasis='worst' must go with energy='barrier': the quaternionic energy is blind to orientation"
            )

    @property
    def quadrature_rule(self) -> str:
        """The quadrature, with "auto" decided."""
        if self.quadrature != "auto":
            return self.quadrature
        return "gauss" if self.energy == "quaternionic" else "corners"

    @property
    def raises_worst(self) -> bool:
        """True where the worst cells are raised once the distortion is low."""
        return self.energy == "barrier" if self.emphasis == "auto" else self.emphasis == "worst"

    @property
    def changes_sizes(self) -> bool:
        """True where cells should get other sizes than they have."""
        return not (isinstance(self.sizes, str) and self.sizes in ("input", "free"))

    def described(self) -> dict[str, Any]:
        """The options in plain types, arrays by their shape alone, for a report."""
        return {field.name: _described(getattr(self, field.name)) for field in fields(self)}


def _described(value: Any) -> Any:
    if value is None or isinstance(value, (str, int, float, np.generic)):
        return value
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if isinstance(value, (list, tuple)):
        return f"given ({len(value)} values)"
    shape = getattr(value, "shape", None)
    return f"given ({' x '.join(map(str, shape)) if shape else type(value).__name__})"


@dataclass(frozen=True)
class Record:
    """One iteration of a run.

    Attributes
    ----------
    iteration
        0 is the input.
    phase
        The solver at work.
    energy
        The summed distortion, in the mesh's own units; NaN where the barrier is infinite, since cells are inverted
        still. Raising the worst cells may raise it.
    gradient
        Norm of its admissible gradient, relative to the input's; NaN where other things are minimized with it.
    step
        Length of the step taken, 1 for a full one.
    min_scaled_jacobian, mean_scaled_jacobian
        Over the cells, each by its smallest corner.
    inverted
        Number of cells with a scaled Jacobian that is not positive.
    seconds
        Since the run began.
    flat
        Number of cells that are inverted or have next to no volume.
    min_shape
        Smallest mean ratio of a corner.
    worst_gain
        By how much the worst cell of a type has a larger scaled Jacobian than the input's; the least of all types.

    Examples
    --------
    >>> print(Record(7, "lbfgs", 4.685, 0.01336, 1.0, 0.98728, 0.99937, 0, 1.36))
    7 lbfgs  energy 4.685e+00  gradient 1.3e-02  min 0.9873  mean 0.9994  inverted 0  1.4 s
    >>> print(Record(0, "input", float("nan"), float("nan"), 1.0, -0.25, 0.73, 4, 0.02))  # NaN: not told
    0 input  min -0.2500  mean 0.7300  inverted 4  0.0 s
    """

    iteration: int
    phase: str
    energy: float
    gradient: float
    step: float
    min_scaled_jacobian: float
    mean_scaled_jacobian: float
    inverted: int
    seconds: float
    flat: int = 0
    min_shape: float = 0.0
    worst_gain: float = 0.0

    def __str__(self) -> str:
        energy = "" if isnan(self.energy) else f"  energy {self.energy:.3e}"
        gradient = "" if isnan(self.gradient) else f"  gradient {self.gradient:.1e}"
        return (
            f"{self.iteration} {self.phase}{energy}{gradient}"
            f"  min {self.min_scaled_jacobian:.4f}  mean {self.mean_scaled_jacobian:.4f}"
            f"  inverted {self.inverted}  {self.seconds:.1f} s"
        )
