"""Expressions of a scene that act on its motion, also as functions of one variable."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from mstmm.array_validation import Array
from mstmm.expression.derivatives import Inputs
from mstmm.expression.expression import Expression
from mstmm.expression.parser import Term
from mstmm.scene import Scene
from mstmm.scene.tables.chain import Hinges
from mstmm.scene.tables.hinge import Hinge, HingeTable
from mstmm.scene.tables.loads import Spring

from .cell_subdivision import Margin, WatchedFunction
from .interval_enclosures import (
    EVERYTHING,
    TIME,
    Enclosure,
    Interval,
    cos,
    enclose,
    identity_enclosure,
    terms_of_names,
)


@dataclass(frozen=True)
class ActiveExpression:
    """Expression that acts on the motion of a scene.

    `description` names its owner in messages.  `hinges` are the indices of the hinges whose q, u
    and parameters it names; `spring` is the spring whose length it reads.  The second derivative of
    a `drive` acts on the motion; a `condition` (an event or a release) acts by becoming true.
    `inputs` are the inputs and signals that it names, except those in `held_inputs`, whose values
    are unknown before the run.
    """

    expression: Expression
    description: str
    hinges: Sequence[int] = ()
    spring: Spring | None = None
    drive: bool = False
    condition: bool = False
    constants: tuple[tuple[str, float], ...] = field(default=())
    inputs: tuple[str, ...] = ()
    held_inputs: tuple[str, ...] = ()


def active_expressions(
    scene: Scene, held: Collection[str] = (), inputs: Inputs | None = None
) -> list[ActiveExpression]:
    """All expressions of a scene that are not constant, in the order of the file.

    `held` are inputs set during the run, in addition to those that controllers set; `inputs` are
    all inputs over time (by default those of the scene).
    """
    inputs = scene.channels if inputs is None else inputs
    held = {*held, *scene.controllers_by_input}
    return [
        _with_inputs(entry, inputs, held)
        for entry in _all_expressions(scene)
        if not entry.expression.is_constant
    ]


def _with_inputs(one: ActiveExpression, inputs: Inputs, held: Collection[str]) -> ActiveExpression:
    """Copy of an expression with the inputs that it names; constant inputs become constants."""
    used_inputs = {n.text: inputs[n.text] for n in one.expression.names if n.text in inputs}
    if not used_inputs:
        return one
    known_inputs = {name: channel for name, channel in used_inputs.items() if name not in held}
    constant_inputs = (
        (name, channel.value(0.0)) for name, channel in known_inputs.items() if channel.is_constant
    )
    return replace(
        one, constants=(*one.constants, *constant_inputs), inputs=tuple(known_inputs),
        held_inputs=tuple(name for name in used_inputs if name in held),
    )  # fmt: skip


def _all_expressions(scene: Scene) -> Iterator[ActiveExpression]:
    for number, hinge in enumerate(scene.hinge):
        yield from _hinge_expressions(hinge, f'hinge "{hinge.name}"', [number])
    for chain, first in zip(scene.chain, scene.hinges.starts, strict=False):
        period = min(len(chain.hinge), chain.count)
        for k in range(period):
            members = range(first + k, first + chain.count, period)
            yield from _hinge_expressions(
                chain.hinge_of(k), f'the hinges of chain "{chain.name}"', members
            )
    for load in scene.load:
        for entry in (*load.force, *load.moment):
            yield ActiveExpression(entry, f'load "{load.name}"')
    for spring in scene.spring:
        yield ActiveExpression(
            spring.law.effort, f'effort of spring "{spring.name}"', spring=spring
        )
    for coupling in scene.coupling:
        if coupling.equals is not None:
            yield ActiveExpression(coupling.equals, f'coupling "{coupling.name}"', drive=True)
    for event in scene.event:
        yield ActiveExpression(event.when, f'event "{event.name}"', condition=True)


def _hinge_expressions(
    hinge: HingeTable, what: str, numbers: Sequence[int]
) -> Iterator[ActiveExpression]:
    constants = tuple(hinge.parameters.items())
    for effort in dict.fromkeys(hinge.law.effort):
        yield ActiveExpression(effort, f"effort of {what}", numbers, constants=constants)
    for entry in hinge.drive or ():
        if entry is not None:
            yield ActiveExpression(entry, f"drive of {what}", drive=True, constants=constants)
    release = hinge.release if isinstance(hinge, Hinge) else None
    if release is not None:
        yield ActiveExpression(
            release, f"release of {what}", numbers, condition=True, constants=constants
        )


def examined_hinges(one: ActiveExpression, hinges: Hinges) -> Iterator[Hinge | None]:
    """Hinges at which an expression must be examined.

    These are all its hinges if it reads their q and u, else only the first; None without hinges.
    """
    shared_names = ("t", *one.inputs, *one.held_inputs)
    reads_hinge_state = any(
        len(n.parts) == 1 and n.text not in shared_names for n in one.expression.names
    )
    for index in one.hinges if reads_hinge_state else one.hinges[:1]:
        yield hinges[index]
    if not one.hinges:
        yield None


#: Maximum number of cells of an expression, and of evaluated terms in all cells together.
_MAX_CELLS, _MAX_TERM_EVALUATIONS = 2**16, 2**18

_DIFFERENCES = frozenset({"lt", "le", "gt", "ge", "min", "max"})
_FUNCTIONS = frozenset({
    "sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "exp", "log",
    "sqrt", "pow", "div",
})  # fmt: skip


#: Function from cells of one variable to enclosures of the names in an expression.
Leaves = Callable[[Interval], Mapping[str, Enclosure]]


class ExpressionFunctions:
    """Expression as functions over cells of time, or of another variable.

    The variable is the first of `names`; `leaves` gives the enclosures of all `names` over its
    cells.  The second derivative of a `drive` acts on the motion.
    """

    def __init__(
        self,
        expression: Expression,
        constants: Mapping[str, float],
        drive: bool = False,
        names: Sequence[str] = (TIME,),
        leaves: Leaves | None = None,
    ) -> None:
        self.expression, self.constants = expression, constants
        self.drive, self.variable = drive, names[0]
        self._leaves = leaves or (lambda t: {names[0]: identity_enclosure(t)})
        self.order, varying_terms = terms_of_names(expression, constants, names)
        self.varying = frozenset(varying_terms)
        self.max_cells = min(_MAX_CELLS, _MAX_TERM_EVALUATIONS // max(1, len(self.order)))

    def terms(self, t: Interval) -> dict[int, Enclosure]:
        """Enclosures of all terms that depend on the variable only."""
        return enclose(self.expression.terms, self.order, self.constants, self._leaves(t))

    def values(self, number: int, at: Array) -> Array:
        """Values (n,) of a term at values (n,) of the variable; nan where it is undefined."""
        bounds = self.terms(Interval(at, at))[number].value
        with np.errstate(invalid="ignore"):
            return np.broadcast_to((bounds.lo + bounds.hi) / 2, at.shape)

    def widest(self) -> list[int]:
        """Largest terms that depend on the variable only."""
        terms = self.expression.terms
        inner_terms = {i for n in self.varying for i in terms[n].args}
        return sorted(self.varying - inner_terms)

    def narrow_candidates(self) -> list[WatchedFunction]:
        """Functions that may have narrow features: all but sums, products and switches.

        For a drive, whose second derivative acts, their slopes are included.
        """
        functions = []
        for term_index in sorted(self.varying):
            term = self.expression.terms[term_index]
            if term.op == "div" and term.args[1] not in self.varying:
                continue
            if term.op in _FUNCTIONS:
                is_periodic = term.op in ("sin", "cos")
                argument = term.args[0] if is_periodic else None
                functions.append(WatchedFunction(term_index, argument))
                if self.drive:
                    functions.append(WatchedFunction(term_index, argument, slope=True))
        return functions

    def margins(self) -> list[Margin]:
        """Functions that change sign where the expression switches, except linear functions.

        The switching times of linear functions are known exactly (`linear_switches`).
        """
        linear_terms, terms = self.expression.linear_switches(), self.expression.terms
        unique_margins: dict[tuple[bool, str], Margin] = {}
        for term_index in sorted(self.varying - set(linear_terms)):
            term = terms[term_index]
            margin = self._margin(term)
            if margin is not None:
                texts = [self.expression.text[terms[i].start : terms[i].end] for i in term.args]
                key = " - ".join(
                    texts if term.op in _DIFFERENCES else texts[term.op == "div" :][:1]
                )
                unique_margins.setdefault((term.op == "tan", key), margin)
        return list(unique_margins.values())

    def _margin(self, term: Term) -> Margin | None:
        op, args = term.op, term.args
        if op in _DIFFERENCES:
            return self._margin_of(args, lambda a, b: a - b)
        if op in ("sign", "abs", "log", "sqrt", "atan2"):
            return self._margin_of(args[:1], lambda a: a)
        if op == "div" and args[1] in self.varying:
            return self._margin_of(args[1:], lambda a: a)
        if op == "tan":
            return self._margin_of(args, lambda a: Enclosure(cos(a.value), EVERYTHING))
        if op == "pow" and args[0] in self.varying and not self._is_natural_number(args[1]):
            return self._margin_of(args[:1], lambda a: a)
        return None

    def _is_natural_number(self, exponent: int) -> bool:
        value = self.expression.terms[exponent].constant
        return value is not None and value >= 0 and value == int(value)

    def _margin_of(self, args: tuple[int, ...], difference: Callable[..., Enclosure]) -> Margin:
        term_indices = self._subterm_indices(args)
        terms, constants = self.expression.terms, self.constants

        def margin(t: Interval) -> Enclosure:
            enclosures = enclose(terms, term_indices, constants, self._leaves(t))
            with np.errstate(all="ignore"):
                return difference(*(enclosures[i] for i in args))

        return margin

    def _subterm_indices(self, args: tuple[int, ...]) -> list[int]:
        """Indices of `args` and of all terms on which they depend."""
        visited, waiting = set[int](), list(args)
        while waiting:
            term_index = waiting.pop()
            if term_index not in visited:
                visited.add(term_index)
                waiting += self.expression.terms[term_index].args
        return sorted(visited)
