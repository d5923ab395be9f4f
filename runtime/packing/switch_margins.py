"""Margins of a scene's expressions of the state: zero where an expression switches.

A comparison, `sign`, `abs`, `min` and `max` change branch where their argument, or the difference
of the two, is zero.  Where that depends on the motion the step must end there, as it does at an
event; a window that the motion passes in a moment is then met, however narrow it is.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass
from itertools import islice

from mstmm.expression.expression import SWITCHES, Expression, Name
from mstmm.ir.graph import Graph, Node
from mstmm.ir.tape import Tape
from mstmm.scene import Hinge, Scene, split_reference

from ..discontinuities.active_expressions import (
    ActiveExpression,
    active_expressions,
    examined_hinges,
)
from ..discontinuities.interval_enclosures import terms_of_time
from .coordinate_layout import Layout
from .expression_tapes import Resolver, event_tape, resolver
from .records.bounce_records import Bounce, build_bounces

#: Margins at most: every one is looked at several times a step.
MOST = 1000

#: Body and end -> place among the ends whose positions and velocities a tape reads.
Probes = dict[tuple[str, str], int]


@dataclass(frozen=True)
class Switch:
    """A margin, and what switches there as the user wrote it."""

    margin: Node
    what: str


@dataclass(frozen=True)
class Watched:
    """What is looked at several times a step: a tape that gives the value of every event and
    release, and behind them the margins of the first MOST switches; None where there is nothing.
    `ends` are the bodies and ends whose places it reads, `bounces` how events throw back."""

    tape: Tape | None
    ends: tuple[tuple[str, str], ...]
    switches: tuple[Switch, ...]
    bounces: tuple[Bounce, ...] = ()


def event_order(scene: Scene, layout: Layout, held: Collection[str] = ()) -> Watched:
    """Events in the order of the file, hard stops, releases, then switches; `held` are inputs that
    are set during the run."""
    graph, probes = Graph(), Probes()
    found = state_switches(scene, layout, graph, probes, held)
    conditions: list[tuple[Expression, Hinge | None]] = [(e.when, None) for e in scene.events]
    conditions += [(h.release, h) for h in scene.hinge if h.release is not None]
    if not conditions and not found:
        return Watched(None, (), ())
    margins = [switch.margin for switch in found[:MOST]]
    tape = event_tape(conditions, layout, graph, probes, margins)
    thrown = build_bounces(scene, layout, dict(probes))
    return Watched(tape, tuple(probes), tuple(found), thrown)


def has_switches(scene: Scene) -> bool:
    """Whether anything switches with the state."""
    return any(_terms(one) for one in active_expressions(scene))


def state_switches(
    scene: Scene, layout: Layout, graph: Graph, probes: Probes, held: Collection[str]
) -> list[Switch]:
    """All margins that depend on the state, each once and no more than MOST + 1; positions of ends
    are asked for through `probes`."""
    found: dict[int, Switch] = {}
    for one in active_expressions(scene, held):
        chosen = _terms(one)
        for own in islice(examined_hinges(one, scene.hinges), MOST + 1) if chosen else ():
            resolve = resolver(graph, layout, own, probes=probes)
            if one.spring is not None:
                resolve = _with_length(resolve, graph, one, probes)
            nodes = one.expression.nodes(graph, resolve)
            for number in chosen:
                term = one.expression.terms[number]
                a, *rest = (nodes[i] for i in term.args)
                margin = a - rest[0] if rest else a
                text = one.expression.text[term.start : term.end]
                if margin.value is None and len(found) <= MOST:
                    found.setdefault(margin.number, Switch(margin, f"{text!r} ({one.what})"))
    return list(found.values())


def _terms(one: ActiveExpression) -> list[int]:
    """Terms that switch with the state; what an event itself waits for is not among them, nor what
    goes by inputs alone that stand still within a step."""
    expression, constants = one.expression, dict(one.constants)
    alone = set(terms_of_time(expression, constants)[0])
    if one.held:
        order, moving = terms_of_time(expression, constants | dict.fromkeys(one.held, 0.0))
        alone |= set(order) - set(moving)
    return [
        number
        for number in sorted(expression.needed - alone)
        if expression.terms[number].op in SWITCHES
        and not (one.condition and number == expression.root)
    ]


def _with_length(
    resolve: Resolver, graph: Graph, one: ActiveExpression, probes: Probes
) -> Callable[[Name], Node]:
    """Names of a spring's effort: `q` is its length and `u` the rate of that, from its ends."""
    spring = one.spring
    assert spring is not None

    def components(reference: str) -> list[Node]:
        if split_reference(reference)[0] == "ground":
            still = (*spring.position, 0.0, 0.0, 0.0)
            return [graph.constant(x) for x in still]
        place = probes.setdefault(split_reference(reference), len(probes))
        return [graph.element("points", 6 * place + k) for k in range(6)]

    ends = [components(reference) for reference in (spring.from_, spring.to)]
    d = [b - a for a, b in zip(*ends, strict=True)]
    length = graph.call("sqrt", d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
    rate = (d[0] * d[3] + d[1] * d[4] + d[2] * d[5]) / length

    def of_spring(name: Name) -> Node:
        own = {"q": length, "u": rate}
        return own[name.parts[0]] if name.parts[0] in own else resolve(name)

    return of_spring
