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

from ..derive.fuse.linear import fuse_required
from ..errors import SceneError
from ..ir.formulas import FormulaArithmetic
from ..ir.structure import Structure
from ..numbers.formula import Book, Formula, formula, share
from ..numbers.pieces import COUNT
from ..runtime.kernels import store
from ..runtime.pack import parameters
from ..runtime.pack.slopes import refuse_folded, seeded
from ..runtime.pack.structure import structure_and_numbers
from .expressions import Writer
from .fusion import kernels_of
from .symbolic import replayed

if TYPE_CHECKING:
    from ..runtime.model.model import Model

#: Largest number of speeds, and of products of terms (some seconds).
MOST_SPEEDS, MOST_PRODUCTS = 12, 300_000


@dataclass(frozen=True)
class Motion:
    """Coordinate or speed: its symbol, its name in the scene, its unit."""

    symbol: Any
    name: str
    unit: str


@dataclass(frozen=True, eq=False)
class ClosedEquations:
    """Equations M(q) u' + h(q, u, t) = tau of the n free speeds, in SI units.

    Attributes:
        M: mass matrix, (n, n) `sympy.ImmutableMatrix`.
        h: bias force (n, 1): efforts at u' = 0, including gravity, hinge laws and loads.
        coordinates, speeds: all of the scene, in its order; `free` are the indices of the n.
        accelerations: symbols of the prescribed accelerations, which occur in h.
        inputs: symbols by name ("push") of the values at t of inputs and signals that occur, and of
            rates of those that drives follow ("push.rates[0]", 1/s; "push.rates[1]", 1/s^2).
        parameters: symbols by name.
        numbers: values of the symbols at the start; `M.subs(numbers)` is the mass matrix there.
    """

    M: Any = field(repr=False)
    h: Any = field(repr=False)
    coordinates: tuple[Motion, ...]
    speeds: tuple[Motion, ...]
    free: tuple[int, ...]
    accelerations: tuple[Any, ...]
    inputs: Mapping[str, Any]
    parameters: Mapping[str, Any]
    numbers: Mapping[Any, float] = field(repr=False)


def closed(model: Model, keep: Sequence[str] = ()) -> ClosedEquations:
    """Derive the equations of motion of a tree in closed form.

    The numbers of the scene listed in `keep` ("rod1.mass") stay symbols.  Every branch of functions
    that switch is kept, as a Piecewise.

    Raises SceneError for closed loops, laws with a memory, hinges that are released, numbers of
    flexible bodies, names that the scene does not have, and scenes that are too large.
    """
    _refuse(model)
    if isinstance(keep, str):
        raise SceneError(f'keep = {keep!r}: expected a list of names such as ["rod1.mass"]')
    refuse_folded(model.scene, list(keep), "formula; keep other parameters")
    return _Closing(model, keep).equations()


def _refuse(model: Model) -> None:
    scene = model.packed
    if model.nu > MOST_SPEEDS:
        raise SceneError(
            f"equations in closed form: expected at most {MOST_SPEEDS} speeds, found {model.nu}; "
            "use mass_matrix and inverse_dynamics, which give numbers"
        )
    if model.loops.cut:
        raise SceneError(
            "equations in closed form: expected a tree, found a scene with closed loops; open "
            "them, or use linearize, which supports loops"
        )
    if scene.releases:
        raise SceneError(
            f'hinge "{next(iter(scene.releases))}" is released during the run, which changes the '
            "form of the equations; remove the release"
        )


