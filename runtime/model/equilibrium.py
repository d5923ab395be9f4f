"""Static equilibrium of a model: the free coordinates need no effort at rest."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from mstmm.array_validation import Array
from mstmm.display import abbreviate_names
from mstmm.errors import MstmmError, NumericalFailure, SceneError
from mstmm.risk import AssessedResult, DeferredRisks, Risk, information

from ..discontinuities.active_expressions import active_expressions
from ..engine.compiled_scene import scene_length, speed_scales
from ..engine.looped_engine import Probe
from ..engine.pseudo_transient_equilibrium import MAX_STEPS
from ..engine.static_equilibrium import EquilibriumNotFoundError, UndeterminedEquilibriumError
from ..linear.operating_point.departure import find_departure
from ..linear.operating_point.later_states import LaterStates
from ..linear.validity import departure_risk
from ..result.checks.answer_checks import find_state_risks
from ..run.scene_system import SceneSystem
from .equilibrium_search import MAX_INDEPENDENT, EquilibriumSearch, Progress

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene
    from ..linear.linear_model import Linear


#: Largest number of efforts that a message lists.
_MAX_LISTED = 3
#: Motion of a coordinate, relative to the largest one, from which it counts as moving.
_MOVING_SHARE = 0.1
#: Largest motion of points of a body that only spins, relative to angular velocity times length:
#: the accuracy of motions without stiffness where there are many.
_MAX_SPIN_MOTION = 5e-2

_AXES = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)


class Equilibrium(AssessedResult, np.ndarray[Any, np.dtype[np.float64]]):
    """Array q (nq,) of an equilibrium with residuals, instabilities and findings.

    `residuals` are the remaining efforts in N or N*m (of modal coordinates N, or N*m for twist) by
    the names of the free speeds (of mechanisms with mobility up to 200, of the independent speeds).
    `unstable_speeds` are those of these speeds with which a disturbed state departs, where efforts
    have a potential (a saddle or a maximum).  Arrays computed from this one have neither, and no
    findings.
    """

    residuals: dict[str, float]
    unstable_speeds: tuple[str, ...]

    def __array_finalize__(self, source: object) -> None:
        self.residuals, self.unstable_speeds, self.findings = {}, (), ()


def equilibrium(
    model: CompiledScene,
    q: Array,
    t: float,
    tolerance: float,
    max_steps: int = MAX_STEPS,
    progress: Progress | None = None,
) -> Equilibrium:
    """Static equilibrium near q; see `Model.equilibrium`."""
    start, name = q, model.coordinate_layout.u_name
    if model.independent_speeds is not None:
        start = q = SceneSystem(model.looped).start(t, q, np.zeros(model.nu))[: model.nq]
    search = EquilibriumSearch(model, t)
    try:
        rest, stability = search.find(q, tolerance, max_steps, progress)
    except UndeterminedEquilibriumError as failure:
        raise _undetermined_error(
            [name(failure.problem.coordinate_indices[k]) for k in failure.coordinate_indices]
        ) from None
    except NumericalFailure as failure:
        unbalanced = search.find_unbalanced(q)
        if unbalanced is not None:
            raise _unbalanced_error(model, q, *unbalanced) from None
        if not isinstance(failure, EquilibriumNotFoundError):
            raise
        efforts = _list_largest_efforts(model, failure)
        raise NumericalFailure(
            f"no equilibrium found near the start ({failure}); remaining efforts: {efforts}; give "
            "another start, q = ..., or allow more steps, max_steps = ..."
        ) from None
    spins = _free_spins(model, rest, t, stability.neutral)
    driven = SceneSystem(model.looped).start(t, rest, np.zeros(model.nu))[: model.nq]
    rest = remove_full_turns(model, start, driven, t)
    result = rest.view(Equilibrium)
    result.residuals = search.residuals(rest)
    result.unstable_speeds = _moving_speeds(model, rest, stability.unstable)
    result.findings = DeferredRisks(lambda: _find_risks(model, t, result, spins))
    return result


def _find_risks(
    model: CompiledScene, t: float, found: Equilibrium, spins: tuple[str, ...]
) -> Iterator[Risk]:
    """Findings about an equilibrium: risks of the state, instability, and free spins."""
    yield from find_state_risks(model, t, np.asarray(found), np.zeros(model.nu))
    if found.unstable_speeds:
        names = abbreviate_names(found.unstable_speeds)
        yield Risk(
            "unstable", names, f"unstable: a disturbance grows along {names}",
            "give another start, q=..., for a stable equilibrium", invalidates=False,
        )  # fmt: skip
    if spins:
        names = abbreviate_names(spins)
        yield Risk(
            "free-spin", names,
            f"bodies may spin about axes through their mass centre and all their ends: {names} "
            "have no restoring load, and nothing else depends on them",
            "no action is needed; a universal hinge instead of a ball hinge removes the spin",
            invalidates=False,
        )  # fmt: skip


def _undetermined_error(names: list[str]) -> NumericalFailure:
    return NumericalFailure(
        f"the equilibrium is undetermined along {abbreviate_names(names)}: these coordinates have "
        "no restoring load; fix them, drive them or add a stiffness"
    )


def _unbalanced_error(
    model: CompiledScene, q: Array, motion: Array, loads: Array, states: int
) -> NumericalFailure:
    """Error for loads (nu,) that do constant work along a motion (nu,)."""
    work = np.abs(motion * loads)
    order = np.argsort(-work, kind="stable")
    concerned = [int(j) for j in order if work[j] > _MOVING_SHARE * work.max()]
    named = [f"{loads[j]:.3g} along {model.coordinate_layout.u_name(j)}" for j in concerned]
    moving = abbreviate_names(_moving_speeds(model, q, [motion]))
    return NumericalFailure(
        f"no equilibrium exists: unbalanced load of {abbreviate_names(named)} (N or N*m); it does "
        f"the same work along {moving} at all {states} states examined; add a stiffness or a drive "
        "there, remove the load, or linearise about a given state, q = ..."
    )


def _moving_speeds(model: CompiledScene, q: Array, motions: list[Array]) -> tuple[str, ...]:
    """Names of the speeds that at least one of the motions, (nu,) each, moves noticeably at q.

    Of the independent speeds alone for mechanisms that are not too large.
    """
    moving, sizes = np.zeros(model.nu, dtype=bool), speed_scales(model)
    places = np.arange(model.nu)
    if (
        motions
        and model.loop_start is not None
        and model.loop_start.loops.mobility <= MAX_INDEPENDENT
    ):
        assert model.independent_speeds is not None
        places = np.array(model.independent_speeds.select(q))
    for motion in motions:
        far = np.abs(motion / sizes)[places]
        moving[places] |= far > _MOVING_SHARE * far.max(initial=0.0)
    return tuple(model.coordinate_layout.u_name(int(j)) for j in np.flatnonzero(moving))


def _free_spins(model: CompiledScene, q: Array, t: float, motions: list[Array]) -> tuple[str, ...]:
    """Names of the speeds of neutral motions (nu,) in which bodies only spin.

    No end or mass centre moves then; raises NumericalFailure for any other neutral motion.
    """
    engine, packed, count = model.looped, model.packed_scene, len(motions)
    if not motions:
        return ()
    probes = [
        Probe(packed.positions[name], _AXES, point)
        for name, body in model.scene.bodies.by_name.items()
        if packed.positions.get(name, -1) >= 0
        for point in _body_points(model, name, body)
    ]
    states = np.tile(q, (count, 1)), np.array(motions), np.tile(engine.start_memory(), (count, 1))
    motions_of_points = engine.observe(np.full(count, t), *states, probes, ("points",)).points
    angular_speeds = np.linalg.norm(motions_of_points[:, :, 9:12], axis=2).max(axis=1, initial=0.0)
    speeds = np.linalg.norm(motions_of_points[:, :, 3:6], axis=2).max(axis=1, initial=0.0)
    others = np.flatnonzero(~(speeds <= _MAX_SPIN_MOTION * angular_speeds * scene_length(model)))
    if len(others):
        raise _undetermined_error(list(_moving_speeds(model, q, [motions[k] for k in others])))
    return _moving_speeds(model, q, motions)


def _body_points(model: CompiledScene, name: str, body: Any) -> Iterator[tuple[float, ...]]:
    """Inboard hinge, mass centre and ends of a body, internal axes, m."""
    yield 0.0, 0.0, 0.0
    packed = model.packed_scene
    if hasattr(body, "center_of_mass"):
        yield packed.mass_center(name)
    for end in body.ends:
        yield packed.end(f"{name}.{end}")[2]


def _list_largest_efforts(model: CompiledScene, failure: EquilibriumNotFoundError) -> str:
    """Text of the largest efforts by name, ranked by work over a characteristic motion."""
    problem, residual = failure.problem, failure.residual
    places = range(model.nu) if problem is None else problem.coordinate_indices
    sizes = speed_scales(model)[list(places)]
    order = np.argsort(-np.abs(residual * sizes))[:_MAX_LISTED]
    names = [model.coordinate_layout.u_name(places[k]) for k in order]
    listed = [f"{residual[k]:.3g} along {name}" for k, name in zip(order, names, strict=True)]
    others = len(residual) - len(listed)
    return ", ".join(listed) + " (N or N*m)" + (f" and {others} smaller" if others > 0 else "")


# --- removal of full turns that have no effect ----------------------------------------------------

_TURN = 2 * np.pi
#: Relative change due to rounding when a full turn without effect is removed.
_TOLERANCE = 1e-9


def remove_full_turns(model: CompiledScene, start: Array, q: Array, t: float) -> Array:
    """q (nq,) with hinge angles within half a turn of the `start` (nq,), without effect.

    A full turn is removed only if all bodies keep their poses, all efforts their values, and no
    expression, output or controller of the scene reads the angle.
    """
    for place in _wound_coordinates(model, start, q):
        unwound = q.copy()
        unwound[place] -= _TURN * round((q[place] - start[place]) / _TURN)
        if _has_same_effect(model, q, unwound, t):
            q = unwound
    return q


def _wound_coordinates(model: CompiledScene, start: Array, q: Array) -> Iterator[int]:
    """Indices in q of angles more than half a turn from the start that nothing reads by name."""
    free, referenced = set(model.free_speed_indices), None
    for name, slots in model.coordinate_layout.hinges.items():
        if not slots.nu or not slots.rates_are_speeds:
            continue
        for k, unit in enumerate(slots.u_units):
            index = slots.q + k
            is_wound = abs(q[index] - start[index]) > _TURN / 2
            if not is_wound or unit != "rad/s" or slots.u + k not in free:
                continue
            referenced = _referenced_hinges(model) if referenced is None else referenced
            if name not in referenced:
                yield index


def _referenced_hinges(model: CompiledScene) -> set[str]:
    """Names of hinges whose coordinates an expression, output or controller reads."""
    scene, names_read = model.scene, set[str]()
    for active in active_expressions(scene):
        names_read |= {name.text.rpartition(".")[0] for name in active.expression.names}
        names_read |= {scene.hinges[number].name for number in active.hinges}
    texts = [repr(x) for x in (*scene.output, *scene.controller, *scene.coupling)]
    names = model.coordinate_layout.hinges
    return names_read | {name for name in names if any(f"{name}." in text for text in texts)}


def _has_same_effect(model: CompiledScene, q: Array, unwound: Array, t: float) -> bool:
    engine, zeros = model.looped, np.zeros(model.nu)
    memory = engine.start_memory()
    probes = [Probe(i, _AXES, (0.0, 0.0, 0.0)) for i in range(engine.packed.topology.count)]
    observed = []
    for state in (q, unwound):
        try:
            state = SceneSystem(engine).start(t, state, zeros)[: model.nq]
            efforts = engine.inverse_dynamics(t, state, zeros, zeros, memory)
        except MstmmError:
            return False
        points = engine.observe(np.array([t]), state[None], zeros[None], memory[None], probes,
                               ("points",)).points  # fmt: skip
        observed.append((efforts, points[0, :, :3], points[0, :, 15:24], state))
    correction = np.abs(observed[1][3] - unwound).max(initial=0.0)
    return bool(correction <= _TOLERANCE) and all(
        np.abs(a - b).max(initial=0.0) <= _TOLERANCE * max(1.0, float(np.abs(a).max(initial=0.0)))
        for a, b in zip(observed[0][:3], observed[1][:3], strict=True)
    )


# --- whether an equilibrium lasts while drives move and loads change ------------------------------


def with_persistence_findings(
    model: CompiledScene, equilibrium: Equilibrium, t: float, linearise: Callable[[], Linear]
) -> Equilibrium:
    """Equilibrium at t (s), with a finding if it does not last.

    `linearise` returns the linear model about it.  Raises NumericalFailure if moving drives do not
    keep it at rest.
    """
    if model.packed_scene.system.is_autonomous or not len(equilibrium.residuals):
        return equilibrium
    earlier = equilibrium.findings
    if not _drives_move(model, equilibrium, t):
        equilibrium.findings = DeferredRisks(lambda: (*earlier, *_risks(t, linearise)))
        return equilibrium
    risks = tuple(_risks(t, linearise))
    for risk in risks:
        if risk.invalidates:
            raise NumericalFailure(
                f"no equilibrium: {risk.description}; simulate the motion, or stop the drives"
            )
    equilibrium.findings = (*earlier, *risks)
    return equilibrium


def _drives_move(model: CompiledScene, equilibrium: Equilibrium, t: float) -> bool:
    """Whether any drive has a speed or an acceleration at t (s)."""
    system, engine = model.packed_scene.system, model.looped
    y = SceneSystem(engine).start(t, np.asarray(equilibrium), np.zeros(model.nu))
    q, u = y[None, : model.nq].copy(), y[None, model.nq : model.nq + model.nu].copy()
    _, a = engine.accelerations(t, q, u, engine.start_memory()[None])
    first = system.first_indices["u"]
    driven = [int(first[place]) + k for place, k in system.driven]
    return bool(u[0, driven].any() or a[0, driven].any())


def _risks(t: float, linearise: Callable[[], Linear]) -> Iterator[Risk]:
    """Risk of a departure from the equilibrium, now or later."""
    try:
        linear = linearise()
        later = LaterStates(linear)
        departure = find_departure(linear, later)
    except (SceneError, NumericalFailure) as failure:
        yield information(
            "unexamined", "the state", f"not examined whether it lasts: {failure}",
            "simulate from this state",
        )  # fmt: skip
        return
    if departure is not None:
        yield departure_risk(t, departure, later.cause)
