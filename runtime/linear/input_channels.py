"""Inputs of linear models: efforts, loads at ends, ground accelerations, scene inputs.

The residual is linear in applied loads, so that a column is the exact difference of two residuals
of the tree at rest without other loads.  By duality the column of a force at a point along n is
also the displacement of the point along n per unit of each coordinate.

The column of an input of the scene is the derivative of the residual with respect to it: the time
derivative with the input changing at unit rate, less that with a constant input.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import SceneError
from mstmm.expression.derivatives import expression_derivatives
from mstmm.expression.expression import Expression
from mstmm.ir.hinge_properties import effort_unit
from mstmm.numerics.piecewise_polynomial import PiecewisePolynomial
from mstmm.scene.tables.inputs import Input
from mstmm.scene.validators.validation_messages import did_you_mean

from ..discontinuities.active_expressions import active_expressions
from ..engine.looped_engine import LoopedEngine
from ..engine.quantity_registry import BodyReferences, acceleration_name, effort_names, rate_unit
from ..engine.tangent_matrix import TangentMatrix
from ..packing.coordinate_layout import HingeSlots
from ..packing.expression_tapes import constant_kernel
from ..packing.scene_packing import packed_system
from ..packing.system import LoadNumbers
from ..packing.system_variants import without_drives
from .frozen_loads import INERTIAL
from .mck_matrices import State

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene


# --- motions of drives ----------------------------------------------------------------------------
#
# About a state the residual depends on a driven coordinate d as on any other,
#
#     M x'' + C x' + K x = V v - (M_d d'' + C_d d' + K_d d),
#
# where the columns are exact directional derivatives of the same recursion, O(bodies).  Matrices
# have the acceleration d'' as an input and d, d' as states after x, x'; a frequency response also
# accepts d or d' as an input, which differ by powers of s.


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


def drive_motions(model: CompiledScene) -> dict[str, Motion]:
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
        x
        for x, motion in drive_motions(model).items()
        if motion.order == 2 and motion.speed in speeds
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


# --- channels -------------------------------------------------------------------------------------

_AXES = "xyz"
#: Loads at an end and their units, by the letter of the short name.
_KINDS = {"f": ("force", "N"), "m": ("moment", "N*m")}
GROUND = tuple(f"ground.acceleration.{axis}" for axis in _AXES)


@dataclass(frozen=True)
class Channel:
    """Input channel of a linear model.

    Attributes:
        name, unit: of the channel.
        speed: index of the speed of an effort, or -1.
        end, kind, axis: end, "force" or "moment", and axis index of a load at an end; `axis` is
            also that of a ground acceleration, which has none of the other attributes.
        input: index of an input of the scene, or -1.
        spring: index of a spring with an effort, or -1.
        drive: order of the time derivative of a motion of drives, or -1.
        drive_factors: drives that follow the channel, with factors.
    """

    name: str
    unit: str
    speed: int = -1
    end: str = ""
    kind: str = ""
    axis: int = 0
    input: int = -1
    spring: int = -1
    drive: int = -1
    drive_factors: DriveFactors = ()


def require_names(what: str, names: Sequence[str]) -> Sequence[str]:
    """Validated list of names; SceneError for anything else."""
    if isinstance(names, str) or not isinstance(names, Iterable):
        raise SceneError(f'{what} = {names!r}: expected a list of names, such as ["{names}"]')
    if not all(isinstance(name, str) for name in names):
        raise SceneError(f"{what} = {names!r}: expected a list of names")
    return names


def some_names(what: str, names: Sequence[str]) -> Sequence[str]:
    """Validated list of at least one name; SceneError for anything else."""
    if not require_names(what, names):
        raise SceneError(f"{what} is empty: expected one name or more; give names, or leave it out")
    return names


def input_channels(model: CompiledScene, what: str, names: Sequence[str]) -> tuple[Channel, ...]:
    """Channels of a list of names for matrices; of drives only accelerations are accepted.

    Raises SceneError for other motions of drives.
    """
    channels = tuple(channel(model, name) for name in require_names(what, names))
    for given in channels:
        if 0 <= given.drive < 2:
            instead = ", ".join(f'"{x}"' for x in accelerations(model, given.drive_factors))
            raise SceneError(
                f'"{given.name}": in matrices the input of a drive is its acceleration, '
                f"{instead}; use that, or frequency_response, which accepts this name too"
            )
    return channels


def inputs_of(model: CompiledScene) -> list[str]:
    """Inputs of the scene except those of drives, which are motions and not loads."""
    if not model.scene.input:
        return []
    driving = {
        name for active in active_expressions(model.scene) if active.drive for name in active.inputs
    }
    return [
        scene_input.name for scene_input in model.scene.input if scene_input.name not in driving
    ]


def channel(model: CompiledScene, name: str) -> Channel:
    """Channel of a name.

    Names are "shoulder.effort" ("ball.effort_wx" for hinges with several speeds), "strut.effort" of
    a spring, "boom.tip.force.x" or short "boom.tip.fx", "boom.tip.moment.z" or "boom.tip.mz"
    (inertial axes), "ground.acceleration.y", a motion of a drive, or an input of the scene.

    Raises SceneError for an unknown name, an effort on a driven speed, and an input that drives
    follow but other expressions also read.
    """
    owner, _, last = name.rpartition(".")
    given = next(
        (scene_input for scene_input in model.scene.input if scene_input.name == name), None
    )
    if given is not None:
        if any(
            active.drive and name in active.inputs for active in active_expressions(model.scene)
        ):
            return _drive_channel(model, given)
        return Channel(name, given.unit, input=model.coordinate_layout.inputs[name])
    if name in GROUND:
        return Channel(name, "m/s2", axis=_AXES.index(last))
    driven = drive_motions(model)
    if name in driven:
        motion = driven[name]
        return Channel(name, motion.unit, drive=motion.order, drive_factors=((motion.speed, 1.0),))
    ends = BodyReferences(model.scene.skeleton)
    if last.startswith("effort") and owner in model.coordinate_layout.hinges:
        return _effort(model, name, owner, last)
    springs = [spring.name for spring in model.scene.spring]
    if last == "effort" and owner in springs:
        return Channel(name, "N", spring=springs.index(owner))
    for letter, (kind, unit) in _KINDS.items():
        for axis, component in enumerate(_AXES):
            end = owner.removesuffix(f".{kind}")
            long = end != owner and last == component
            if (long or last == letter + component) and end in ends:
                own = ends.canonical(end) or end
                return Channel(f"{end}.{kind}.{component}", unit, end=own, kind=kind, axis=axis)
    given_names = [scene_input.name for scene_input in model.scene.input]
    known = [
        *given_names,
        *driven,
        *(f"{spring}.effort" for spring in springs),
        *_efforts(model),
        *(f"{end}.force.{axis}" for end in ends for axis in _AXES),
        *GROUND,
    ]
    raise SceneError(
        f'"{name}": expected an effort of a hinge or spring such as "shoulder.effort", a force or '
        'moment at an end such as "boom.tip.force.x", an acceleration of the ground such as '
        '"ground.acceleration.x", a motion of a drive, or an input of the scene'
        f"{did_you_mean(name, known)}"
    )


def _drive_channel(model: CompiledScene, given: Input) -> Channel:
    """Channel of an input that drives follow: the motion of these drives."""
    pushing = [
        x.description
        for x in active_expressions(model.scene)
        if given.name in x.inputs and not x.drive
    ]
    if pushing:
        raise SceneError(
            f'"{given.name}": drives follow this input, and the {pushing[0]} also reads it; '
            "use separate inputs"
        )
    return Channel(given.name, given.unit, drive=0, drive_factors=followers(model, given.name, 0.0))


def _effort(model: CompiledScene, name: str, hinge: str, last: str) -> Channel:
    slots = model.coordinate_layout.hinges[hinge]
    names = effort_names(slots.u_names)
    if last not in names:
        raise SceneError(f'"{name}": hinge "{hinge}" has {", ".join(names) or "no speeds"}')
    k = names.index(last)
    if slots.u + k not in model.free_speed_indices:
        raise SceneError(
            f'"{name}": hinge "{hinge}" is driven there, so that an effort has no effect; use '
            "another effort, or the motion of the drive as the input, such as "
            f'"{hinge}.{acceleration_name(slots.u_names[k])}"'
        )
    return Channel(name, effort_unit(slots.u_units[k]), speed=slots.u + k)


def _efforts(model: CompiledScene) -> list[str]:
    hinges = model.coordinate_layout.hinges
    return [f"{name}.{effort}" for name in hinges for effort in effort_names(hinges[name].u_names)]


def columns(
    engine: LoopedEngine, state: State, channels: Sequence[Channel], free: list[int]
) -> Array:
    """Efforts (free, channels) along the free speeds per unit of each channel."""
    if not channels:
        return np.zeros((len(free), 0))
    still, memory = np.zeros(engine.nu), engine.start_memory()

    def excess_efforts(of: LoopedEngine) -> Array:
        """Required efforts at rest in excess of those of the unloaded tree."""
        bare, loaded = (
            each.inverse_dynamics(state.t, state.q, still, still, memory)
            for each in (engine.inertia_only, of)
        )
        return np.asarray(loaded - bare)

    column_list = []
    for given in channels:
        if given.input >= 0:
            column_list.append(
                _rate(engine, state, given.input, 0.0) - _rate(engine, state, given.input, 1.0)
            )
        elif given.drive >= 0:
            column_list.append(-drive_columns(engine, state, given.drive_factors).inertia)
        elif given.speed >= 0:
            column_list.append(np.eye(engine.nu)[given.speed])
        elif given.spring >= 0:
            column_list.append(-excess_efforts(_with_unit_spring_effort(engine, given.spring)))
        elif given.end:
            column_list.append(-excess_efforts(_with_unit_load(engine, given)))
        else:
            column_list.append(excess_efforts(engine.unit_gravity[given.axis]))
    return np.array(column_list).T[free]


def _rate(engine: LoopedEngine, state: State, index: int, rate: float) -> Array:
    """Time derivative (nu,) of the residual with constant inputs except one of the given rate."""
    system = engine.packed.system
    inputs = [
        PiecewisePolynomial(
            (), ((state.t, channel_input.value(state.t), rate if k == index else 0.0, 0.0, 0.0),)
        )
        for k, channel_input in enumerate(system.inputs)
    ]
    still = replace(system.held_inputs, memory_indices=(-1,) * len(inputs))
    going = replace(system, inputs=tuple(inputs), held_inputs=still)
    tangent = TangentMatrix(LoopedEngine(packed_system(going, engine.packed)))
    tangent.residual(state.t, state.q, state.u, state.udot)
    nothing = np.zeros(engine.nu)
    return tangent.slope(1.0, np.zeros(engine.nq), nothing, nothing)


def _with_unit_load(engine: LoopedEngine, push: Channel) -> LoopedEngine:
    """Engine of the tree with a unit load of the channel at an end as the only load."""
    packed = engine.packed
    body, _, offset = packed.end(push.end)
    system = packed.system.with_active_body(body)  # the end may have no other element
    unit = np.eye(3)[push.axis].tolist()
    nothing, own = (-1, -1, -1), (0, 1, 2)
    force = push.kind == "force"
    load = LoadNumbers(
        body, -1, INERTIAL, offset, own if force else nothing, nothing if force else own
    )
    system = replace(
        system, gravity=(0.0, 0.0, 0.0), laws=(), forces=(), loads=(load,),
        values=constant_kernel("values", system, unit), drives=None, driven=(), seeded_numbers={},
    )  # fmt: skip
    return LoopedEngine(packed_system(system, packed))


def _with_unit_spring_effort(engine: LoopedEngine, number: int) -> LoopedEngine:
    """Engine of the tree with a unit effort of one spring as the only load."""
    packed, system = engine.packed, engine.packed.system
    constant = constant_kernel("effort", system, [1.0])
    spring = replace(
        system.forces[number], element=("force", "spring"), p=(0.0, 0.0, 0.0), effort=constant
    )
    system = replace(
        system, gravity=(0.0, 0.0, 0.0), laws=(), forces=(spring,), loads=(), values=None,
        drives=None, driven=(), seeded_numbers={},
    )  # fmt: skip
    return LoopedEngine(packed_system(system, packed))