class _Closing:
    """Symbols of one scene, and their equations of motion by inverse dynamics."""

    def __init__(self, model: Model, keep: Sequence[str]) -> None:
        self.model, self.book = model, Book(MOST_PRODUCTS)
        names = parameters.resolved(model.scene, keep)
        values = model.parameters
        self.kept = {name: self.book.symbol(name, values[name]) for name in names}
        seeds = list(self.kept.values())
        known = model.known or {}
        system, _ = seeded(model.scene, known, names, lambda _, k: seeds[k])
        self.structure, self.p = structure_and_numbers(system, known)
        q, u = (x.tolist() for x in model.initial_state())
        owners = list(model.layout.owners)
        self.q = [
            self.book.symbol(name, x)
            for name, x in zip(
                (_short("q", o.name, n, o.nq) for o in owners for n in o.q_names), q, strict=True
            )
        ]
        speeds = [(_short("", o.name, n, o.nu)) for o in owners for n in o.u_names]
        self.u = [self.book.symbol("u" + name, x) for name, x in zip(speeds, u, strict=True)]
        self.a = [self.book.symbol("udot" + name, 1.0) for name in speeds]
        self.t = self.book.symbol("t", 0.0)
        self.inputs = dict(self._inputs(self.structure, system.inputs_at(0.0).tolist()))

    def _inputs(self, structure: Structure, given: list[float]) -> Iterator[tuple[str, Formula]]:
        """Symbols for values and rates of the inputs at t, as of polynomial pieces from t on."""
        places = dict(structure.inputs)
        for entry, place in places.items():
            self.p[place] = given[entry]
        for name, number in self.model.layout.inputs.items():
            first = COUNT * number
            if first not in places:
                continue
            self.p[places[first]] = self.t
            for k, full in enumerate((name, f"{name}.rates[0]", f"{name}.rates[1]")):
                factor = math.factorial(k)
                found = self.book.symbol(full, factor * given[first + 1 + k])
                self.p[places[first + 1 + k]] = found * (1.0 / factor)
                yield full, found

    def equations(self) -> ClosedEquations:
        required = self._required()
        free = self.model.free_speeds
        pushed = [self.a[j] for j in free]
        mass = [[share(required[i], a) for a in pushed] for i in free]
        rest = [[_without(required[i], pushed)] for i in free]
        writer = Writer()
        write = writer.symbol
        matrices = writer.matrix(mass), writer.matrix(rest)
        occurring = set().union(*(matrix.free_symbols for matrix in matrices))
        inputs = {name: write(x) for name, x in self.inputs.items() if write(x) in occurring}
        named = (*self.q, *self.u, *self.kept.values(), *(self.inputs[name] for name in inputs))
        numbers = {write(x): x.value for x in named}
        layout = self.model.layout
        q = zip(self.q, layout.q_names, (x for o in layout.owners for x in o.q_units), strict=True)
        u = zip(self.u, layout.u_names, (x for o in layout.owners for x in o.u_units), strict=True)
        return ClosedEquations(
            *matrices,
            tuple(Motion(write(x), name, unit) for x, name, unit in q),
            tuple(Motion(write(x), name, unit) for x, name, unit in u),
            free, tuple(write(x) for k, x in enumerate(self.a) if k not in free),
            inputs,
            {name: write(x) for name, x in self.kept.items()}, numbers,
        )  # fmt: skip

    def _required(self) -> list[Formula]:
        _, definitions = store.known(store.needed(self.model.scene))
        made = {key: one.spec for key, one in (self.model.known or {}).items() if one.spec}
        kernel = fuse_required(self.structure, kernels_of({**definitions, **made}))
        given = {"p": self.p, "t": [self.t], "q": self.q, "u": self.u, "a": self.a}
        return replayed(kernel, given, FormulaArithmetic(branches=True))["required"]


def _short(letter: str, owner: str, name: str, count: int) -> str:
    """Name of a symbol: q_pivot for a hinge with one coordinate, q_ball.x for several."""
    return f"{letter}_{owner}" if count == 1 else f"{letter}_{owner}.{name}"


def _without(x: Formula, symbols: Sequence[Formula]) -> Formula:
    """Terms of a formula that contain none of these symbols."""
    atoms = {atom for symbol in symbols for monomial in symbol.terms for atom, _ in monomial}
    kept = {m: c for m, c in x.terms.items() if not any(atom in atoms for atom, _ in m)}
    return formula(0.0) if not kept else Formula(x.value, kept)
