"""Energy and momentum balances of a run, and the drift that its steps explain.

Energy minus work, and momentum without external loads, should stay constant. Their drift is not the
error of the motion, but it reveals wrong steps and wrong laws.

An impact between bodies of a scene does not change the total momentum; an impact against the
ground, such as that of a ball on the floor, does. Linear momentum along an axis is conserved if the
scene can translate along it as one rigid body, as its hinges on the ground permit, without changing
the distance to the struck object; angular momentum if it can rotate about the axis in the same way.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure
from mstmm.risk import Risk
from mstmm.scene import Hinge, Scene

from ...engine.compiled_scene import total_mass, total_weight
from ...engine.fused_code import NoFusedCode
from ...engine.state_evaluation.kinematics import Kinematics
from ...integrate.achieved_error import AchievedError
from ...integrate.settings import Settings
from ...integrate.steppers import get, names
from ...run.scene_system import SceneSystem
from ..certificate_data import Drift, StepControl
from ..result_record import Record
from .check import MeasuringCheck
from .loops import CLOSURE, MISFIT_REMEDY

#: Order assumed for methods without a tableau.
_DEFAULT_ORDER = 2

#: A hinge load counts as zero below this part of the largest one.
_ZERO_LOAD_RATIO = 1e-9

#: Fraction of the stored energy that serves as scale where hardly anything moves.
_STORED_ENERGY_RATIO = 1e-8

#: Height differences (m) below this are rounding.
_HEIGHT_ROUNDING = 1e-15

#: Maximum number of bodies sampled to estimate the extent of a scene.
_MAX_SAMPLED_BODIES = 30


def step_control(settings: Settings, reached: AchievedError | None) -> StepControl:
    """Step control of a run."""
    has_tableau = settings.method in names()
    order = get(settings.method).order if has_tableau else _DEFAULT_ORDER
    target_error = None
    if reached is not None:
        target_error = reached.target if reached.unit in ("1", "rad") else 0.0
    return StepControl(settings.step, settings.rtol, settings.atol, order, target_error)


class BalanceCheck(MeasuringCheck[tuple[Drift, ...]]):
    """Energy and momentum that are not conserved."""

    def measure(self, result: Record) -> tuple[Drift, ...]:
        """Drift of energy, then those of conserved momenta."""
        return (energy_drift(result), *momentum_drifts(result))

    def after(self, result: Record) -> Iterator[Risk]:
        """Risks of balances that are unknown, or drift more than steps explain."""
        drifts, closure = self.measured(result), CLOSURE.measured(result)
        control = step_control(result.settings, result.achieved_error)
        for drift in drifts:
            if not drift.is_known:
                yield Risk(
                    drift.risk_name, drift.name,
                    f"the drift of {drift.name} is unknown: overflow, or no sample can be "
                    "evaluated",
                    "use smaller steps or tolerances, or find the quantity that grows without "
                    "bound",
                )  # fmt: skip
        has_misfit = closure is not None and closure.misfit > 0
        for drift in drifts:
            if drift.relative > control.bound:
                yield Risk(
                    drift.risk_name, drift.name,
                    f"{drift.name} is not conserved: it drifts by {drift}",
                    MISFIT_REMEDY if has_misfit else control.finer(drift.relative),
                    drift.relative, control.bound,
                )  # fmt: skip


BALANCE = BalanceCheck()


def _max_abs(values: Array) -> float:
    return float(np.max(np.abs(values[np.isfinite(values)]), initial=0.0))


def _max_change(values: Array) -> float:
    """Largest change from the first of the values (n,) that can be evaluated.

    nan if one of them overflows, or none is left.
    """
    valid = values[~np.isnan(values)]
    if not len(valid) or not np.isfinite(valid).all():
        return np.nan
    return float(np.max(np.abs(valid - valid[0])))


# --- energy ---------------------------------------------------------------------------------------


def energy_drift(result: Record) -> Drift:
    """Drift of T + V - W relative to the largest energy exchanged: T, changes of V, W.

    In static equilibrium no energy is exchanged: the scale is then a fraction of the stored energy,
    or the energy of gravity due to rounding of positions.
    """
    parts, work = result.energy_components(), result.work
    with np.errstate(all="ignore"):  # the residual shows an overflow
        residual = sum(parts.values(), -work)
        overflows = any(np.isinf(part).any() for part in (*parts.values(), work))
        exchanged = parts["kinetic"] + np.abs(work)
        for name in ("gravity", "springs"):
            exchanged = exchanged + np.abs(parts[name] - parts[name][:1])
    rounding = _HEIGHT_ROUNDING * total_weight(result.model)
    scale = max(_max_abs(exchanged), _STORED_ENERGY_RATIO * _max_stored_energy(parts), rounding)
    change = np.nan if overflows else _max_change(residual)
    return Drift("energy", "J", change if len(residual) else 0.0, scale, "exchanged")


def _max_stored_energy(parts: Mapping[str, Array]) -> float:
    """Largest stored energy of gravity and springs, J."""
    with np.errstate(all="ignore"):
        return _max_abs(np.abs(parts["gravity"]) + np.abs(parts["springs"]))


# --- momentum -------------------------------------------------------------------------------------


def momentum_drifts(result: Record) -> list[Drift]:
    """Drifts of the momentum components that no external load changes.

    Omits components that are zero throughout, and those that an impact may have changed. Angular
    momentum is about the origin, or about the only point at which the scene is attached to the
    ground. Scales: sqrt(2 m T), in static equilibrium with a fraction of the stored energy for T,
    and the larger of the largest angular momentum and that times the extent of the scene.
    """
    scene, drifts = result.model.scene, list[Drift]()
    flexible = result.model.flexible_bodies
    has_drag = any(body.drag is not None for body in flexible.values())
    if not len(result.t) or has_drag or not _is_isolated(scene):
        return drifts
    bodies = scene.skeleton.bodies
    sampled_indices = range(0, len(bodies), max(1, len(bodies) // _MAX_SAMPLED_BODIES))
    names = [bodies.name(i) for i in sampled_indices]
    result._observations.fetch(names)
    reach = max((_max_abs(result.position(name)) for name in names), default=0.0)
    pivot, pivot_label = _momentum_pivot(result, reach)
    reach = max((_max_abs(result.position(name) - pivot) for name in names), default=0.0)
    kinetic = _max_abs(result.energy_components()["kinetic"])
    mass = total_mass(result.model)
    linear, angular = result.momentum(), result.angular_momentum()
    angular = angular - np.cross(pivot, linear)
    is_conserved = np.array(_unsupported_axes(result, reach, kinetic, pivot)) & _gravity_free_axes(
        scene
    )
    is_conserved &= np.array([linear.any(axis=0), angular.any(axis=0)])
    is_conserved = momentum_kept_by_impacts(
        result, _ground_hinges(scene), pivot, is_conserved.ravel()
    ).reshape(2, 3)
    speed = np.sqrt(
        2 * max(kinetic, _STORED_ENERGY_RATIO * _max_stored_energy(result.energy_components()))
    ) * np.sqrt(mass)
    scale = max(_max_abs(np.linalg.norm(angular, axis=1)), speed * reach)
    for k, axis in enumerate("xyz"):
        if is_conserved[0, k]:
            change = _max_change(linear[:, k])
            drifts.append(Drift(f"momentum {axis}", "kg*m/s", change, speed, "in motion"))
        if is_conserved[1, k]:
            name, change = f"angular momentum {axis}{pivot_label}", _max_change(angular[:, k])
            drifts.append(Drift(name, "kg*m2/s", change, scale, "in rotation"))
    return drifts


def _gravity_free_axes(scene: Scene) -> NDArray[np.bool_]:
    """Axes (2, 3) along which gravity has no force, and about which it has no moment."""
    x, y, z = (component == 0 for component in scene.gravity)
    return np.array([[x, y, z], [y and z, x and z, x and y]])


def _is_isolated(scene: Scene) -> bool:
    """Whether only uncoupled hinges and gravity act between the scene and the ground."""
    loads = any(
        not expression.is_zero
        for load in scene.load
        for expression in (*load.force, *load.moment, *(load.force_per_length or ()))
    )
    connections = (*scene.forces, *scene.constraint)
    coupled_hinges = {name.hinge for coupling in scene.coupling for name in coupling.names}
    roots = _ground_hinges(scene)
    return (
        not loads
        and not any("ground" in (connection.from_, connection.to) for connection in connections)
        and not any(hinge.name in coupled_hinges for hinge in roots)
        and all(_is_passive(hinge) for hinge in roots)
    )


def _ground_hinges(scene: Scene) -> list[Hinge]:
    """Hinges on the ground."""
    first_hinges = zip(scene.chain, scene.hinges.starts, strict=False)
    return [
        *(hinge for hinge in scene.hinge if hinge.inboard_body == "ground"),
        *(scene.hinges[first] for chain, first in first_hinges if chain.inboard == "ground"),
    ]


def _is_passive(hinge: Hinge) -> bool:
    acts = any(
        e.stiffness or e.damping or not e.effort.is_zero or e.inertia
        or e.friction.acts or e.limits.acts
        for e in hinge.law.entries()
    )  # fmt: skip
    return not acts and hinge.drive is None and hinge.release is None


def _momentum_pivot(result: Record, reach: float) -> tuple[Array, str]:
    """Reference point (3,) of angular momentum, and its description in names.

    The point of the only hinge on the ground, if it is fixed; else the origin.
    """
    roots = _ground_hinges(result.model.scene)
    if len(roots) == 1 and not _carries_nothing(roots[0]):
        positions = result.position(roots[0].outboard)
        position, size = positions[0], reach + _max_abs(positions[0])
        if (
            np.isfinite(position).all()
            and _max_abs(positions - position) <= _ZERO_LOAD_RATIO * size
        ):
            return position, f' about "{roots[0].name}"' if position.any() else ""
    return np.zeros(3), ""


def _carries_nothing(hinge: Hinge) -> bool:
    """Whether a hinge transmits no load other than that of its law."""
    return hinge.facts is not None and hinge.facts.free_body


def _unsupported_axes(
    result: Record, reach: float, kinetic: float, pivot: Array
) -> tuple[list[bool], list[bool]]:
    """Components of force, and of moment about the pivot, that the ground never transmits.

    Compared with the largest loads of the scene and with its kinetic energy, which scales moments
    and, over the reach, forces: where nothing else acts, loads are rounding.
    """
    scene = result.model.scene
    roots = _ground_hinges(scene)
    if all(map(_carries_nothing, roots)):
        return [True] * 3, [True] * 3
    force, moment = np.zeros((len(result.t), 3)), np.zeros((len(result.t), 3))
    largest = result._observations.largest_loads()
    sizes = (
        max(largest[0], kinetic / reach if reach > 0 else 0.0),
        max(largest[1] + largest[0] * reach, kinetic),
    )
    for hinge in roots:
        f = result.force(hinge.name)
        force = force + f
        arm = result.position(hinge.outboard) - pivot
        moment = moment + result.moment(hinge.name) + np.cross(arm, f)
    zero = [[_max_abs(x[:, k]) <= _ZERO_LOAD_RATIO * size for k in range(3)]
            for x, size in zip((force, moment), sizes, strict=True)]  # fmt: skip
    return zero[0], zero[1]


#: Relative size of motions, and of the terms of a rate, that count as zero.
_ZERO_RATIO = 1e-9


def momentum_kept_by_impacts(
    result: Record, roots: Sequence[Hinge], pivot: Array, is_requested: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """Mask (6,) of the components in `is_requested` that the impacts of a run conserve.

    Linear momentum along each axis, then angular momentum about `pivot` (3,) in m; `roots` are the
    hinges on the ground.
    """
    kept, impacts = is_requested.copy(), _impact_samples(result)
    if impacts is None:
        return np.zeros_like(is_requested)
    if impacts and kept.any():
        scene = _RigidScene(result, roots, pivot)
        for row, event in impacts:
            kept &= scene.rigid_motion_axes(row, event, kept)
            if not kept.any():
                break
    return kept


def has_impacts(result: Record) -> bool:
    """Whether a run has impacts; True also where output times may hide them."""
    impacts = _impact_samples(result)
    return impacts is None or bool(impacts)


def _impact_samples(result: Record) -> list[tuple[int, int]] | None:
    """Pairs (sample, event) of all impacts; None if samples may not show all of them."""
    bounce_events = {bounce.event for bounce in result.model.packed_scene.event_functions.bounces}
    rows = np.flatnonzero(result.event > 0).tolist()
    statistics = result.statistics
    if bounce_events and (statistics is None or len(rows) < statistics.events):
        return None
    return [(k, event) for k in rows if (event := int(result.event[k]) - 1) in bounce_events]


class _RigidScene:
    """Scene moved as one rigid body at samples of a run."""

    def __init__(self, result: Record, roots: Sequence[Hinge], pivot: Array) -> None:
        self._result, self._system = result, SceneSystem(result.model.looped)
        self._speeds = [result.coordinate_info(hinge.name).u_slice for hinge in roots]
        self._names = [hinge.outboard for hinge in roots]
        self._arms = [result.position(name) - pivot for name in self._names]
        references = result._observations.references
        self._kinematics = Kinematics(result.model.looped, NoFusedCode(), references, lambda: None)

    def rigid_motion_axes(
        self, row: int, event: int, is_requested: NDArray[np.bool_]
    ) -> NDArray[np.bool_]:
        """Mask of the `is_requested` axes (6,) along and about which the scene can move rigidly.

        The motion must not change the distance to the object of the event.
        """
        speeds, allowed = self._rigid_motions(row)
        remaining = is_requested & allowed
        try:
            remaining[remaining] = self._is_constant(
                row, event, speeds[remaining], self._sizes(row)[remaining]
            )
        except NumericalFailure:
            remaining[:] = False
        return remaining

    def _rigid_motions(self, row: int) -> tuple[Array, NDArray[np.bool_]]:
        """Speeds (6, nu) of the scene's rigid motions, and mask (6,) of those permitted.

        Permitted are motions that the hinges on the ground allow.
        """
        speeds, allowed = np.zeros((6, self._result.model.nu)), np.ones(6, dtype=bool)
        jacobians = self._kinematics.jacobian(self._names, np.array(self._result.q[row]))
        for speed_slice, arms, jacobian in zip(self._speeds, self._arms, jacobians, strict=True):
            twists, columns = _twists(arms[row]), jacobian[:, speed_slice]
            speeds[:, speed_slice] = (np.linalg.pinv(columns) @ twists).T
            residuals = np.linalg.norm(columns @ speeds[:, speed_slice].T - twists, axis=0)
            allowed &= residuals <= _ZERO_RATIO * np.linalg.norm(twists, axis=0)
        return speeds, allowed

    def _sizes(self, row: int) -> Array:
        """Speeds (6,) in m/s of the scene's rigid motions, at the bodies on ground hinges."""
        max_arm = max((float(np.linalg.norm(arms[row])) for arms in self._arms), default=0.0)
        return np.array([1.0, 1.0, 1.0, max_arm, max_arm, max_arm])

    def _is_constant(self, row: int, event: int, motions: Array, sizes: Array) -> list[bool]:
        """Whether an event's value is constant at one sample, for each of the speeds (n, nu)."""
        run, system = self._result.trajectory, self._system
        system.memory[:] = run.memory[row]
        t, y = float(run.t[row]), np.concatenate([run.q[row], run.u[row]])
        rest_rate = system.approach_rate(event, t, y, np.zeros(motions.shape[1])).rate
        approaches = [system.approach_rate(event, t, y, u) for u in motions]
        return [
            abs(approach.rate - rest_rate)
            <= _ZERO_RATIO * (approach.size + approach.steepness * scale)
            for approach, scale in zip(approaches, sizes, strict=True)
        ]


def _twists(arm: Array) -> Array:
    """Velocity and angular velocity (6, 6), as columns, of a point at `arm` (3,) in m.

    From a pivot, for translations along each axis by 1 m/s and rotations about each by 1 rad/s.
    """
    unit = np.eye(3)
    return np.block([[unit, np.cross(unit, arm).T], [np.zeros((3, 3)), unit]])
