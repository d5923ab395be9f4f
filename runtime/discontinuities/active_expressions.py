"""Expressions of a scene that act on its motion, with their names for messages."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field, replace

from mstmm.expression.derivatives import Inputs
from mstmm.expression.expression import Expression
from mstmm.scene import Scene
from mstmm.scene.tables.chain import Hinges
from mstmm.scene.tables.hinge import Hinge, HingeTable
from mstmm.scene.tables.loads import Spring


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
