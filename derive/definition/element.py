"""What a new element declares: the seam for hinges, bodies and force elements of a researcher.

One class, one file, public names only (`from mstmm.derive import Hinge, Param`).  Coordinates,
speeds and parameters are declared with units; `q`, `u` and `p` arrive as `Symbols`, indexable by
number and readable by name (`q.angle`, `p.radius`).
"""

from __future__ import annotations

from collections.abc import Iterator
from importlib import import_module
from typing import ClassVar

import sympy as sp

from mstmm.ir.element_spec import Param
from mstmm.notebook_html import NotebookDisplay

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
        raise AttributeError(f"no {name!r} here; declared are {', '.join(self._names) or 'none'}")


def describe_array(what: str, declared: tuple[Param, ...]) -> str:
    """Meaning of an array that holds declared numbers, by their names and units in order."""
    entries = ", ".join(f"{p.name} [{p.unit}]" if p.unit else p.name for p in declared)
    return f"{what}: {entries}" if entries else what


class _Definition(NotebookDisplay):
    """An element shows its equations, which are derived when somebody looks."""

    name: ClassVar[str]
    title: ClassVar[str] = ""

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self.title or self.name}>"

    def _repr_html_(self) -> str:
        return self._equations("_repr_html_")

    def _repr_latex_(self) -> str:
        return self._equations("_repr_latex_")

    def _equations(self, how: str) -> str:
        # by name: pages are made on floors above this one
        return str(getattr(import_module("mstmm").equations(self), how)())


class Hinge(_Definition):
    """Motion of the outboard point P against the inboard point Q (design: one hinge for all).

    `frame` says how its frame lies in a scene and `keys` which keys of a scene's hinge it reads
    (`mstmm.ir.hinge_properties.FRAMES`); parameters that are no keys are given by name.  `allows`
    says what moves, in a few words.

    Subclasses declare the class attributes and `rotation` (P axes to Q axes, 3 x 3) and
    `position` (P from Q in Q axes, 3 x 1), both in the hinge frame.  The motion subspace and the
    bias acceleration follow from them.  Speeds are the rates of the coordinates unless `rates`
    gives qdot = N(q) u.
    """

    name: ClassVar[str]
    title: ClassVar[str] = ""
    coordinates: ClassVar[tuple[Param, ...]] = ()
    speeds: ClassVar[tuple[Param, ...] | None] = None
    parameters: ClassVar[tuple[Param, ...]] = ()
    sources: ClassVar[tuple[str, ...]] = ()
    allows: ClassVar[str] = ""
    frame: ClassVar[str] = "axis"
    keys: ClassVar[tuple[str, ...]] = ("axis",)
    #: The hinge whose kernels move this one too, where two types differ in what a scene says alone.
    runs_as: ClassVar[str] = ""

    def rotation(self, q: Symbols, p: Symbols) -> sp.Matrix:
        """Rotation from P axes to Q axes (3 x 3, orthogonal for every q)."""
        return sp.eye(3)

    def position(self, q: Symbols, p: Symbols) -> sp.Matrix:
        """P from Q in Q axes (3 x 1), m."""
        return sp.zeros(3, 1)

    def rates(self, q: Symbols, u: Symbols, p: Symbols) -> sp.Matrix | None:
        """Coordinate rates from speeds; None where speeds are the rates."""
        return None

    def subspace(self, q: Symbols, p: Symbols) -> sp.Matrix | None:
        """H (6 x nu, rows v then w, P axes) if the author states it; checked, not trusted."""
        return None

    def bias(self, q: Symbols, u: Symbols, p: Symbols) -> sp.Matrix | None:
        """Relative acceleration at zero udot (6 x 1, P axes) if stated; checked, not trusted."""
        return None

    def singular_when(self, q: Symbols, p: Symbols) -> sp.Expr | None:
        """An expression that tends to zero where the coordinates fail; the run warns below 1e-3."""
        return None


class Body(_Definition):
    """A body stated by the force and moment its motion needs at its input end.

    `residual` gives [force; moment about the input end] (6 x 1, body axes) that produces linear
    acceleration a of the input end, angular acceleration alpha, at angular velocity w, without
    external loads.  It is linear in a and alpha; its mass matrix is its derivative.  Axes and
    origin are those of the body's table in the scene, by whichever end it is held.

    `kinetic_energy` is the energy that the residual's power feeds.  What something inside the body
    spends (a motor that keeps a wheel at its rate) is neither in the one nor in the other.
    """

    name: ClassVar[str]
    title: ClassVar[str] = ""
    parameters: ClassVar[tuple[Param, ...]] = ()
    sources: ClassVar[tuple[str, ...]] = ()
    #: True if whoever packs the scene gives the parameters in hinge axes about the input end.
    in_hinge_axes: ClassVar[bool] = False

    def residual(self, a: sp.Matrix, alpha: sp.Matrix, w: sp.Matrix, p: Symbols) -> sp.Matrix:
        """Needed [force; moment] at the input end, 6 x 1, body axes."""
        raise NotImplementedError

    def kinetic_energy(self, v: sp.Matrix, w: sp.Matrix, p: Symbols) -> sp.Expr:
        """Kinetic energy from velocity of the input end and angular velocity, body axes, J."""
        raise NotImplementedError


class ForceElement(_Definition):
    """A massless element between two ends, here called `from` (F) and `to` (T).

    `wrench` gives force (3 x 1) and moment (3 x 1) on the T end at its point, in F axes, from the
    relative motion in F axes: position x of T from F, its rate v as seen from F, rotation R (T to
    F axes), relative angular velocity w.  The F end receives the opposite, shifted by x.
    `potential`, if there is one, is a function of x alone; what the wrench does beyond it counts as
    work.  Where `deflection` is stated, `potential` is a function of that instead: its load follows
    from it, and `wrench` gives what acts besides.
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
        """Potential energy as a function of x, or of the deflection where that is stated, J."""
        return sp.Integer(0)

    def deflection(self, x: sp.Matrix, rotation: sp.Matrix, p: Symbols) -> sp.Matrix | None:
        """Functions (n x 1) of x and the rotation on which the potential depends."""
        return None

    def defined_when(self, x: sp.Matrix, p: Symbols) -> sp.Basic | None:
        """Condition under which the wrench is defined; the run stops where it fails."""
        return None

    def defined_within(self, x: sp.Matrix, rotation: sp.Matrix, p: Symbols) -> sp.Basic | None:
        """The same by x and the rotation."""
        return self.defined_when(x, p)


def rotation_about(axis: int | tuple[sp.Expr, sp.Expr, sp.Expr], angle: sp.Expr) -> sp.Matrix:
    """Rotation matrix about a coordinate axis (0, 1, 2) or a unit vector (Rodrigues)."""
    if isinstance(axis, int):
        unit = [sp.Integer(int(i == axis)) for i in range(3)]
    else:
        unit = [sp.sympify(a) for a in axis]
    a = sp.Matrix(unit)
    cosine, sine = sp.cos(angle), sp.sin(angle)
    return sp.Matrix(cosine * sp.eye(3) + sine * tilde(a) + (1 - cosine) * (a * a.T))
