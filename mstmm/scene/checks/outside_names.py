"""Checks of [names], the names of other programs: existing elements, and no ambiguity."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from ..rules.messages import Problem, near
from ..rules.values import GROUND, split
from .names import flexible

if TYPE_CHECKING:
    from ..tables.all import SceneTables
    from ..tables.members import Bodies


def problems(scene: SceneTables) -> Iterator[Problem]:
    """Problems of names for missing elements, and of names that another element has."""
    bodies, hinges, modal = scene.skeleton.bodies, scene.hinges, flexible(scene)
    for name, one in scene.names.body.items():
        if one.endswith(".") or not _is_there(one, bodies):
            hint = near(split(one)[0], (GROUND, *bodies.names()))
            yield ("names", "body", name), f'there is no body or end "{one}"{hint}'
        elif name != one and _is_there(name, bodies):
            yield ("names", "body", name), _taken(name, "a body or an end")
    for name, one in scene.names.hinge.items():
        if hinges.find(one) is None:
            yield ("names", "hinge", name), hinges.missing(one)
        elif name != one and hinges.find(name) is not None:
            yield ("names", "hinge", name), _taken(name, "a hinge")
        elif name in modal:
            yield ("names", "hinge", name), _taken(name, "a flexible body")


def _taken(name: str, what: str) -> str:
    return f'"{name}" is already the name of {what} of the scene; leave it out'


def _is_there(reference: str, bodies: Bodies) -> bool:
    body, end = split(reference)
    ends = bodies.ends(body)
    return reference == GROUND or (ends is not None and (not end or end in ends))
