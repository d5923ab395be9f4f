"""Symbolic equations M(q) u' + h(q, u, t) = tau of a small scene, in closed form.

The schedule of inverse dynamics, which gives the efforts that accelerations need, is interpreted on
symbols for coordinates, speeds, accelerations and time.  It is linear in the accelerations, so that
their coefficients are M.  There is no second derivation.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from ..derive.fuse.linearisation import fuse_required
from ..errors import SceneError
from ..ir.scene_structure import Structure
from ..ir.symbolic_arithmetic import FormulaArithmetic
from ..numerics.piecewise_polynomial import NUMBERS_PER_PIECE
from ..numerics.symbolic_number import Formula, SymbolTable, factor_of_symbol, formula
from ..runtime.kernels import kernel_store
from ..runtime.packing import scene_parameters
from ..runtime.packing.fused_structure import structure_and_numbers
from ..runtime.packing.parameter_derivatives import reject_folded_parameters, seed_derivatives
from .fused_code import kernel_lookup
from .symbolic_linear_model import evaluate_symbolically
from .sympy_expressions import SympyWriter

if TYPE_CHECKING:
    from ..runtime.model.model import Model

#: Largest number of speeds, and of products of terms (some seconds).
MAX_SPEEDS, MAX_PRODUCTS = 12, 300_000


@dataclass(frozen=True)
class Motion:
    """Coordinate or speed: its symbol, its name in the scene, its unit."""

    symbol: Any
    name: str
    unit: str


@dataclass(frozen=True, eq=False)
class SymbolicEquations:
    """Equations M(q) u' + h(q, u, t) = tau of the n free speeds, in SI units.

    Attributes:
        M: mass matrix, (n, n) `sympy.ImmutableMatrix`.
        h: bias force (n, 1): efforts at u' = 0, including gravity, hinge laws and loads.
        coordinates, speeds: all of the scene, in its order; `free_speed_indices` are the indices of
            the n.
        accelerations: symbols of the prescribed accelerations, which occur in h.
        inputs: symbols by name ("push") of the values at t of inputs and signals that occur, and of
            rates of those that drives follow ("push.rates[0]", 1/s; "push.rates[1]", 1/s^2).
        parameters: symbols by name.
        parameter_values: values of the symbols at the start; `M.subs(numbers)` is the mass matrix
            there.
    """

    M: Any = field(repr=False)
    h: Any = field(repr=False)
    coordinates: tuple[Motion, ...]
    speeds: tuple[Motion, ...]
    free_speed_indices: tuple[int, ...]
    accelerations: tuple[Any, ...]
    inputs: Mapping[str, Any]
    parameters: Mapping[str, Any]
    parameter_values: Mapping[Any, float] = field(repr=False)


def symbolic_equations(model: Model, keep: Sequence[str] = ()) -> SymbolicEquations:
    """Derive the equations of motion of a tree in closed form.

    The numbers of the scene listed in `keep` ("rod1.mass") stay symbols.  Every branch of functions
    that switch is kept, as a Piecewise.

    Raises SceneError for closed loops, laws with a memory, hinges that are released, numbers of
    flexible bodies, names that the scene does not have, and scenes that are too large.
    """
    _require_small_tree(model)
    if isinstance(keep, str):
        raise SceneError(f'keep = {keep!r}: expected a list of names such as ["rod1.mass"]')
    reject_folded_parameters(model.scene, list(keep), "formula; keep other parameters")
    return _EquationBuilder(model, keep).equations()


def _require_small_tree(model: Model) -> None:
    scene = model.packed_scene
    if model.nu > MAX_SPEEDS:
        raise SceneError(
            f"equations in closed form: expected at most {MAX_SPEEDS} speeds, found {model.nu}; "
            "use mass_matrix and inverse_dynamics, which give numbers"
        )
    if model.loops.cut_hinges:
        raise SceneError(
            "equations in closed form: expected a tree, found a scene with closed loops; open "
            "them, or use linearize, which supports loops"
        )
    if scene.releases:
        raise SceneError(
            f'hinge "{next(iter(scene.releases))}" is released during the run, which changes the '
            "form of the equations; remove the release"
        )


class _EquationBuilder:
    """Symbols of one scene, and their equations of motion by inverse dynamics."""

    def __init__(self, model: Model, keep: Sequence[str]) -> None:
        self.model, self.book = model, SymbolTable(MAX_PRODUCTS)
        names = scene_parameters.resolve_names(model.scene, keep)
        values = model.parameters
        self.kept_symbols = {name: self.book.symbol(name, values[name]) for name in names}
        seeds = list(self.kept_symbols.values())
        known_elements = model.known or {}
        system, _ = seed_derivatives(model.scene, known_elements, names, lambda _, k: seeds[k])
        self.structure, self.p = structure_and_numbers(system, known_elements)
        q, u = (x.tolist() for x in model.initial_state())
        owners = list(model.coordinate_layout.owners)
        self.q = [
            self.book.symbol(name, x)
            for name, x in zip(
                (_symbol_name("q", o.name, n, o.nq) for o in owners for n in o.q_names),
                q,
                strict=True,
            )
        ]
        speeds = [(_symbol_name("", o.name, n, o.nu)) for o in owners for n in o.u_names]
        self.u = [self.book.symbol("u" + name, x) for name, x in zip(speeds, u, strict=True)]
        self.a = [self.book.symbol("udot" + name, 1.0) for name in speeds]
        self.t = self.book.symbol("t", 0.0)
        self.inputs = dict(self._inputs(self.structure, system.inputs_at(0.0).tolist()))

    def _inputs(self, structure: Structure, given: list[float]) -> Iterator[tuple[str, Formula]]:
        """Symbols for values and rates of the inputs at t, as of polynomial pieces from t on."""
        indices = dict(structure.inputs)
        for entry, index in indices.items():
            self.p[index] = given[entry]
        for name, number in self.model.coordinate_layout.inputs.items():
            first_entry = NUMBERS_PER_PIECE * number
            if first_entry not in indices:
                continue
            self.p[indices[first_entry]] = self.t
            for k, full_name in enumerate((name, f"{name}.rates[0]", f"{name}.rates[1]")):
                factor = math.factorial(k)
                symbol = self.book.symbol(full_name, factor * given[first_entry + 1 + k])
                self.p[indices[first_entry + 1 + k]] = symbol * (1.0 / factor)
                yield full_name, symbol

    def equations(self) -> SymbolicEquations:
        required = self._required_efforts()
        free = self.model.free_speed_indices
        free_accelerations = [self.a[j] for j in free]
        mass = [[factor_of_symbol(required[i], a) for a in free_accelerations] for i in free]
        bias = [[_terms_without(required[i], free_accelerations)] for i in free]
        writer = SympyWriter()
        to_sympy = writer.symbol
        matrices = writer.matrix(mass), writer.matrix(bias)
        used_symbols = set().union(*(matrix.free_symbols for matrix in matrices))
        inputs = {
            name: to_sympy(x) for name, x in self.inputs.items() if to_sympy(x) in used_symbols
        }
        symbols = (
            *self.q,
            *self.u,
            *self.kept_symbols.values(),
            *(self.inputs[name] for name in inputs),
        )
        numbers = {to_sympy(x): x.value for x in symbols}
        layout = self.model.coordinate_layout
        q = zip(self.q, layout.q_names, (x for o in layout.owners for x in o.q_units), strict=True)
        u = zip(self.u, layout.u_names, (x for o in layout.owners for x in o.u_units), strict=True)
        return SymbolicEquations(
            *matrices,
            tuple(Motion(to_sympy(x), name, unit) for x, name, unit in q),
            tuple(Motion(to_sympy(x), name, unit) for x, name, unit in u),
            free, tuple(to_sympy(x) for k, x in enumerate(self.a) if k not in free),
            inputs,
            {name: to_sympy(x) for name, x in self.kept_symbols.items()}, numbers,
        )  # fmt: skip

    def _required_efforts(self) -> list[Formula]:
        _, definitions = kernel_store.load_known(kernel_store.required_types(self.model.scene))
        user_specs = {
            key: element.spec for key, element in (self.model.known or {}).items() if element.spec
        }
        kernel = fuse_required(self.structure, kernel_lookup({**definitions, **user_specs}))
        arguments = {"p": self.p, "t": [self.t], "q": self.q, "u": self.u, "a": self.a}
        return evaluate_symbolically(kernel, arguments, FormulaArithmetic(branches=True))[
            "required"
        ]


def _symbol_name(letter: str, owner: str, name: str, count: int) -> str:
    """Name of a symbol: q_pivot for a hinge with one coordinate, q_ball.x for several."""
    return f"{letter}_{owner}" if count == 1 else f"{letter}_{owner}.{name}"


def _terms_without(x: Formula, symbols: Sequence[Formula]) -> Formula:
    """Terms of a formula that contain none of these symbols."""
    atoms = {atom for symbol in symbols for monomial in symbol.terms for atom, _ in monomial}
    terms = {m: c for m, c in x.terms.items() if not any(atom in atoms for atom, _ in m)}
    return formula(0.0) if not terms else Formula(x.value, terms)
