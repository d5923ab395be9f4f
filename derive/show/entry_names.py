"""Entries of arrays by the names that their authors gave them: p[0] of a spring is `stiffness`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

import sympy as sp
from sympy.matrices.expressions.matexpr import MatrixElement

from mstmm.ir.element_spec import ElementSpec
from mstmm.ir.param import Param

from ..definition.derivation import Derivation
from ..definition.element import describe_array


class AuthorName(sp.Symbol):
    """A number by the name that its author gave it, which says nothing of dots."""


class Symmetric(sp.MatrixSymbol):
    """A matrix of which the upper triangle stands for both."""

    def _entry(self, i: sp.Expr, j: sp.Expr, **kwargs: object) -> sp.Expr:
        return MatrixElement(self, min(i, j), max(i, j))


@dataclass(frozen=True)
class NamedPart:
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
            return [AuthorName(self.name)]
        return list(sp.MatrixSymbol(self.name, *self.shape).as_explicit())

    def written(self) -> list[str]:
        """What code calls each entry; counted from zero as code does."""
        rows, columns = self.shape
        if self.length == 1:
            return [self.name]
        if columns == 1:
            return [f"{self.name}[{i}]" for i in range(rows)]
        return [f"{self.name}[{i}][{j}]" for i in range(rows) for j in range(columns)]


Parts = tuple[NamedPart, ...]


def _motion_parts(subscript: str) -> Parts:
    return tuple(
        NamedPart(f"{name}{subscript}", unit, meaning, (3, 1))
        for name, unit, meaning in (
            ("w", "rad/s", "angular velocity"),
            ("wd", "rad/s2", "angular acceleration"),
            ("rdd", "m/s2", "acceleration of P"),
        )
    )


#: How small an inertia is that is taken for rounding.
_FLOOR_PARTS = (
    NamedPart("floor_v", "kg", "least mass along an axis"),
    NamedPart("floor_w", "kg*m2", "least inertia about an axis"),
)


def _sweep_array_parts(array: str) -> Parts:
    """Arrays that the sweep hands from body to body."""
    head, _, subscript = array.partition("_")
    if head == "motion":
        return _motion_parts(f"_{subscript}" if subscript else "")
    return _FLOOR_PARTS if array == "floor" else ()


#: Behind the parameters of a body that is stated in a frame of its own.
_FRAME_PARTS = (
    NamedPart("R_u", "", "rotation, hinge axes to the body's own", (3, 3)),
    NamedPart("r_u", "m", "P from the body's own origin, own axes", (3, 1)),
)
#: Arrays that go with coordinates, and with speeds, entry by entry.
_WITH_COORDINATES, _WITH_SPEEDS = ("qdot",), ("s", "udot", "tau", "g", "z")


@dataclass(frozen=True)
class DeclaredNames:
    """What the author of an element declared, by the arrays that hold it."""

    own: Mapping[str, Parts] = field(default_factory=dict)
    #: Labels of the entries of arrays that go along with coordinates or speeds.
    along: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    #: How the meaning of an array lists them, which a table of entries need not say again.
    listed: tuple[str, ...] = ()

    def parts(self, array: str, length: int) -> Parts:
        """Names of the entries of an array of this length; none where nobody named them."""
        array_parts = self.own.get(array, ())
        for parts in (
            array_parts,
            array_parts + _FRAME_PARTS if array == "p" else (),
            _sweep_array_parts(array),
        ):
            if parts and sum(part.length for part in parts) == length:
                return parts
        return ()

    def written(self, array: str, length: int) -> tuple[str, ...]:
        """Entries of an array as code is read: p.stiffness, w[0]; none where nobody named them."""
        base, slope = array.removeprefix("d_"), "d_" if array.startswith("d_") else ""
        prefix = f"{slope}{base}." if base in self.own else slope
        return tuple(prefix + x for part in self.parts(base, length) for x in part.written())

    def labels(self, array: str, length: int) -> tuple[str, ...]:
        """Indices of the entries on a left side, where there are several."""
        array_labels = self.along.get(array, ())
        return array_labels if len(array_labels) == length > 1 else ()

    def meaning(self, text: str) -> str:
        """The meaning of an array without the list of its entries."""
        for entry_list in self.listed:
            text = text.replace(entry_list, "", 1)
        return text


def declared_names(
    coordinates: Iterable[Param], speeds: Iterable[Param], parameters: Iterable[Param]
) -> DeclaredNames:
    """Names of the arrays p, q and u and of those that go along with them."""
    groups = {"p": tuple(parameters), "q": tuple(coordinates), "u": tuple(speeds)}
    parts_by_array = {
        array: tuple(NamedPart(x.name, x.unit, x.meaning) for x in group)
        for array, group in groups.items()
    }
    q, u = (tuple(x.name for x in groups[array]) for array in "qu")
    labels_by_array = dict.fromkeys(_WITH_COORDINATES, q) | dict.fromkeys(_WITH_SPEEDS, u)
    return DeclaredNames(
        parts_by_array,
        labels_by_array,
        tuple(describe_array("", group) for group in groups.values() if group),
    )


def spec_names(spec: ElementSpec) -> DeclaredNames:
    """The same of an element that is stored."""
    return declared_names(spec.coordinates, spec.speeds, spec.parameters)


class NamedEntries:
    """What a derivation's arrays hold, by names of which none is that of another quantity."""

    def __init__(self, derivation: Derivation, names: DeclaredNames) -> None:
        self.names = names
        equations = (*derivation.premises, *derivation.definitions)
        defined_symbols = [e.left for e in equations if isinstance(e.left, sp.MatrixSymbol)]
        input_symbols = [q.symbol for q in derivation.inputs]
        output_symbols = [q.symbol for q in derivation.outputs]
        self._taken = {str(s.name) for s in (*input_symbols, *output_symbols, *defined_symbols)}
        arrays = {
            str(s.name): s
            for s in (*input_symbols, *defined_symbols, *output_symbols)
            if _has_fixed_length(s)
        }
        self._parts = {name: self._apart(name, int(s.rows)) for name, s in arrays.items()}
        #: Entry of an array -> what its author calls it.
        self.entries = _symmetric_entries(derivation)
        for name, symbol in arrays.items():
            values = [symbol_ for part in self._parts[name] for symbol_ in part.symbols()]
            self.entries |= dict(zip(symbol.as_explicit(), values, strict=True)) if values else {}
            self.entries |= _labelled_entries(name, symbol, names)

    def parts(self, array: str, length: int) -> Parts:
        """The entries of an array of this length."""
        return self._parts[array] if array in self._parts else self.names.parts(array, length)

    def _apart(self, array: str, length: int) -> Parts:
        """Where a name is taken, the array stands before it: p_name."""
        parts = []
        for part in self.names.parts(array, length):
            name = part.name if part.name not in self._taken else f"{array}_{part.name}"
            self._taken.add(name)
            parts.append(replace(part, name=name))
        return tuple(parts)


def _has_fixed_length(symbol: sp.MatrixSymbol) -> bool:
    """Whether this is a column of a length that is known."""
    rows, columns = symbol.shape
    return bool(columns == 1 and rows.is_Integer and rows > 0)


def _symmetric_entries(derivation: Derivation) -> dict[sp.Basic, sp.Basic]:
    """Symmetric matrices, and their entries, as such."""
    replacements: dict[sp.Basic, sp.Basic] = {}
    for q in derivation.inputs:
        if q.symmetric and not q.sized:
            symmetric_symbol = Symmetric(q.name, q.rows, q.columns)
            replacements[q.symbol] = symmetric_symbol
            indices = [(i, j) for i in range(q.rows) for j in range(q.columns)]
            replacements |= {q.symbol[i, j]: symmetric_symbol[i, j] for i, j in indices}
    return replacements


def _labelled_entries(
    array: str, symbol: sp.MatrixSymbol, names: DeclaredNames
) -> dict[sp.Basic, sp.Basic]:
    labels = names.labels(array, int(symbol.rows))
    return {symbol[i, 0]: sp.Symbol(f"{array}_{label}") for i, label in enumerate(labels)}
