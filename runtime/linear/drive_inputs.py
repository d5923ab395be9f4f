"""Motions of drives as inputs of linear models: a road, a shaker, a platform.

Beside a state the residual changes with a driven coordinate d as with any other,

    M x'' + C x' + K x = V v - (M_d d'' + C_d d' + K_d d),

the columns being directional derivatives of the same recursion, exact, O(bodies).  Matrices take
the acceleration d'' for an input and d, d' for states behind x, x'; a frequency response takes d or
d' as well, which are powers of s apart.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import SceneError
from mstmm.expression.derivative import expression_derivatives
from mstmm.expression.expression import Expression

from ..engine.looped_engine import LoopedEngine
from ..engine.observation_columns import acceleration_name, rate_unit
from ..engine.tangent_matrix import TangentMatrix
from ..packing.coordinate_layout import HingeSlots
from ..packing.loops.system_variants import without_drives
from ..packing.scene_packing import packed_system
from .mck_matrices import State

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene


class Motion(NamedTuple):
    """The motion of a drive: its unit, the place of its speed, and how often it is differentiated
    by the time."""

    unit: str
    speed: int
    order: int


#: Places of speeds, and how far each goes along.
Moves = tuple[tuple[int, float], ...]


class Columns(NamedTuple):
    """K_d, C_d and M_d (nu,): what a unit of d, d' and d'' asks of the efforts."""

    stiffness: Array
    damping: Array
    inertia: Array


def motions(model: CompiledScene) -> dict[str, Motion]:
    """The motions of every drive by the names that results have: "platform.displacement",
    "platform.displacement_rate", "platform.displacement_acceleration"."""
    found = dict[str, Motion]()
    for slots, k, _ in _driven(model):
        if slots.straight:
            unit, speed = slots.u_units[k], slots.u_names[k]
            named = (
                (slots.q_names[k], slots.q_units[k]),
                (speed, unit),
                (acceleration_name(speed), rate_unit(unit)),
            )
            for order, (name, of) in enumerate(named):
                found[f"{slots.name}.{name}"] = Motion(of, slots.u + k, order)
    return found


def _driven(model: CompiledScene) -> Iterator[tuple[HingeSlots, int, Expression]]:
    """(slots of a hinge, which of its coordinates, its drive) of everything driven."""
    packed = model.packed
    for place, k in packed.system.driven:
        number = packed.topology.at(place)[1]
        drive = (packed.scene.hinges[number].drive or ())[k]
        if drive is not None:
            yield model.layout.slots(number), k, drive


def accelerations(model: CompiledScene, moves: Moves) -> list[str]:
    """Names of the accelerations of drives."""
    speeds = {speed for speed, _ in moves}
    return [x for x, one in motions(model).items() if one.order == 2 and one.speed in speeds]


def coordinate(model: CompiledScene, speed: int) -> str:
    """Name of the coordinate whose rate a speed is."""
    slots = model.layout.hinge_of_speed(speed)
    return f"{slots.name}.{slots.q_names[speed - slots.u]}"


def followers(model: CompiledScene, name: str, t: float) -> Moves:
    """The drives that follow an input of the scene, and their slopes by it.

    Raises SceneError where a slope does not last.
    """
    found, channels = dict[int, float](), model.scene.channels
    for slots, k, drive in _driven(model):
        names = [one.text for one in drive.names]
        if name not in names:
            continue
        if not slots.straight or not all(x in channels and channels[x].stands for x in names):
            raise SceneError(
                f'"{name}": the drive of hinge "{slots.name}" follows this input, and goes by time '
                "besides; name the motion of the drive itself for an input, or let the input stand "
                "still"
            )
        rule = expression_derivatives(drive, lambda one: channels[one.text].value(t))
        found[slots.u + k] = sum(slope for one, slope in rule.items() if one.text == name)
    return tuple(found.items())


def columns_of(engine: LoopedEngine, state: State, moves: Moves) -> Columns:
    """(nu,) what drives of a tree that go along with one motion ask for."""
    along = np.zeros(engine.nu)
    for speed, factor in moves:
        along[speed] += factor
    return slopes_along(engine, state, along)


def slopes_along(engine: LoopedEngine, state: State, along: Array) -> Columns:
    """(nu,) slopes of the residual along a motion of all speeds, driven ones (whose rates are
    speeds) too."""
    first, driven = engine.packed.system.places["u"], engine.packed.system.driven
    engine = _undriven(engine)
    tangent, still = TangentMatrix(engine), np.zeros(engine.nu)
    moved, at_rest = tangent.rates(state.q, along), np.zeros(engine.nq)
    for speed in (int(first[place]) + k for place, k in driven):
        slots = engine.packed.layout.hinge_of_speed(speed)
        moved[slots.q + speed - slots.u] = along[speed]
    tangent.residual(state.t, state.q, state.u, state.a)
    return Columns(
        tangent.slope(0.0, moved, still, still),
        tangent.slope(0.0, at_rest, along, still),
        tangent.slope(0.0, at_rest, still, along),
    )


def _undriven(engine: LoopedEngine) -> LoopedEngine:
    """The tree with the same numbers, moved by nobody."""
    return LoopedEngine(packed_system(without_drives(engine.packed.system), engine.packed))
