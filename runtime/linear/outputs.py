"""What a linear model shows: coordinates and their rates, and motions of bodies and ends.

Every output is a row of numbers times a power of s.  By duality a point goes along n with each
coordinate as far as a unit force there along n pushes that coordinate, and a body turns as far as
a unit moment does.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import TYPE_CHECKING

import numpy as np

from mstmm.arrays import Array
from mstmm.errors import SceneError
from mstmm.ir.tangent import jacobian
from mstmm.scene.rules.messages import near

from ..engine.calls import Probe
from ..engine.references import References
from ..engine.shown import BODY, COLUMNS, acceleration_name, rate_unit
from ..kernels import vectorized
from ..result.outputs import kernel_of, one_quantity
from .channels import Channel, columns, names_of

if TYPE_CHECKING:
    from .equations import Equations

#: Quantities of ends: what pushes along them, and the power of s that makes them of a place.
_KINDS = {
    "position": ("force", 0), "velocity": ("force", 1), "acceleration": ("force", 2),
    "angular_velocity": ("moment", 1), "angular_acceleration": ("moment", 2),
}  # fmt: skip


@dataclass(frozen=True)
class Part:
    """What an output has of one quantity: `weight` times a power `order` of s of a coordinate
    (`place` in x) or of an end, where `push` goes along it."""

    order: int
    place: int = -1
    push: Channel | None = None
    weight: float = 1.0


@dataclass(frozen=True)
class Output:
    """One output: its name, unit, and the quantities that it is the sum of."""

    name: str
    unit: str
    parts: tuple[Part, ...]


def outputs_of(linear: Equations, names: Sequence[str] | None) -> list[Output]:
    """The outputs of names, or (None) all coordinates: "shoulder.angle", "shoulder.angle_rate", of
    bodies and ends in inertial axes "boom.tip.velocity.y" or short "boom.tip.vy", and outputs of
    the scene, of expressions their slopes at the state.

    Raises SceneError for a name that is none of these, or that a moving state does not give.
    """
    plain = {one.name: one for one in _coordinates(linear)}
    if names is None:
        return list(plain.values())

    @cache
    def rates() -> dict[str, Output]:
        return {one.name: one for one in _rates(linear)}

    def of(name: str) -> Output:
        return plain.get(name) or rates().get(name) or _of_end(linear, name)

    return [_of_scene(linear, name, of) or of(name) for name in names_of("outputs", names)]


def _coordinates(linear: Equations) -> Iterator[Output]:
    for place, name in enumerate(linear.coordinates):
        yield Output(name, linear.units[place], (Part(0, place),))


def _of_scene(linear: Equations, name: str, of: Callable[[str], Output]) -> Output | None:
    """An output of the scene: the quantity that it is, or the slope of its expression; None where
    the scene has none of this name."""
    given = next((one for one in linear.model.scene.output if one.name == name), None)
    if given is None:
        return None
    source = one_quantity(given)
    if source:
        return of(source)
    inputs = linear.model.layout.inputs
    parts, values = list[tuple[Part, ...]](), list[float]()
    for one in given.of.names:
        if one.text in inputs:
            raise SceneError(
                f'output "{name}": of: "{one.text}" is an input, which linear models add by '
                "themselves where it pushes; leave it out of the output"
            )
        try:
            parts.append(() if one.text == "t" else of(one.text).parts)
        except SceneError as error:
            raise SceneError(f'output "{name}": of: {error}') from None
        values.append(sum(map(partial(_value, linear), parts[-1])) if parts[-1] else linear.state.t)
    kernel = jacobian(kernel_of(given.of), "names", "value")
    slopes = vectorized.evaluate(kernel, {"names": np.array(values)})
    (column,) = slopes.values()
    if not np.isfinite(column).all():
        raise SceneError(f'output "{name}": of: "{given.of.text}" has no slope at this state')
    weighed = zip(parts, column[:, 0].tolist(), strict=True)
    return Output(
        name, given.unit, tuple(replace(x, weight=slope) for some, slope in weighed for x in some)
    )


def _value(linear: Equations, part: Part) -> float:
    """What a quantity is at the state."""
    state, model = linear.state, linear.model
    if part.push is None:
        entry = linear.free[part.place]
        slots = model.layout.hinge_of_speed(entry)
        if part.order:
            return float((state.u, state.a)[part.order - 1][entry])
        return float(state.q[slots.q + entry - slots.u]) if slots.straight else 0.0
    kind = next(x for x, how in _KINDS.items() if how == (part.push.kind, part.order))
    engine = model.looped
    seen = engine.observe(
        np.array([state.t]), state.q[None], state.u[None], engine.start_memory()[None],
        [Probe(*engine.packed.end(part.push.end))], parts=("points",),
    )  # fmt: skip
    return float(seen.points[0, 0, COLUMNS[kind]][part.push.axis])


def _rates(linear: Equations) -> Iterator[Output]:
    """Rates and accelerations of coordinates."""
    layout = linear.model.layout
    for place, (entry, name) in enumerate(zip(linear.free, linear.coordinates, strict=True)):
        slots = layout.hinge_of_speed(entry)
        owner, k = name.rpartition(".")[0], entry - slots.u
        speed, unit = slots.u_names[k], slots.u_units[k]
        yield Output(f"{owner}.{speed}", unit, (Part(1, place),))
        yield Output(f"{owner}.{acceleration_name(speed)}", rate_unit(unit), (Part(2, place),))


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
                part = Part(order, push=Channel("", "", end=end, kind=push, axis=axis))
                return Output(f"{end}.{kind}.{about.labels[axis]}", about.unit, (part,))
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
    """(3, outputs, n): what each output is of x, of its rates and of its accelerations."""
    rows = np.zeros((3, len(outputs), len(linear)))
    parts = [(k, part) for k, one in enumerate(outputs) for part in one.parts]
    pushed = [part.push for _, part in parts if part.push is not None]
    found = iter(columns(linear.model.looped, linear.state, pushed, list(linear.free)).T)
    for k, part in parts:
        along = np.eye(len(linear))[part.place] if part.push is None else next(found)
        rows[part.order, k] += part.weight * along
    return rows
