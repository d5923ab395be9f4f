"""Base classes of user-defined hinges, bodies and force elements.

One class, one file, public names only (`from mstmm.derive import Hinge, Param`).  Coordinates,
speeds and parameters are declared with units; `q`, `u` and `p` arrive as `Symbols`, indexable by
number and readable by name (`q.angle`, `p.radius`).
"""

from __future__ import annotations

from collections.abc import Iterator
from importlib import import_module
from typing import ClassVar

import sympy as sp

from mstmm.display import NotebookDisplay
from mstmm.ir.element_spec import Param

from .derivation import tilde

__all__ = ["Body", "ForceElement", "Hinge", "Param", "Symbols", "rotation_about"]


class Symbols:
    """Named scalar symbols: `q[0]` and `q.angle` are the same symbol."""

    def __init__(self, prefix: str, names: tuple[str, ...]) -> None:
        self._names = names
        self._symbols = tuple(sp.Symbol(f"{prefix}_{name}", real=True) for name in names)

    def __len__(self) -> int:
        return len(self._symbols)

    def __iter__(self) -> Iterator[sp.Symbol]:
        return iter(self._symbols)

    def __getitem__(self, index: int) -> sp.Symbol:
        return self._symbols[index]

    def __getattr__(self, name: str) -> sp.Symbol:
        if name in self.__dict__.get("_names", ()):
            return self._symbols[self._names.index(name)]
        declared = ", ".join(self._names) or "none"
        raise AttributeError(f"{name!r} is not declared; declared names: {declared}")


def describe_array(what: str, declared: tuple[Param, ...]) -> str:
    """Description of an array of declared quantities: names and units in order."""
    entries = ", ".join(f"{p.name} [{p.unit}]" if p.unit else p.name for p in declared)
    return f"{what}: {entries}" if entries else what


class _Definition(NotebookDisplay):
    """Base class of elements; displays equations, which are derived on first display."""

    name: ClassVar[str]
    title: ClassVar[str] = ""

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self.title or self.name}>"

    def _repr_html_(self) -> str:
        return self._equations("_repr_html_")

    def _repr_latex_(self) -> str:
        return self._equations("_repr_latex_")

    def _equations(self, how: str) -> str:
        # Imported by name, because `derive.show` is a higher layer.
        return str(getattr(import_module("mstmm").equations(self), how)())


class Hinge(_Definition):
    """Motion of the outboard point P relative to the inboard point Q.

    `frame_rule` is the orientation of the hinge frame in a scene and `scene_keys` are the keys of a
    scene's hinge that it reads (`mstmm.ir.hinge_properties.FRAMES`); other parameters are given
    by name.  `motion_text` describes the free motion in a few words.

    Subclasses declare the class attributes and `rotation` (P axes to Q axes, 3 x 3) and
    `position` (P from Q in Q axes, 3 x 1), both in the hinge frame.  The motion subspace and
    the bias acceleration follow from them.  Speeds are the rates of the coordinates unless
    `coordinate_rates` gives qdot = N(q) u.
    """

    name: ClassVar[str]
    title: ClassVar[str] = ""
    coordinates: ClassVar[tuple[Param, ...]] = ()
    speeds: ClassVar[tuple[Param, ...] | None] = None
    parameters: ClassVar[tuple[Param, ...]] = ()
    sources: ClassVar[tuple[str, ...]] = ()
    motion_text: ClassVar[str] = ""
    frame_rule: ClassVar[str] = "axis"
    scene_keys: ClassVar[tuple[str, ...]] = ("axis",)
    #: Hinge whose kernels this one uses; the two differ only in their scene keys.
    equivalent_builtin: ClassVar[str] = ""

    def rotation(self, q: Symbols, p: Symbols) -> sp.Matrix:
        """Rotation from P axes to Q axes (3 x 3, orthogonal for every q)."""
        return sp.eye(3)

    def position(self, q: Symbols, p: Symbols) -> sp.Matrix:
        """P from Q in Q axes (3 x 1), m."""
        return sp.zeros(3, 1)

    def coordinate_rates(self, q: Symbols, u: Symbols, p: Symbols) -> sp.Matrix | None:
        """Coordinate rates from speeds; None if speeds are the coordinate rates."""
        return None

    def motion_subspace(self, q: Symbols, p: Symbols) -> sp.Matrix | None:
        """Stated H (6 x nu, rows v then w, P axes); checked against the derived one."""
        return None

    def bias_acceleration(self, q: Symbols, u: Symbols, p: Symbols) -> sp.Matrix | None:
        """Stated acceleration at zero udot (6 x 1, P axes); checked."""
        return None

    def singularity_measure(self, q: Symbols, p: Symbols) -> sp.Expr | None:
        """Expression that tends to zero at a singularity; a run warns below 1e-3."""
        return None


