"""Loads along the axes of a body that is part of another one."""

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


def with_axes_of(scene: Scene, gone: str, axes: str, turned: Matrix) -> Scene:
    """The scene whose loads along the axes of a body that goes are along other `axes`, in which
    those lie by the rotation `turned` (3, 3)."""
    return with_tables(
        scene,
        load=tuple(
            _turned(load, axes, turned) if _axes_of(load) == gone else load for load in scene.load
        ),
    )


def with_ends_at_mass_centers(scene: Scene) -> Scene:
    """The scene whose loads at mass centres of welded bodies act at ends there, which stay where
    they are in a body of several."""
    welded = {e for h in scene.hinge if h.is_weld for e in (h.inboard_body, h.outboard_body)}
    moved = {load.on for load in scene.load if load.at == MASS_CENTER} & welded
    if not moved:
        return scene
    ends = {
        body.name: _free_name(body.ends, MASS_CENTER) for body in scene.body if body.name in moved
    }
    return with_tables(
        scene,
        body=tuple(
            one.model_copy(
                update={"ends": {**one.ends, ends[one.name]: End(position=one.center_of_mass)}}
            ) if one.name in ends else one for one in scene.body
        ),
        load=tuple(
            one.model_copy(update={"on": f"{one.on}.{ends[one.on]}", "at": None})
            if one.at == MASS_CENTER and one.on in ends else one for one in scene.load
        ),
    )  # fmt: skip


def _free_name(taken: Collection[str], name: str) -> str:
    while name in taken:
        name += "_"
    return name


def _axes_of(load: Load) -> str:
    return split_reference(load.on)[0] if load.axes == OWN_AXES else load.axes


def _turned(load: Load, axes: str, turned: Matrix) -> Load:
    update: dict[str, Any] = {"axes": axes}
    for key in ("force", "moment"):
        update[key] = tuple(_sum(row, getattr(load, key)) for row in turned)
    return load.model_copy(update=update)


def _sum(row: Sequence[float], entries: Entries) -> Expression:
    """A component along other axes."""
    parts = [
        (factor, one) for factor, one in zip(row, entries, strict=True)
        if factor != 0 and not one.is_zero
    ]  # fmt: skip
    if not parts:
        return number(0)
    if len(parts) == 1 and parts[0][0] == 1:
        return parts[0][1]
    constants = {name: value for _, one in parts for name, value in one.constants}
    text = " + ".join(f"({factor!r})*({one.text})" for factor, one in parts)
    return parse(text, constants=constants)
