"""Outputs of a scene in its reduced ones: by the new names of places, and only those there are."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from mstmm.expression.expression import Expression, parse
from mstmm.scene import Output, Scene

from ..chart.models import with_tables
from .renaming import renamed

if TYPE_CHECKING:
    from ..model.model import Model


def with_places(output: Output, names: Mapping[str, str]) -> Output:
    """An output whose places have other names."""
    of = _with_places(output.of, names)
    return output if of == output.of else output.model_copy(update={"of": of})


def _with_places(expression: Expression, names: Mapping[str, str]) -> Expression:
    text = expression.text
    found = {(term.name.position, term.name.text) for term in expression.terms if term.name}
    for position, name in sorted(found, reverse=True):
        text = text[:position] + renamed(name, names) + text[position + len(name) :]
    return parse(text, constants=dict(expression.constants))


def with_outputs_there(scene: Scene, compile: Callable[[Scene], Model]) -> Scene:
    """The scene without the outputs that its results would lack."""
    if not scene.output:
        return scene
    there = compile(scene).simulate(0.0, "dop853").outputs()
    return with_tables(scene, output=tuple(one for one in scene.output if one.name in there))
