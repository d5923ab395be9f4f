"""Loads along the axes of a body that becomes part of another one."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any

from mstmm.expression.expression import Expression, number, parse
from mstmm.numerics.rotations import Matrix
from mstmm.scene import End, Load, Scene, split_reference
from mstmm.scene.tables.loads import MASS_CENTER

from ...chart.model_levels import with_tables
from .reference_renaming import OWN_AXES

Entries = tuple[Expression, ...]


def with_load_axes(scene: Scene, removed_body: str, axes: str, rotation: Matrix) -> Scene:
    """Express loads along the axes of a removed body along other `axes`.

    `rotation` (3, 3) is the orientation of the axes of the removed body in the new ones.
    """
    return with_tables(
        scene,
        load=tuple(
            _rotated_load(load, axes, rotation) if _axes_body(load) == removed_body else load
            for load in scene.load
        ),
    )


def with_ends_at_mass_centers(scene: Scene) -> Scene:
    """Move loads at mass centres of welded bodies to new ends at the same points.

    The mass centre of a merged body is another point; the ends remain.
    """
    welded = {e for h in scene.hinge if h.is_weld for e in (h.inboard_body, h.outboard_body)}
    loaded = {load.on for load in scene.load if load.at == MASS_CENTER} & welded
    if not loaded:
        return scene
    ends = {
        body.name: _unused_name(body.ends, MASS_CENTER)
        for body in scene.body
        if body.name in loaded
    }
    return with_tables(
        scene,
        body=tuple(
            body.model_copy(
                update={"ends": {**body.ends, ends[body.name]: End(position=body.center_of_mass)}}
            ) if body.name in ends else body for body in scene.body
        ),
        load=tuple(
            load.model_copy(update={"on": f"{load.on}.{ends[load.on]}", "at": None})
            if load.at == MASS_CENTER and load.on in ends else load for load in scene.load
        ),
    )  # fmt: skip


def _unused_name(taken: Collection[str], name: str) -> str:
    while name in taken:
        name += "_"
    return name


def _axes_body(load: Load) -> str:
    return split_reference(load.on)[0] if load.axes == OWN_AXES else load.axes


def _rotated_load(load: Load, axes: str, rotation: Matrix) -> Load:
    update: dict[str, Any] = {"axes": axes}
    for key in ("force", "moment"):
        update[key] = tuple(_combined_component(row, getattr(load, key)) for row in rotation)
    return load.model_copy(update=update)


def _combined_component(row: Sequence[float], entries: Entries) -> Expression:
    """Component of a vector along another axis: sum of row[k] * entries[k]."""
    terms = [
        (factor, entry) for factor, entry in zip(row, entries, strict=True)
        if factor != 0 and not entry.is_zero
    ]  # fmt: skip
    if not terms:
        return number(0)
    if len(terms) == 1 and terms[0][0] == 1:
        return terms[0][1]
    constants = {name: value for _, entry in terms for name, value in entry.constants}
    text = " + ".join(f"({factor!r})*({entry.text})" for factor, entry in terms)
    return parse(text, constants=constants)
