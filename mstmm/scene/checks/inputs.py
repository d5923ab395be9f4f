"""Checks of inputs, signals, outputs and controllers: names, references, unused inputs."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import TYPE_CHECKING

from ...errors import ExpressionError
from ...expression.drive import motion_at
from ...expression.expression import SWITCHES, Expression
from ...risk import Risk
from ..rules.messages import Problem, near
from ..rules.values import Location, found
from ..tables.constants import problem_with_name
from ..tables.outside.inputs import Input
from .types import tables

if TYPE_CHECKING:
    from ..tables.all import SceneTables


_WORDS = {"input": "an input", "signal": "a signal", "output": "an output",
          "controller": "a controller"}  # fmt: skip

#: Quantities of results that belong to no body or hinge.
OF_SCENE = ("energy", "power", "work", "momentum", "angular_momentum")


def problems(scene: SceneTables) -> Iterator[Problem]:
    """Problems of names with another meaning, and of missing signals and inputs."""
    taken = dict.fromkeys(scene.constants, "a constant")
    for table, word in _WORDS.items():
        for i, element in enumerate(getattr(scene, table)):
            problem = problem_with_name(element.name)
            if not problem and element.name in OF_SCENE:
                problem = _taken(element.name)
            if not problem and taken.get(element.name, word) != word:
                problem = f'"{element.name}" is also the name of {taken[element.name]}; rename one'
            taken[element.name] = word
            if problem:
                yield (table, i, "name"), problem
    for table in ("constraint", "coupling"):
        for i, element in enumerate(getattr(scene, table)):
            if element.name in OF_SCENE:
                yield (table, i, "name"), _taken(element.name)
    yield from _outputs(scene)
    yield from _controllers(scene)
    signals = [signal.name for signal in scene.signal]
    for i, one in enumerate(scene.input):
        if isinstance(one.value, str) and one.value not in signals:
            options = (*signals, *scene.constants)
            yield (
                ("input", i, "value"),
                f'there is no signal "{one.value}", and no constant{near(one.value, options)}',
            )
    for _, place, table_ in tables(scene):
        for name in table_.parameters:
            if name in scene.constants or name in scene.channels:
                yield (
                    (*place, "parameters"),
                    f'"{name}" is also the name of {taken[name]} of the scene; rename the latter',
                )


def _taken(name: str) -> str:
    return f'"{name}" is reserved for a quantity of results; choose another name'


def _outputs(scene: SceneTables) -> Iterator[Problem]:
    """Problems of outputs with ambiguous names, and of outputs of outputs.

    Whether the quantities of outputs exist is checked by results.
    """
    outputs = {output.name for output in scene.output}
    owners = {body.name for body in scene.skeleton.body} | {hinge.name for hinge in scene.hinge}
    owners |= {chain.name for chain in scene.chain}
    hinges = {hinge.name for hinge in scene.hinge}
    for table, names in (("input", hinges), ("signal", hinges), ("controller", owners)):
        for i, one in enumerate(getattr(scene, table)):
            if one.name in names:
                what = "a hinge" if one.name in hinges else "a body, hinge or chain"
                yield (table, i, "name"), f'"{one.name}" is also the name of {what}; rename one'
    for i, output in enumerate(scene.output):
        if output.name in owners:
            problem = f'"{output.name}" is also the name of a body, hinge or chain; rename one'
            yield ("output", i, "name"), problem
        for name in output.of.names:
            if name.parts[0] in outputs:
                problem = f'"{name.text}" is an output; write its expression instead'
                yield ("output", i, "of"), problem


def _controllers(scene: SceneTables) -> Iterator[Problem]:
    """Problems of controller outputs: no input, an input of a drive, or one set twice.

    Whether the measured quantities exist is checked by the engine.
    """
    setting: dict[str, str] = {}
    inputs = [one.name for one in scene.input]
    driving = {
        name.text
        for kind, _, table in tables(scene) if kind == "hinge"
        for entry in table.drive or () if entry is not None
        for name in entry.names
    }  # fmt: skip
    for i, one in enumerate(scene.controller):
        for k, name in enumerate(one.outputs):
            place: Location = ("controller", i, "outputs", k)
            other = setting.setdefault(name, one.name)
            if name not in inputs:
                yield place, f'there is no input "{name}"{near(name, inputs)}'
            elif name in driving:
                yield (
                    place,
                    f'"{name}" drives a hinge, whose motion would jump; use an effort or a load',
                )
            elif other != one.name:
                yield place, f'"{name}" is set by controller "{other}" already'


def drives(scene: SceneTables) -> Iterator[Problem]:
    """Problems of drives with inputs: switches, inputs without rates, or no finite start."""
    inputs = {one.name: one for one in scene.input}
    for kind, place, table in tables(scene):
        drive = table.drive if kind == "hinge" else None
        for k, entry in enumerate(drive or ()):
            if entry is None or entry.depends_on_time_only:
                continue
            at: Location = (*place, "drive", k)
            unknown = [name.text for name in entry.names if name.text not in scene.channels]
            if [name for name in unknown if name != "t"]:
                continue  # reported by the check of the hinge
            still = [n.text for n in entry.names if _has_no_rates(inputs.get(n.text))]
            switch = switching(entry, scene.channels)
            if switch:
                yield (
                    at,
                    f"a drive cannot switch with an input, found {switch!r}; give the whole motion "
                    "in the input",
                )
            elif still:
                yield (
                    at,
                    f"a drive needs the rates of the input {still[0]!r}; give them there, as in "
                    "rates = [0, 0], or use a signal as its value",
                )
            else:
                yield from _start(scene, entry, at)


def switching(entry: Expression, names: Collection[str]) -> str:
    """Text of the first term that switches with one of these names, or ""."""
    follows = set[int]()
    for number, term in enumerate(entry.terms):
        if term.name is not None and term.name.text in names:
            follows.add(number)
        elif any(i in follows for i in term.args):
            follows.add(number)
            if term.op in SWITCHES and number in entry.needed:
                return entry.text[term.start : term.end]
    return ""


def _has_no_rates(one: Input | None) -> bool:
    return one is not None and one.rates is None and not isinstance(one.value, str)


def _start(scene: SceneTables, entry: Expression, at: Location) -> Iterator[Problem]:
    try:
        start = motion_at(entry, 0.0, scene.channels)
    except ExpressionError as error:
        yield at, str(error)
        return
    if not all(abs(x) < float("inf") for x in start):
        yield (
            at,
            f"{found(entry.text)} or one of its first two derivatives is not finite at t = 0; "
            "start with a smooth motion",
        )


def users(scene: SceneTables) -> Iterator[tuple[str, str]]:
    """References to inputs and signals: (name, input that follows the signal or "").

    A name occurs as often as it is referenced.
    """
    for one in (*expressions(scene), *(output.of for output in scene.output)):
        yield from ((name.text, "") for name in one.names)
    yield from ((one.value, one.name) for one in scene.input if isinstance(one.value, str))


def risks(scene: SceneTables) -> list[Risk]:
    """Warnings about unused inputs, or about unused signals where there are no inputs.

    Signals of a scene with inputs are available as values of these.
    """
    if not (scene.input or scene.signal):
        return []
    used = {name for name, _ in users(scene)}
    found_risks = []
    for table in ("input",) if scene.input else ("signal",):
        for element in getattr(scene, table):
            if element.name not in used:
                name = f'{table} "{element.name}"'
                found_risks.append(
                    Risk(
                        "unused-input", name, f"{name} is not used",
                        "use it in an expression, or remove it", doubt=False, before=True,
                    )
                )  # fmt: skip
    return found_risks


def expressions(scene: SceneTables) -> Iterator[Expression]:
    """Yield every expression that may contain inputs."""
    for kind, _, table in tables(scene):
        if kind == "hinge":
            yield from table.law.effort
            yield from (entry for entry in table.drive or () if entry is not None)
    for hinge in scene.hinge:
        if hinge.release is not None:
            yield hinge.release
    for load in scene.load:
        for key in ("force", "moment", "force_per_length"):
            yield from getattr(load, key) or ()
    for event in scene.event:
        yield event.when
    for spring in scene.spring:
        yield spring.law.effort
