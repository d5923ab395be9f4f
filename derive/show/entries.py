"""Entries of arrays by the names that their authors gave them: p[0] of a spring is `stiffness`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

import sympy as sp
from sympy.matrices.expressions.matexpr import MatrixElement

from mstmm.ir.param import Param
from mstmm.ir.spec import ElementSpec

from ..language.derivation import Derivation
from ..language.element import described


class Own(sp.Symbol):
    """A number by the name that its author gave it, which says nothing of dots."""


class Symmetric(sp.MatrixSymbol):
    """A matrix of which the upper triangle stands for both."""

    def _entry(self, i: sp.Expr, j: sp.Expr, **kwargs: object) -> sp.Expr:
        return MatrixElement(self, min(i, j), max(i, j))


@dataclass(frozen=True)
class Part:
    """Neighbouring entries of an array that have a name of their own."""

    name: str
    unit: str = ""
    meaning: str = ""
    shape: tuple[int, int] = (1, 1)

    @property
    def length(self) -> int:
        return self.shape[0] * self.shape[1]

    def symbols(self) -> list[sp.Basic]:
        """What stands for each entry, row by row."""
        if self.length == 1:
            return [Own(self.name)]
        return list(sp.MatrixSymbol(self.name, *self.shape).as_explicit())

    def written(self) -> list[str]:
        """What code calls each entry; counted from zero as code does."""
        rows, columns = self.shape
        if self.length == 1:
            return [self.name]
        if columns == 1:
            return [f"{self.name}[{i}]" for i in range(rows)]
        return [f"{self.name}[{i}][{j}]" for i in range(rows) for j in range(columns)]


Parts = tuple[Part, ...]


def _motion(subscript: str) -> Parts:
    return tuple(
        Part(f"{name}{subscript}", unit, meaning, (3, 1))
        for name, unit, meaning in (
            ("w", "rad/s", "angular velocity"),
            ("wd", "rad/s2", "angular acceleration"),
            ("rdd", "m/s2", "acceleration of P"),
        )
    )


#: How small an inertia is that is taken for rounding.
_FLOOR = (
    Part("floor_v", "kg", "least mass along an axis"),
    Part("floor_w", "kg*m2", "least inertia about an axis"),
)


def _of_the_sweep(array: str) -> Parts:
    """Arrays that the sweep hands from body to body."""
    head, _, subscript = array.partition("_")
    if head == "motion":
        return _motion(f"_{subscript}" if subscript else "")
    return _FLOOR if array == "floor" else ()


#: Behind the parameters of a body that is stated in a frame of its own.
_FRAME = (
    Part("R_u", "", "rotation, hinge axes to the body's own", (3, 3)),
    Part("r_u", "m", "P from the body's own origin, own axes", (3, 1)),
)
#: Arrays that go with coordinates, and with speeds, entry by entry.
_WITH_COORDINATES, _WITH_SPEEDS = ("qdot",), ("s", "udot", "tau", "g", "z")


@dataclass(frozen=True)
class Declared:
    """What the author of an element declared, by the arrays that hold it."""

    own: Mapping[str, Parts] = field(default_factory=dict)
    #: Labels of the entries of arrays that go along with coordinates or speeds.
    along: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    #: How the meaning of an array lists them, which a table of entries need not say again.
    listed: tuple[str, ...] = ()

    def parts(self, array: str, length: int) -> Parts:
        """Names of the entries of an array of this length; none where nobody named them."""
        own = self.own.get(array, ())
        for parts in (own, own + _FRAME if array == "p" else (), _of_the_sweep(array)):
            if parts and sum(part.length for part in parts) == length:
                return parts
        return ()

    def written(self, array: str, length: int) -> tuple[str, ...]:
        """Entries of an array as code is read: p.stiffness, w[0]; none where nobody named them."""
        base, slope = array.removeprefix("d_"), "d_" if array.startswith("d_") else ""
        before = f"{slope}{base}." if base in self.own else slope
        return tuple(before + x for part in self.parts(base, length) for x in part.written())

    def labels(self, array: str, length: int) -> tuple[str, ...]:
        """Indices of the entries on a left side, where there are several."""
        found = self.along.get(array, ())
        return found if len(found) == length > 1 else ()

    def meaning(self, text: str) -> str:
        """The meaning of an array without the list of its entries."""
        for listed in self.listed:
            text = text.replace(listed, "", 1)
        return text


def declared(
    coordinates: Iterable[Param], speeds: Iterable[Param], parameters: Iterable[Param]
) -> Declared:
    """Names of the arrays p, q and u and of those that go along with them."""
    groups = {"p": tuple(parameters), "q": tuple(coordinates), "u": tuple(speeds)}
    own = {
        array: tuple(Part(x.name, x.unit, x.meaning) for x in group)
        for array, group in groups.items()
    }
    q, u = (tuple(x.name for x in groups[array]) for array in "qu")
    along = dict.fromkeys(_WITH_COORDINATES, q) | dict.fromkeys(_WITH_SPEEDS, u)
    return Declared(own, along, tuple(described("", group) for group in groups.values() if group))


def of_spec(spec: ElementSpec) -> Declared:
    """The same of an element that is stored."""
    return declared(spec.coordinates, spec.speeds, spec.parameters)


class Named:
    """What a derivation's arrays hold, by names of which none is that of another quantity."""

    def __init__(self, derivation: Derivation, names: Declared) -> None:
        self.names = names
        equations = (*derivation.premises, *derivation.definitions)
        lefts = [e.left for e in equations if isinstance(e.left, sp.MatrixSymbol)]
        read = [q.symbol for q in derivation.inputs]
        given = [q.symbol for q in derivation.outputs]
        self._taken = {str(s.name) for s in (*read, *given, *lefts)}
        arrays = {str(s.name): s for s in (*read, *lefts, *given) if _counted(s)}
        self._parts = {name: self._apart(name, int(s.rows)) for name, s in arrays.items()}
        #: Entry of an array -> what its author calls it.
        self.entries = _mirrored(derivation)
        for name, symbol in arrays.items():
            values = [one for part in self._parts[name] for one in part.symbols()]
            self.entries |= dict(zip(symbol.as_explicit(), values, strict=True)) if values else {}
            self.entries |= _along(name, symbol, names)

    def parts(self, array: str, length: int) -> Parts:
        """The entries of an array of this length."""
        return self._parts[array] if array in self._parts else self.names.parts(array, length)

    def _apart(self, array: str, length: int) -> Parts:
        """Where a name is taken, the array stands before it: p_name."""
        found = []
        for part in self.names.parts(array, length):
            name = part.name if part.name not in self._taken else f"{array}_{part.name}"
            self._taken.add(name)
            found.append(replace(part, name=name))
        return tuple(found)


def _counted(symbol: sp.MatrixSymbol) -> bool:
    """Whether this is a column of a length that is known."""
    rows, columns = symbol.shape
    return bool(columns == 1 and rows.is_Integer and rows > 0)


def _mirrored(derivation: Derivation) -> dict[sp.Basic, sp.Basic]:
    """Symmetric matrices, and their entries, as such."""
    found: dict[sp.Basic, sp.Basic] = {}
    for q in derivation.inputs:
        if q.symmetric and not q.sized:
            mirrored = Symmetric(q.name, q.rows, q.columns)
            found[q.symbol] = mirrored
            places = [(i, j) for i in range(q.rows) for j in range(q.columns)]
            found |= {q.symbol[i, j]: mirrored[i, j] for i, j in places}
    return found


def _along(array: str, symbol: sp.MatrixSymbol, names: Declared) -> dict[sp.Basic, sp.Basic]:
    labels = names.labels(array, int(symbol.rows))
    return {symbol[i, 0]: sp.Symbol(f"{array}_{label}") for i, label in enumerate(labels)}
