"""Names of symbols and of array entries.

A name is parsed: rdd_IO is r with two dots and subscript IO, omegadot is ω̇. Entries of arrays have
declared names: p[0] of a spring is `stiffness`.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

import sympy as sp
from sympy.matrices.expressions.matexpr import MatrixElement

from mstmm.ir.element_spec import ElementSpec
from mstmm.ir.hinge_properties import Param

from ..definition.derivation import Derivation
from ..definition.element import describe_array

#: Greek letters by name, capitals included.
GREEK = {
    "alpha": "α", "beta": "β", "gamma": "γ", "delta": "δ", "epsilon": "ε", "zeta": "ζ",
    "eta": "η", "theta": "θ", "kappa": "κ", "lambda": "λ", "mu": "μ", "nu": "ν", "xi": "ξ",
    "rho": "ρ", "sigma": "σ", "tau": "τ", "phi": "φ", "chi": "χ", "psi": "ψ", "omega": "ω",
    "Gamma": "Γ", "Delta": "Δ", "Theta": "Θ", "Lambda": "Λ", "Sigma": "Σ", "Phi": "Φ",
    "Psi": "Ψ", "Omega": "Ω", "pi": "π",
}  # fmt: skip

_DOTS = (("ddot", 2), ("dot", 1), ("dd", 2), ("d", 1))


@dataclass(frozen=True)
class SymbolName:
    """Base letter (or word, then `upright`), number of dots, subscript."""

    base: str
    dots: int = 0
    subscript: str = ""
    upright: bool = False

    def code_name(self) -> str:
        """Name as written in code, without dots."""
        return "_".join(filter(None, (self.base, self.subscript)))


def parse_name(name: str) -> SymbolName:
    """Split the name of a port or symbol into base, dots and subscript."""
    head, _, subscript = name.partition("_")
    base, dots = _split_dots(head)
    if is_letter(base):
        return SymbolName(base, dots, subscript)
    match = re.fullmatch(r"([A-Za-z]+?)(\d+)", head)
    if match and is_letter(match[1]):
        return SymbolName(match[1], 0, ",".join(filter(None, (match[2], subscript))))
    is_short = len(subscript) <= 2
    return SymbolName(head if is_short else name, 0, subscript if is_short else "", upright=True)


def parse_author_name(name: str) -> SymbolName:
    """Name chosen by an author: a letter with its subscript, or the word unchanged."""
    head, _, subscript = name.partition("_")
    match = re.fullmatch(r"([A-Za-z]+?)(\d*)", head)
    if match and is_letter(match[1]):
        return SymbolName(match[1], 0, ",".join(filter(None, (match[2], subscript))))
    return SymbolName(name, upright=True)


def _split_dots(head: str) -> tuple[str, int]:
    for suffix, dots in _DOTS:
        if head.endswith(suffix) and is_letter(head.removesuffix(suffix)):
            return head.removesuffix(suffix), dots
    return head, 0


def is_letter(text: str) -> bool:
    """Whether a text is one letter; Greek letters are given by name."""
    return len(text) == 1 or text in GREEK


_SUPERSCRIPT = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")


def unit_text(unit: str) -> str:
    """kg*m2 as kg·m²; a dash for a quantity without unit."""
    if not unit:
        return "–"
    text = re.sub(r"(?<=[A-Za-z])\^?(-?\d+)", lambda m: m[1].translate(_SUPERSCRIPT), unit)
    return text.replace("*", "·")


# --- declared names of array entries --------------------------------------------------------------


class AuthorName(sp.Symbol):
    """A symbol with the declared name of an entry, in which dots are not parsed."""


class Symmetric(sp.MatrixSymbol):
    """A symmetric matrix, displayed by its upper triangle."""

    def _entry(self, i: sp.Expr, j: sp.Expr, **kwargs: object) -> sp.Expr:
        return MatrixElement(self, min(i, j), max(i, j))


@dataclass(frozen=True)
class NamedPart:
    """Consecutive entries of an array that have a common name."""

    name: str
    unit: str = ""
    meaning: str = ""
    shape: tuple[int, int] = (1, 1)

    @property
    def length(self) -> int:
        return self.shape[0] * self.shape[1]

    def symbols(self) -> list[sp.Basic]:
        """Symbol of each entry, row by row."""
        if self.length == 1:
            return [AuthorName(self.name)]
        return list(sp.MatrixSymbol(self.name, *self.shape).as_explicit())

    def code_names(self) -> list[str]:
        """Name of each entry in code, indices from zero."""
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


#: Inertias below which a value counts as rounding.
_FLOOR_PARTS = (
    NamedPart("floor_v", "kg", "least mass along an axis"),
    NamedPart("floor_w", "kg*m2", "least inertia about an axis"),
)


def _sweep_array_parts(array: str) -> Parts:
    """Names of arrays that the sweep passes from body to body."""
    head, _, subscript = array.partition("_")
    if head == "motion":
        return _motion_parts(f"_{subscript}" if subscript else "")
    return _FLOOR_PARTS if array == "floor" else ()


#: Follow the parameters of a body that is defined in its own frame.
_FRAME_PARTS = (
    NamedPart("R_u", "", "rotation, hinge axes to the body's own", (3, 3)),
    NamedPart("r_u", "m", "P from the body's own origin, own axes", (3, 1)),
)
#: Arrays whose entries correspond to coordinates, and to speeds.
_WITH_COORDINATES, _WITH_SPEEDS = ("qdot",), ("s", "udot", "tau", "g", "z")


@dataclass(frozen=True)
class DeclaredNames:
    """Names declared by an element, by array."""

    parts_by_array: Mapping[str, Parts] = field(default_factory=dict)
    #: Labels of entries of arrays that correspond to coordinates or speeds.
    coordinate_labels: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    #: Lists of entries in descriptions of arrays; omitted where a table shows the entries.
    listed_arrays: tuple[str, ...] = ()

    def parts(self, array: str, length: int) -> Parts:
        """Names of the entries of an array of this length; empty if none are declared."""
        array_parts = self.parts_by_array.get(array, ())
        for parts in (
            array_parts,
            array_parts + _FRAME_PARTS if array == "p" else (),
            _sweep_array_parts(array),
        ):
            if parts and sum(part.length for part in parts) == length:
                return parts
        return ()

    def code_entries(self, array: str, length: int) -> tuple[str, ...]:
        """Entries of an array as in code (p.stiffness, w[0]); empty if none are declared."""
        base, slope = array.removeprefix("d_"), "d_" if array.startswith("d_") else ""
        prefix = f"{slope}{base}." if base in self.parts_by_array else slope
        return tuple(prefix + x for part in self.parts(base, length) for x in part.code_names())

    def labels(self, array: str, length: int) -> tuple[str, ...]:
        """Indices of the entries on a left side with several entries."""
        array_labels = self.coordinate_labels.get(array, ())
        return array_labels if len(array_labels) == length > 1 else ()

    def meaning(self, text: str) -> str:
        """Description of an array without the list of its entries."""
        for entry_list in self.listed_arrays:
            text = text.replace(entry_list, "", 1)
        return text


def declared_names(
    coordinates: Iterable[Param], speeds: Iterable[Param], parameters: Iterable[Param]
) -> DeclaredNames:
    """Names of the arrays p, q and u and of the arrays that correspond to them."""
    groups = {"p": tuple(parameters), "q": tuple(coordinates), "u": tuple(speeds)}
    parts_by_array = {
        array: tuple(NamedPart(x.name, x.unit, x.description) for x in group)
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
    """Declared names of a stored element."""
    return declared_names(spec.coordinates, spec.speeds, spec.parameters)


class NamedEntries:
    """Unambiguous names of the entries of a derivation's arrays."""

    def __init__(self, derivation: Derivation, names: DeclaredNames) -> None:
        self.names = names
        equations = (*derivation.premises, *derivation.definitions)
        defined_symbols = [e.left for e in equations if isinstance(e.left, sp.MatrixSymbol)]
        input_symbols = [q.symbol for q in derivation.inputs]
        output_symbols = [q.symbol for q in derivation.outputs]
        self._used_names = {
            str(s.name) for s in (*input_symbols, *output_symbols, *defined_symbols)
        }
        arrays = {
            str(s.name): s
            for s in (*input_symbols, *defined_symbols, *output_symbols)
            if s.shape[1] == 1 and s.shape[0].is_Integer and s.shape[0] > 0  # fixed length
        }
        self._parts = {
            name: self._unambiguous_parts(name, int(s.rows)) for name, s in arrays.items()
        }
        #: Entry of an array -> declared name.
        self.entries = _symmetric_entries(derivation)
        for name, symbol in arrays.items():
            values = [symbol_ for part in self._parts[name] for symbol_ in part.symbols()]
            self.entries |= dict(zip(symbol.as_explicit(), values, strict=True)) if values else {}
            self.entries |= _labelled_entries(name, symbol, names)

    def parts(self, array: str, length: int) -> Parts:
        """Entries of an array of this length."""
        return self._parts[array] if array in self._parts else self.names.parts(array, length)

    def _unambiguous_parts(self, array: str, length: int) -> Parts:
        """Parts with the array as a prefix (p_name) where the name is taken."""
        parts = []
        for part in self.names.parts(array, length):
            name = part.name if part.name not in self._used_names else f"{array}_{part.name}"
            self._used_names.add(name)
            parts.append(replace(part, name=name))
        return tuple(parts)


def _symmetric_entries(derivation: Derivation) -> dict[sp.Basic, sp.Basic]:
    """Replacements of symmetric matrices and their entries by `Symmetric` ones."""
    replacements: dict[sp.Basic, sp.Basic] = {}
    for q in derivation.inputs:
        if q.symmetric and not q.has_runtime_size:
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
