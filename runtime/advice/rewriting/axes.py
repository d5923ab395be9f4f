"""Loads along the axes of a body that is part of another one."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from mstmm.expression.expression import Expression, number, parse
from mstmm.numbers.rotations import Matrix
from mstmm.scene import Load, Scene, split

from ...chart.models import with_tables
from .references import OWN_AXES

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


def _axes_of(load: Load) -> str:
    return split(load.on)[0] if load.axes == OWN_AXES else load.axes


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
