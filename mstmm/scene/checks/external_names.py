"""Checks of [names], the names of other programs: existing elements, and no ambiguity."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from ..validators.scalars_and_vectors import GROUND, split_reference
from ..validators.validation_messages import Problem, did_you_mean
from .expression_names import modal_names

if TYPE_CHECKING:
    from ..tables.body_hinge_lookup import Bodies
    from ..tables.scene_tables import SceneTables


def problems(scene: SceneTables) -> Iterator[Problem]:
    """Problems of names for missing elements, and of names that another element has."""
    bodies, hinges, modal = scene.skeleton.bodies, scene.hinges, modal_names(scene)
    for name, scene_name in scene.names.body.items():
        if scene_name.endswith(".") or not _exists(scene_name, bodies):
            hint = did_you_mean(split_reference(scene_name)[0], (GROUND, *bodies.names()))
            yield ("names", "body", name), f'there is no body or end "{scene_name}"{hint}'
        elif name != scene_name and _exists(name, bodies):
            yield ("names", "body", name), _used_name_message(name, "a body or an end")
    for name, scene_name in scene.names.hinge.items():
        if hinges.find(scene_name) is None:
            yield ("names", "hinge", name), hinges.missing(scene_name)
        elif name != scene_name and hinges.find(name) is not None:
            yield ("names", "hinge", name), _used_name_message(name, "a hinge")
        elif name in modal:
            yield ("names", "hinge", name), _used_name_message(name, "a flexible body")


def _used_name_message(name: str, what: str) -> str:
    return f'"{name}" is already the name of {what} of the scene; leave it out'


def _exists(reference: str, bodies: Bodies) -> bool:
    body, end = split_reference(reference)
    ends = bodies.ends(body)
    return reference == GROUND or (ends is not None and (not end or end in ends))
