"""Motions of drives as inputs of linear models: a road, a shaker, a platform.

About a state the residual depends on a driven coordinate d as on any other,

    M x'' + C x' + K x = V v - (M_d d'' + C_d d' + K_d d),

where the columns are exact directional derivatives of the same recursion, O(bodies).  Matrices have
the acceleration d'' as an input and d, d' as states after x, x'; a frequency response also accepts
d or d' as an input, which differ by powers of s.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import SceneError
from mstmm.expression.derivatives import expression_derivatives
from mstmm.expression.expression import Expression

from ..engine.looped_engine import LoopedEngine
from ..engine.quantity_registry import acceleration_name, rate_unit
from ..engine.tangent_matrix import TangentMatrix
from ..packing.coordinate_layout import HingeSlots
from ..packing.scene_packing import packed_system
from ..packing.system_variants import without_drives
from .mck_matrices import State

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene


class Motion(NamedTuple):
    """Motion of a drive: its unit, the index of its speed, and the order of the time derivative."""

    unit: str
    speed: int
    order: int


#: Driven speeds of one common motion: (index, factor) each.
DriveFactors = tuple[tuple[int, float], ...]


class Columns(NamedTuple):
    """Columns K_d, C_d and M_d (nu,): required efforts per unit of d, d' and d''."""

    stiffness: Array
    damping: Array
    inertia: Array


def motions(model: CompiledScene) -> dict[str, Motion]:
    """Motions of all drives by their names in results.

    Names are such as "platform.displacement", "platform.displacement_rate" and
    "platform.displacement_acceleration".
    """
    motions_by_name = dict[str, Motion]()
    for slots, k, _ in _driven_coordinates(model):
        if slots.rates_are_speeds:
            unit, speed = slots.u_units[k], slots.u_names[k]
            named = (
                (slots.q_names[k], slots.q_units[k]),
                (speed, unit),
                (acceleration_name(speed), rate_unit(unit)),
            )
            for order, (name, of) in enumerate(named):
                motions_by_name[f"{slots.name}.{name}"] = Motion(of, slots.u + k, order)
    return motions_by_name


def _driven_coordinates(model: CompiledScene) -> Iterator[tuple[HingeSlots, int, Expression]]:
    """Yield (slots of the hinge, index of its coordinate, drive) of all driven coordinates."""
    packed = model.packed_scene
    for tree_index, k in packed.system.driven:
        number = packed.topology.scene_indices(tree_index)[1]
        drive = (packed.scene.hinges[number].drive or ())[k]
        if drive is not None:
            yield model.coordinate_layout.slots(number), k, drive


def accelerations(model: CompiledScene, moves: DriveFactors) -> list[str]:
    """Names of the accelerations of the drives in `moves`."""
    speeds = {speed for speed, _ in moves}
    return [
        x for x, motion in motions(model).items() if motion.order == 2 and motion.speed in speeds
    ]


def coordinate(model: CompiledScene, speed: int) -> str:
    """Name of the coordinate whose rate is the speed."""
    slots = model.coordinate_layout.hinge_of_speed(speed)
    return f"{slots.name}.{slots.q_names[speed - slots.u]}"


def followers(model: CompiledScene, name: str, t: float) -> DriveFactors:
    """Drives that follow an input of the scene, with their slopes with respect to it.

    Raises SceneError where a slope depends on time.
    """
    factors, channels = dict[int, float](), model.scene.channels
    for slots, k, drive in _driven_coordinates(model):
        names = [expression_name.text for expression_name in drive.names]
        if name not in names:
            continue
        if not slots.rates_are_speeds or not all(
            x in channels and channels[x].is_constant for x in names
        ):
            raise SceneError(
                f'"{name}": the drive of hinge "{slots.name}" depends on this input and also '
                "on time; use the motion of the drive itself as the input, or keep the input "
                "constant"
            )
        rule = expression_derivatives(
            drive, lambda expression_name: channels[expression_name.text].value(t)
        )
        factors[slots.u + k] = sum(
            slope for expression_name, slope in rule.items() if expression_name.text == name
        )
    return tuple(factors.items())


def drive_columns(engine: LoopedEngine, state: State, moves: DriveFactors) -> Columns:
    """Columns (nu,) of drives of a tree that follow one common motion."""
    along = np.zeros(engine.nu)
    for speed, factor in moves:
        along[speed] += factor
    return residual_derivatives(engine, state, along)


def residual_derivatives(engine: LoopedEngine, state: State, along: Array) -> Columns:
    """Slopes (nu,) of the residual along a motion of all speeds.

    Driven speeds, which are the rates of their coordinates, are included.
    """
    first, driven = engine.packed.system.first_indices["u"], engine.packed.system.driven
    engine = _undriven(engine)
    tangent, still = TangentMatrix(engine), np.zeros(engine.nu)
    moved, at_rest = tangent.rates(state.q, along), np.zeros(engine.nq)
    for speed in (int(first[tree_index]) + k for tree_index, k in driven):
        slots = engine.packed.layout.hinge_of_speed(speed)
        moved[slots.q + speed - slots.u] = along[speed]
    tangent.residual(state.t, state.q, state.u, state.udot)
    return Columns(
        tangent.slope(0.0, moved, still, still),
        tangent.slope(0.0, at_rest, along, still),
        tangent.slope(0.0, at_rest, still, along),
    )


def _undriven(engine: LoopedEngine) -> LoopedEngine:
    """Engine of the same tree without drives."""
    return LoopedEngine(packed_system(without_drives(engine.packed.system), engine.packed))
