"""Static equilibrium of a model: no effort needed at rest in the free coordinates."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure
from mstmm.risk import AssessedAnswer, DeferredRisks, Risk
from mstmm.safe_text import abbreviate_names

from ..engine.characteristic_scales import scene_length, speed_scales
from ..engine.engine_calls import Probe
from ..engine.statics.rest import Undetermined, Unsettled
from ..engine.statics.rest_by_sweep import MAX_STEPS
from ..risk_checks.answers import find_state_risks
from ..run.scene_system import SceneSystem
from .equilibrium_search import DECIDING, EquilibriumSearch, Progress
from .full_turns import without_turns

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene


#: Coordinates that a message lists.
_LISTED = 3
#: A coordinate moves where it moves this part of what moves most.
_MOVES = 0.1
#: Motions of points of a body that only spins, in parts of what its angular velocity would move:
#: so well motions without stiffness are known where they are many.
_STILL = 5e-2

_AXES = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)


class Equilibrium(AssessedAnswer, np.ndarray[Any, np.dtype[np.float64]]):
    """q (nq,) of an equilibrium, an array like any other, and how far it can be trusted.

    `residuals` are the efforts in N or N*m (of modal coordinates N, or N*m for twist) still missing
    there, by the names of the free speeds (of mechanisms of up to 200 degrees of freedom of those
    that decide all others), and `unstable` those of these speeds with which it is
    left once it is disturbed, where efforts have a potential (a saddle, or the top of a hill);
    arrays computed from this one have neither, and no findings.
    """

    residuals: dict[str, float]
    unstable: tuple[str, ...]

    def __array_finalize__(self, source: object) -> None:
        self.residuals, self.unstable, self.findings = {}, (), ()


def equilibrium(
    model: CompiledScene,
    q: Array,
    t: float,
    tolerance: float,
    max_steps: int = MAX_STEPS,
    progress: Progress | None = None,
) -> Equilibrium:
    """q at which the free coordinates need no effort at rest; see `Model.equilibrium`."""
    begun, name = q, model.layout.u_name
    if model.freedom is not None:
        begun = q = SceneSystem(model.looped).start(t, q, np.zeros(model.nu))[: model.nq]
    search = EquilibriumSearch(model, t)
    try:
        found, stability = search.find(q, tolerance, max_steps, progress)
    except Undetermined as failure:
        raise _undetermined([name(failure.problem.places[k]) for k in failure.places]) from None
    except NumericalFailure as failure:
        unbalanced = search.find_unbalanced(q)
        if unbalanced is not None:
            raise _unbalanced(model, q, *unbalanced) from None
        if not isinstance(failure, Unsettled):
            raise
        efforts = _largest(model, failure)
        raise NumericalFailure(
            f"no equilibrium found near the start ({failure}); efforts left: {efforts}; give "
            "another start, q = ..., or allow more steps, max_steps = ..."
        ) from None
    spins = _spins(model, found, t, stability.neutral)
    found = without_turns(model, begun, _with_drives(model, found, t), t)
    result = found.view(Equilibrium)
    result.residuals = search.residuals(found)
    result.unstable = _moving(model, found, stability.unstable)
    result.findings = DeferredRisks(lambda: _find_risks(model, t, result, spins))
    return result


def _find_risks(
    model: CompiledScene, t: float, found: Equilibrium, spins: tuple[str, ...]
) -> Iterator[Risk]:
    """Risks of the state, coordinates with which it is left once it is disturbed, and those of
    bodies that may spin."""
    yield from find_state_risks(model, t, np.asarray(found), np.zeros(model.nu))
    if found.unstable:
        names = abbreviate_names(found.unstable)
        yield Risk(
            "unstable", names, f"unstable: once disturbed the state is left along {names}",
            "take another start, q=..., if a stable equilibrium is meant", doubt=False,
        )  # fmt: skip
    if spins:
        names = abbreviate_names(spins)
        yield Risk(
            "free-spin", names,
            f"bodies may spin about axes through their mass centre and all their ends: nothing "
            f"pushes {names} back, and nothing else depends on them",
            "no action is needed; a universal hinge in place of a ball takes the spin away",
            doubt=False,
        )  # fmt: skip


def _undetermined(names: list[str]) -> NumericalFailure:
    return NumericalFailure(
        f"the equilibrium is undetermined along {abbreviate_names(names)}: nothing pushes these "
        "coordinates back; fix them, drive them or add a stiffness"
    )


def _unbalanced(
    model: CompiledScene, q: Array, motion: Array, loads: Array, states: int
) -> NumericalFailure:
    """The error for loads (nu,) that do work along a motion (nu,) which nothing resists."""
    work = np.abs(motion * loads)
    order = np.argsort(-work, kind="stable")
    concerned = [int(j) for j in order if work[j] > _MOVES * work.max()]
    named = [f"{loads[j]:.3g} along {model.layout.u_name(j)}" for j in concerned]
    moving = abbreviate_names(_moving(model, q, [motion]))
    return NumericalFailure(
        f"no equilibrium exists: unbalanced load of {abbreviate_names(named)} (N or N*m); it does "
        f"the "
        f"same work along {moving} at all {states} states examined; add a stiffness or a drive "
        "there, remove the load, or linearise about a given state, q = ..."
    )


def _moving(model: CompiledScene, q: Array, motions: list[Array]) -> tuple[str, ...]:
    """Names of the speeds that move in some motions (nu,) at q; of mechanisms, unless they are
    large, of those that decide all others."""
    moving, sizes = np.zeros(model.nu, dtype=bool), speed_scales(model)
    places = np.arange(model.nu)
    if motions and model.closed is not None and model.closed.loops.mobility <= DECIDING:
        assert model.freedom is not None
        places = np.array(model.freedom.chosen(q))
    for motion in motions:
        far = np.abs(motion / sizes)[places]
        moving[places] |= far > _MOVES * far.max(initial=0.0)
    return tuple(model.layout.u_name(int(j)) for j in np.flatnonzero(moving))


def _spins(model: CompiledScene, q: Array, t: float, motions: list[Array]) -> tuple[str, ...]:
    """Names of the speeds of motions (nu,) that nothing pushes, in which bodies spin and none of
    their ends or mass centres moves; a NumericalFailure for any other motion."""
    engine, packed, count = model.looped, model.packed, len(motions)
    if not motions:
        return ()
    probes = [
        Probe(packed.positions[name], _AXES, point)
        for name, body in model.scene.bodies.by_name.items()
        if packed.positions.get(name, -1) >= 0
        for point in _points(model, name, body)
    ]
    states = np.tile(q, (count, 1)), np.array(motions), np.tile(engine.start_memory(), (count, 1))
    shown = engine.observe(np.full(count, t), *states, probes, ("points",)).points
    turning = np.linalg.norm(shown[:, :, 9:12], axis=2).max(axis=1, initial=0.0)
    moving = np.linalg.norm(shown[:, :, 3:6], axis=2).max(axis=1, initial=0.0)
    elsewhere = np.flatnonzero(~(moving <= _STILL * turning * scene_length(model)))
    if len(elsewhere):
        raise _undetermined(list(_moving(model, q, [motions[k] for k in elsewhere])))
    return _moving(model, q, motions)


def _points(model: CompiledScene, name: str, body: Any) -> Iterator[tuple[float, ...]]:
    """The hinge, the mass centre and the ends of a body, internal axes."""
    yield 0.0, 0.0, 0.0
    packed = model.packed
    if hasattr(body, "center_of_mass"):
        yield packed.mass_center(name)
    for end in body.ends:
        yield packed.end(f"{name}.{end}")[2]


def _with_drives(model: CompiledScene, q: Array, t: float) -> Array:
    """q with driven coordinates where their drives have them."""
    return SceneSystem(model.looped).start(t, q, np.zeros(model.nu))[: model.nq]


def _largest(model: CompiledScene, failure: Unsettled) -> str:
    """The largest efforts by name, counted by their work over a motion of order one."""
    problem, residual = failure.problem, failure.residual
    places = range(model.nu) if problem is None else problem.places
    sizes = speed_scales(model)[list(places)]
    order = np.argsort(-np.abs(residual * sizes))[:_LISTED]
    names = [model.layout.u_name(places[k]) for k in order]
    listed = [f"{residual[k]:.3g} along {name}" for k, name in zip(order, names, strict=True)]
    more = len(residual) - len(listed)
    return ", ".join(listed) + " (N or N*m)" + (f" and {more} smaller" if more > 0 else "")
