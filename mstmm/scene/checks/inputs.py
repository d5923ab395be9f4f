"""Checks of inputs, signals, outputs and controllers: names, references, unused inputs."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import TYPE_CHECKING

from ...errors import ExpressionError
from ...expression.derivatives import motion_at
from ...expression.expression import SWITCHES, Expression
from ...risk import Risk
from ..tables.scene_tables import name_problem
from ..validators.scalars_and_vectors import Location, describe_value
from ..validators.validation_messages import Problem, did_you_mean
from .user_types import scene_expressions, typed_tables

if TYPE_CHECKING:
    from ..tables.scene_tables import SceneTables


_TABLE_LABELS = {"input": "an input", "signal": "a signal", "output": "an output",
          "controller": "a controller"}  # fmt: skip

#: Quantities of results that belong to no body or hinge.
SCENE_QUANTITIES = ("energy", "power", "work", "momentum", "angular_momentum")


def problems(scene: SceneTables) -> Iterator[Problem]:
    """Problems of names with another meaning, and of missing signals and inputs."""
    labels_by_name = dict.fromkeys(scene.constants, "a constant")
    for table, label in _TABLE_LABELS.items():
        for i, element in enumerate(getattr(scene, table)):
            problem = name_problem(element.name)
            if not problem and element.name in SCENE_QUANTITIES:
                problem = _reserved_name_message(element.name)
            if not problem and labels_by_name.get(element.name, label) != label:
                owner = labels_by_name[element.name]
                problem = f'"{element.name}" is also the name of {owner}; rename one'
            labels_by_name[element.name] = label
            if problem:
                yield (table, i, "name"), problem
    for table in ("constraint", "coupling"):
        for i, element in enumerate(getattr(scene, table)):
            if element.name in SCENE_QUANTITIES:
                yield (table, i, "name"), _reserved_name_message(element.name)
    yield from _output_problems(scene)
    yield from _controller_problems(scene)
    signals = [signal.name for signal in scene.signal]
    for i, input_table in enumerate(scene.input):
        if isinstance(input_table.value, str) and input_table.value not in signals:
            hint = did_you_mean(input_table.value, (*signals, *scene.constants))
            text = f'there is no signal "{input_table.value}", and no constant{hint}'
            yield ("input", i, "value"), text
    for _, location, element_table in typed_tables(scene):
        for name in element_table.parameters:
            if name in scene.constants or name in scene.channels:
                owner = f"{labels_by_name[name]} of the scene"
                text = f'"{name}" is also the name of {owner}; rename the latter'
                yield (*location, "parameters"), text


def _reserved_name_message(name: str) -> str:
    return f'"{name}" is reserved for a quantity of results; choose another name'


def _output_problems(scene: SceneTables) -> Iterator[Problem]:
    """Problems of outputs with ambiguous names, and of outputs of outputs.

    Whether the quantities of outputs exist is checked by results.
    """
    outputs = {output.name for output in scene.output}
    owners = {body.name for body in scene.skeleton.body} | {hinge.name for hinge in scene.hinge}
    owners |= {chain.name for chain in scene.chain}
    hinges = {hinge.name for hinge in scene.hinge}
    for table, names in (("input", hinges), ("signal", hinges), ("controller", owners)):
        for i, element in enumerate(getattr(scene, table)):
            if element.name in names:
                owner = "a hinge" if element.name in hinges else "a body, hinge or chain"
                yield (
                    (table, i, "name"),
                    f'"{element.name}" is also the name of {owner}; rename one',
                )
    for i, output in enumerate(scene.output):
        if output.name in owners:
            problem = f'"{output.name}" is also the name of a body, hinge or chain; rename one'
            yield ("output", i, "name"), problem
        for name in output.of.names:
            if name.parts[0] in outputs:
                problem = f'"{name.text}" is an output; write its expression instead'
                yield ("output", i, "of"), problem


def _controller_problems(scene: SceneTables) -> Iterator[Problem]:
    """Problems of controller outputs: no input, an input of a drive, or one set twice.

    Whether the measured quantities exist is checked by the engine.
    """
    controllers_by_input: dict[str, str] = {}
    inputs = [element.name for element in scene.input]
    driving_names = {
        name.text
        for element_kind, _, table in typed_tables(scene) if element_kind == "hinge"
        for entry in table.drive or () if entry is not None
        for name in entry.names
    }  # fmt: skip
    for i, element in enumerate(scene.controller):
        for k, name in enumerate(element.outputs):
            location: Location = ("controller", i, "outputs", k)
            first_controller = controllers_by_input.setdefault(name, element.name)
            if name not in inputs:
                yield location, f'there is no input "{name}"{did_you_mean(name, inputs)}'
            elif name in driving_names:
                yield (
                    location,
                    f'"{name}" drives a hinge, whose motion would jump; use an effort or a load',
                )
            elif first_controller != element.name:
                yield location, f'"{name}" is set by controller "{first_controller}" already'


def drive_problems(scene: SceneTables) -> Iterator[Problem]:
    """Problems of drives with inputs: switches, inputs without rates, or no finite start."""
    inputs = {input_table.name: input_table for input_table in scene.input}
    for element_kind, location, table in typed_tables(scene):
        drive = table.drive if element_kind == "hinge" else None
        for k, entry in enumerate(drive or ()):
            if entry is None or entry.depends_on_time_only:
                continue
            entry_location: Location = (*location, "drive", k)
            unknown = [name.text for name in entry.names if name.text not in scene.channels]
            if [name for name in unknown if name != "t"]:
                continue  # reported by the check of the hinge
            used_inputs = [inputs[name.text] for name in entry.names if name.text in inputs]
            rateless = [
                one.name for one in used_inputs
                if one.rates is None and not isinstance(one.value, str)
            ]  # fmt: skip
            switching_text = switching_term(entry, scene.channels)
            if switching_text:
                yield (
                    entry_location,
                    f"a drive cannot switch with an input, found {switching_text!r}; give the "
                    "whole motion in the input",
                )
            elif rateless:
                yield (
                    entry_location,
                    f"a drive needs the rates of the input {rateless[0]!r}; give them there, as in "
                    "rates = [0, 0], or use a signal as its value",
                )
            else:
                yield from _start_problems(scene, entry, entry_location)


def switching_term(entry: Expression, names: Collection[str]) -> str:
    """Text of the first term that switches with one of these names, or ""."""
    dependent_terms = set[int]()
    for number, term in enumerate(entry.terms):
        if term.name is not None and term.name.text in names:
            dependent_terms.add(number)
        elif any(i in dependent_terms for i in term.args):
            dependent_terms.add(number)
            if term.op in SWITCHES and number in entry.required_terms:
                return entry.text[term.start : term.end]
    return ""


def _start_problems(scene: SceneTables, entry: Expression, at: Location) -> Iterator[Problem]:
    try:
        start = motion_at(entry, 0.0, scene.channels)
    except ExpressionError as error:
        yield at, str(error)
        return
    if not all(abs(x) < float("inf") for x in start):
        yield (
            at,
            f"{describe_value(entry.text)} or one of its first two derivatives is not finite at t "
            "= 0; start with a smooth motion",
        )


def input_references(scene: SceneTables) -> Iterator[tuple[str, str]]:
    """References to inputs and signals: (name, input that follows the signal or "").

    A name occurs as often as it is referenced.
    """
    drives = (table.drive or () for kind, _, table in typed_tables(scene) if kind == "hinge")
    expressions = [one.expression for one in scene_expressions(scene)]
    expressions += (entry for drive in drives for entry in drive if entry is not None)
    expressions += (output.of for output in scene.output)
    for expression in expressions:
        yield from ((name.text, "") for name in expression.names)
    yield from (
        (element.value, element.name) for element in scene.input if isinstance(element.value, str)
    )


def unused_input_warnings(scene: SceneTables) -> list[Risk]:
    """Warnings about unused inputs, or about unused signals where there are no inputs.

    Signals of a scene with inputs are available as values of these.
    """
    if not (scene.input or scene.signal):
        return []
    used_names = {name for name, _ in input_references(scene)}
    table = "input" if scene.input else "signal"
    unused = (one.name for one in getattr(scene, table) if one.name not in used_names)
    remedy = "use it in an expression, or remove it"
    return [
        Risk(
            "unused-input", f'{table} "{name}"', f'{table} "{name}" is not used', remedy,
            invalidates=False, seen_before_run=True,
        )
        for name in unused
    ]  # fmt: skip