class Body(_Definition):
    """A body defined by the force and moment that its motion requires at its input end.

    `residual` gives [force; moment about the input end] (6 x 1, body axes) that produces linear
    acceleration a of the input end and angular acceleration alpha, at angular velocity w,
    without external loads.  It is linear in a and alpha; its derivative is the mass matrix.
    Axes and origin are those of the body's table in the scene, whichever end is the input end.

    `kinetic_energy` is the energy supplied by the power of the residual.  The power of internal
    actuators (a motor that keeps a wheel at its rate) belongs to neither.
    """

    name: ClassVar[str]
    title: ClassVar[str] = ""
    parameters: ClassVar[tuple[Param, ...]] = ()
    sources: ClassVar[tuple[str, ...]] = ()
    #: True if packing converts the parameters to hinge axes about the input end.
    uses_hinge_axes: ClassVar[bool] = False

    def residual(self, a: sp.Matrix, alpha: sp.Matrix, w: sp.Matrix, p: Symbols) -> sp.Matrix:
        """Required [force; moment] at the input end, 6 x 1, body axes."""
        raise NotImplementedError

    def kinetic_energy(self, v: sp.Matrix, w: sp.Matrix, p: Symbols) -> sp.Expr:
        """Kinetic energy from velocity of the input end and angular velocity, body axes, J."""
        raise NotImplementedError


class ForceElement(_Definition):
    """A massless element between two ends, here called `from` (F) and `to` (T).

    `wrench` gives force (3 x 1) and moment (3 x 1) on the T end at its point, in F axes, from
    the relative motion in F axes: position x of T from F, its rate v as seen from F, rotation R
    (T to F axes), relative angular velocity w.  The F end receives the opposite, shifted by x.
    `potential`, if given, is a function of x only; loads of the wrench without potential count
    as work.  If `deflection` is given, `potential` is a function of it: its load is derived,
    and `wrench` gives only the remaining load.
    """

    name: ClassVar[str]
    title: ClassVar[str] = ""
    parameters: ClassVar[tuple[Param, ...]] = ()
    sources: ClassVar[tuple[str, ...]] = ()

    def wrench(
        self,
        x: sp.Matrix,
        v: sp.Matrix,
        rotation: sp.Matrix,
        w: sp.Matrix,
        p: Symbols,
        effort: sp.Symbol,
        t: sp.Symbol,
    ) -> tuple[sp.Matrix, sp.Matrix]:
        """(force, moment) on the T end at its point, F axes, N and N*m."""
        raise NotImplementedError

    def potential(self, x: sp.Matrix, p: Symbols) -> sp.Expr:
        """Potential energy as a function of x, or of the deflection if that is given, J."""
        return sp.Integer(0)

    def deflection(self, x: sp.Matrix, rotation: sp.Matrix, p: Symbols) -> sp.Matrix | None:
        """Functions (n x 1) of x and the rotation on which the potential depends."""
        return None

    def domain(self, x: sp.Matrix, p: Symbols) -> sp.Basic | None:
        """Condition under which the wrench is defined; the run stops where it fails."""
        return None

    def domain_by_rotation(self, x: sp.Matrix, rotation: sp.Matrix, p: Symbols) -> sp.Basic | None:
        """Condition on x and the rotation under which the wrench is defined."""
        return self.domain(x, p)


def rotation_about(axis: int | tuple[sp.Expr, sp.Expr, sp.Expr], angle: sp.Expr) -> sp.Matrix:
    """Rotation matrix about a coordinate axis (0, 1, 2) or a unit vector (Rodrigues)."""
    if isinstance(axis, int):
        unit = [sp.Integer(int(i == axis)) for i in range(3)]
    else:
        unit = [sp.sympify(a) for a in axis]
    a = sp.Matrix(unit)
    cosine, sine = sp.cos(angle), sp.sin(angle)
    return sp.Matrix(cosine * sp.eye(3) + sine * tilde(a) + (1 - cosine) * (a * a.T))
