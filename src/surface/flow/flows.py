"""The flows: each is a surface, the energy that falls, and the quantities that are conserved."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from hexconformal.common import OptionError, is_number

from .step import CONSERVED
from .terms import Bending, Membrane, Tension, Term

__all__ = ["Flow", "Helfrich", "MeanCurvature", "PWillmore", "Willmore"]


class Flow:
    """The gradient flow <u_t, phi> = -dE(phi) of a sum of terms.

    Nodes on the boundary of an open surface stay.

    Parameters
    ----------
    mesh
        Anything :func:`surface.as_surface_mesh` takes: triangles, quadrilaterals or both.
    terms
        The energy; see :mod:`surface.flow.terms`.
    conserve
        "area", "volume", both or none, kept at every step by a scalar multiplier each.
    fixed
        Further nodes that stay: (n,) booleans, node ids, or a name: of a set or group of the file, or of a point array
        that is not zero there.

    Raises
    ------
    OptionError
        If something else is to be conserved, or there is no term.

    Examples
    --------
    >>> tetrahedron = ([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    >>> Flow(tetrahedron, [Tension(0.5), Bending(2)], conserve="volume")
    Flow(Tension(tension=0.5) + Bending(p=2), conserve=('volume',))
    """

    def __init__(self, mesh: Any, terms: Sequence[Term], conserve: str | Sequence[str] = (), fixed: Any = None) -> None:
        conserved = _as_tuple(conserve)
        unknown = [name for name in conserved if not isinstance(name, str) or name not in CONSERVED]
        if unknown:
            raise OptionError(f"conserve must be 'area', 'volume' or both, not {unknown[0]!r}")
        parts = _as_tuple(terms)
        if not parts or not all(isinstance(term, Term) for term in parts):
            raise OptionError("terms must be one or more, such as Tension() or Bending()")
        self.mesh, self.terms, self.conserve, self.fixed = mesh, parts, conserved, fixed

    def __repr__(self) -> str:
        return f"{type(self).__name__}({' + '.join(map(repr, self.terms))}, conserve={self.conserve})"


def _as_tuple(value: Any) -> tuple[Any, ...]:
    """One value or several, as a tuple."""
    try:
        return (value,) if isinstance(value, str) else tuple(value)
    except TypeError:
        return (value,)


class MeanCurvature(Flow):
    """Mean curvature flow, u_t = Y: the area falls. A sphere shrinks as R^2 = R0^2 - 4 t, equation (27).

    Parameters
    ----------
    mesh, conserve, fixed
        See :class:`surface.Flow`.
    """

    def __init__(self, mesh: Any, conserve: str | Sequence[str] = (), fixed: Any = None) -> None:
        super().__init__(mesh, [Tension()], conserve, fixed)


class PWillmore(Flow):
    """p-Willmore flow, of int |Y|^p; p = 0 is mean curvature flow.

    A sphere follows R^(p+2) = R0^(p+2) + (p+2) (p-2) 2^p t, equation (27).

    Parameters
    ----------
    mesh, conserve, fixed
        See :class:`surface.Flow`.
    p
        Exponent, 0 or at least 1.

    Raises
    ------
    OptionError
        If p is another.
    """

    def __init__(self, mesh: Any, p: float = 2.0, conserve: str | Sequence[str] = (), fixed: Any = None) -> None:
        super().__init__(mesh, [Tension() if is_number(p) and p == 0 else Bending(p)], conserve, fixed)


class Willmore(PWillmore):
    """Willmore flow, of int |Y|^2 = 4 int H^2.

    Parameters
    ----------
    mesh, conserve, fixed
        See :class:`surface.Flow`.
    """

    def __init__(self, mesh: Any, conserve: str | Sequence[str] = (), fixed: Any = None) -> None:
        super().__init__(mesh, 2.0, conserve, fixed)


class Helfrich(Flow):
    """Flow of a membrane's bending energy, int kc/2 (2 H - c0)^2 + gamma, equation (25).

    Parameters
    ----------
    mesh, conserve, fixed
        See :class:`surface.Flow`; area and volume are kept unless you say otherwise.
    kc
        Bending modulus, an energy.
    c0
        Spontaneous curvature, one over a length.
    gamma
        Surface tension, an energy per area.

    Raises
    ------
    OptionError
        If kc is not positive.
    """

    def __init__(
        self,
        mesh: Any,
        kc: float = 1.0,
        c0: float = 0.0,
        gamma: float = 0.0,
        conserve: str | Sequence[str] = ("area", "volume"),
        fixed: Any = None,
    ) -> None:
        super().__init__(mesh, [Membrane(kc, c0, gamma)], conserve, fixed)
