"""What a linear model shows: coordinates and their rates, and motions of bodies and ends.

Every output is a row of numbers times a power of s.  By duality a point goes along n with each
coordinate as far as a unit force there along n pushes that coordinate, and a body turns as far as
a unit moment does.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mstmm.arrays import Array
from mstmm.errors import SceneError
from mstmm.scene.rules.messages import near

from ..result.observed import References
from ..result.outputs import one_quantity
from ..result.quantities import BODY, acceleration_name, rate_unit
from .channels import Channel, columns, names_of

if TYPE_CHECKING:
    from .equations import Equations

#: Quantities of ends: what pushes along them, and the power of s that makes them of a place.
_KINDS = {
    "position": ("force", 0), "velocity": ("force", 1), "acceleration": ("force", 2),
    "angular_velocity": ("moment", 1), "angular_acceleration": ("moment", 2),
}  # fmt: skip


@dataclass(frozen=True)
class Output:
    """One output: its name, unit and power of s; of a coordinate (`place` in x) or of an end, where
    `push` goes along it."""

    name: str
    unit: str
    order: int
    place: int = -1
    push: Channel | None = None


def outputs_of(linear: Equations, names: Sequence[str] | None) -> list[Output]:
    """The outputs of names, or (None) all coordinates: "shoulder.angle", "shoulder.angle_rate", of
    bodies and ends in inertial axes "boom.tip.velocity.y" or short "boom.tip.vy".

    Raises SceneError for a name that is none of these, or that a moving state does not give.
    """
    if names is not None:
        names = [_meant(linear, name) for name in names_of("outputs", names)]
    pairs = zip(linear.coordinates, linear.units, strict=True)
    plain = {name: Output(name, unit, 0, place) for place, (name, unit) in enumerate(pairs)}
    if names is None:
        return list(plain.values())
    rates = {} if plain.keys() >= set(names) else {one.name: one for one in _rates(linear)}
    return [plain.get(name) or rates.get(name) or _of_end(linear, name) for name in names]


def _meant(linear: Equations, name: str) -> str:
    """The quantity that an output of the scene is; other names as they are."""
    given = next((one for one in linear.model.scene.output if one.name == name), None)
    if given is None:
        return name
    source = one_quantity(given)
    if not source:
        raise SceneError(
            f'output "{name}" is an expression ("{given.of.text}"), which linear models do not '
            "take; name the quantities in it"
        )
    return source


def _rates(linear: Equations) -> Iterator[Output]:
    """Rates and accelerations of coordinates."""
    layout = linear.model.layout
    for place, (entry, name) in enumerate(zip(linear.free, linear.coordinates, strict=True)):
        slots = layout.hinge_of_speed(entry)
        owner, k = name.rpartition(".")[0], entry - slots.u
        speed, unit = slots.u_names[k], slots.u_units[k]
        yield Output(f"{owner}.{speed}", unit, 1, place)
        yield Output(f"{owner}.{acceleration_name(speed)}", rate_unit(unit), 2, place)


def _of_end(linear: Equations, name: str) -> Output:
    """A component of what a body or end does."""
    owner, _, last = name.rpartition(".")
    references = References(linear.model.scene.skeleton)
    for kind, (push, order) in _KINDS.items():
        about, end = BODY[kind], owner.removesuffix(f".{kind}")
        for axis, short in enumerate(about.short):
            long = end != owner and last == about.labels[axis]
            if (long or (end == owner and last == short)) and end in references:
                _refuse_in_motion(linear, name, order)
                channel = Channel("", "", end=end, kind=push, axis=axis)
                return Output(f"{end}.{kind}.{about.labels[axis]}", about.unit, order, -1, channel)
    raise SceneError(
        f'"{name}": expected a coordinate such as "{linear.coordinates[0]}", its rate, or a '
        'motion of a body or end such as "boom.tip.position.x" or '
        f'"boom.tip.vx"{near(name, list(_known(linear)))}'
    )


def _refuse_in_motion(linear: Equations, name: str, order: int) -> None:
    if order and linear.state.u.any():
        raise SceneError(
            f'"{name}": the state moves, so that places change what speeds of ends are; ask for '
            "coordinates, their rates or positions there"
        )


def _known(linear: Equations) -> Iterator[str]:
    yield from linear.coordinates
    yield from (one.name for one in _rates(linear))
    for end in References(linear.model.scene.skeleton):
        for kind in _KINDS:
            yield from (f"{end}.{kind}.{axis}" for axis in BODY[kind].labels)


def rows_of(linear: Equations, outputs: Sequence[Output]) -> Array:
    """(outputs, n): what each output is of x, times its power of s."""
    rows = np.zeros((len(outputs), len(linear)))
    pushes = [(k, one.push) for k, one in enumerate(outputs) if one.push is not None]
    found = columns(
        linear.model.looped, linear.state, [push for _, push in pushes], list(linear.free)
    )
    for (k, _), column in zip(pushes, found.T, strict=True):
        rows[k] = column
    for k, one in enumerate(outputs):
        if one.place >= 0:
            rows[k, one.place] = 1.0
    return rows
