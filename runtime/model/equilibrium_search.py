"""The way of a model to static equilibrium: by sweeps, or by a stiffness matrix of differences."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure, SceneError

from ..engine.characteristic_scales import scene_length, speed_scales, total_mass
from ..engine.looped_engine import LoopedEngine
from ..engine.loops.independent_speeds import IndependentSpeeds
from ..engine.loops.loop_calls import LoopCalls
from ..engine.statics.rest import Rest, Unsettled, approached, unstable_coordinates
from ..engine.statics.rest_by_sweep import RestBySweep
from ..engine.statics.shifted_stiffness import ShiftedStiffness
from ..engine.statics.stability import Stability, find_stability
from ..engine.statics.unbalanced import FARTHEST, find_unbalanced_motion
from ..engine.tangent_matrix import TangentMatrix
from ..packing.loops.system_variants import with_rotors
from ..packing.scene_packing import packed_system
from ..run.scene_system import SceneSystem
from ..run.static_start.closed_states import ClosedStates

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene

#: Free speeds of trees, and of mechanisms, up to which a stiffness matrix by differences is made
#: where the sweep finds no rest.
_DENSE, _DENSE_LOOPS = 20, 6
#: Of mechanisms with more speeds left than these, those that decide all others are not looked for.
DECIDING = 200
#: Efforts along motions of loops that are rounding, in parts of the work of all that cancel.
_CANCELLED = 1e-14
#: Steps beside light rotors before heavy ones are tried.
_PATIENCE = 100
#: How often a saddle is left, and how far, in sizes of the coordinates.
_LEFT, _ASIDE = 20, 0.05
#: How far beside a singular state work is looked at, in sizes, how many times further loops may
#: lead, and along how many motions drawn.
_NEAR, _FAR, _BESIDE = 0.02, 10.0, 6

#: How far states of closed loops are at which loads are compared, in sizes.
_FARTHEST_OF_LOOPS = 5.0

#: Called with the number of every step and how long it is, in sizes of the coordinates.
Progress = Callable[[int, float], None]


class _Sweeps:
    """Searches beside rotors of one weight, in parts of the scene's, on all hinges."""

    def __init__(self, model: CompiledScene, t: float, weight: float) -> None:
        engine = _with_rotors(model, weight)
        self._scene = SceneSystem(engine, with_power=False)  # lays out tapes that need room
        self.stiffness = ShiftedStiffness(TangentMatrix(engine), t, speed_scales(model))
        gravity = float(np.linalg.norm(model.scene.gravity))
        self._load = total_mass(model) * gravity * scene_length(model)

    def find(
        self, q: Array, tolerance: float, max_steps: int, progress: Progress | None
    ) -> tuple[Array, bool]:
        """q at rest, and whether any steps led there."""
        sweep = RestBySweep(self.stiffness, self.settled, self._load, max_steps, progress)
        return sweep.find(q, tolerance), sweep.steps > 0

    def settled(self, q: Array) -> Array:
        """The state nearby with drives, quaternions and loops in order."""
        try:
            return self._scene.start(self.stiffness.t, q, self.stiffness.still)[: len(q)]
        except SceneError as error:
            raise NumericalFailure(str(error)) from None


class EquilibriumSearch:
    """The way of one model to rest at time t: by sweeps, and of few coordinates, where those find
    none, by a stiffness matrix of differences and with the load in parts."""

    def __init__(self, model: CompiledScene, t: float) -> None:
        self._model, self._t = model, t
        few = len(model.free_speeds) if model.closed is None else model.closed.loops.mobility
        self._is_driven = few == 0  # drives and loops alone say where everything is
        self._is_decided = few <= DECIDING
        self._is_small = few <= (_DENSE if model.freedom is None else _DENSE_LOOPS)
        self._sweeps: _Sweeps | None = None
        try:
            self._sweeps = _Sweeps(model, t, 1.0)
        except SceneError:  # elements of before there were derivatives
            if not self._is_small:
                raise
        self._by_differences: Rest | None = None

    def find(
        self, q: Array, tolerance: float, max_steps: int, progress: Progress | None
    ) -> tuple[Array, Stability]:
        """q at rest, and its stability; saddles that were found on the way are left again."""
        if self._is_driven:
            return q, Stability()
        if self._sweeps is None:
            return self._find_by_differences(q, tolerance)
        asked = tolerance, max_steps, _counted(progress)
        try:
            found, moved = self._swept(self._sweeps, q, *asked)
        except NumericalFailure as failure:
            if not self._is_small or self.find_unbalanced(q) is not None:
                raise
            try:
                return self._find_by_differences(q, tolerance)
            except NumericalFailure:
                raise failure from None
        stability = find_stability(self._sweeps.stiffness, found)
        for _ in range(_LEFT if moved else 0):
            if not stability.unstable:
                break
            beside = self._beside(self._sweeps.stiffness, found, stability.unstable)
            try:
                found, _ = self._swept(self._sweeps, beside, *asked)
            except NumericalFailure:
                break
            stability = find_stability(self._sweeps.stiffness, found)
        if stability.unstable and self._holds_singular(self._sweeps, found, stability.unstable):
            stability = Stability([], stability.neutral)
        return found, stability

    def _holds_singular(self, sweeps: _Sweeps, q: Array, motions: list[Array]) -> bool:
        """Whether states beside q, along motions (nu,) of negative stiffness, all take work where
        loops have more motions than elsewhere: loads that loops take, and with them the stiffness,
        are not determined there."""
        model, freedom, stiffness = self._model, self._model.freedom, sweeps.stiffness
        straight = _straight_places(model, list(range(model.nu)))
        if freedom is None or model.closed is None or straight is None or not self._is_decided:
            return False
        if len(freedom.chosen(q)) <= model.closed.loops.mobility:
            return False
        parts = np.random.default_rng(0).uniform(-1.0, 1.0, (_BESIDE, len(motions)))
        held, ways = list[bool](), [*motions, *(parts @ np.array(motions))]
        for way in [*ways, *(-one for one in ways)]:
            efforts = stiffness.residual(q)
            step = stiffness.tangent.coordinates(_NEAR / stiffness.length(way) * way)
            try:
                beside = sweeps.settled(q + step)
            except NumericalFailure:
                continue
            gone = (beside - q)[straight]
            if stiffness.length(gone) < _FAR * _NEAR:
                held.append(float((efforts + stiffness.residual(beside)) @ gone) > 0)
        stiffness.residual(q)
        return bool(held) and all(held)

    def _swept(
        self, light: _Sweeps, q: Array, tolerance: float, max_steps: int, progress: Progress | None
    ) -> tuple[Array, bool]:
        """q at rest, and whether any steps led there: of many coordinates, where that takes long,
        beside heavy rotors first."""
        model, first = self._model, max_steps if self._is_small else min(max_steps, _PATIENCE)
        try:
            return light.find(q, tolerance, first, progress)
        except Unsettled:
            if first == max_steps:
                raise
        left = max_steps - first
        try:
            heavy = _Sweeps(model, self._t, float(len(model.free_speeds)))
            near, _ = heavy.find(q, tolerance, left, progress)
            return light.find(near, tolerance, left, progress)[0], True
        except NumericalFailure:
            pass
        try:
            return light.find(q, tolerance, left, progress)
        except Unsettled as failure:
            raise Unsettled(f"not at rest after {max_steps} steps", failure.residual) from None

    @staticmethod
    def _beside(stiffness: ShiftedStiffness, q: Array, motions: list[Array]) -> Array:
        """q a little way along all of some motions (nu,)."""
        aside = np.zeros_like(motions[0])
        for one in motions:
            aside += one / one[np.abs(one / stiffness.sizes).argmax()]
        step = _ASIDE / stiffness.length(aside) * aside
        return np.asarray(q + stiffness.tangent.rates(q, step))

    def _find_by_differences(self, q: Array, tolerance: float) -> tuple[Array, Stability]:
        model = self._model
        if model.freedom is not None:
            problem = _of_mechanism(model, model.freedom, q, self._t)
        else:
            problem = _problem(model, self._t, list(model.free_speeds))
        found = approached(problem, q, tolerance)
        self._by_differences = problem = problem.at(found)
        units = np.eye(model.nu)
        return found, Stability(
            [units[problem.places[k]] for k in unstable_coordinates(problem, found)]
        )

    def find_unbalanced(self, q: Array) -> tuple[Array, Array, int] | None:
        """A motion (nu,) along which loads do the same work at every state drawn, the loads (nu,)
        at q, and the number of states; None where there is no such motion."""
        model, freedom = self._model, self._model.freedom
        if self._is_driven or not self._is_decided:
            return None
        still = np.zeros(model.nu)
        try:
            if freedom is None:
                problem = _problem(model, self._t, list(model.free_speeds))
            else:
                problem = _of_mechanism(model, freedom, q, self._t)
            problem = replace(problem, needed=self._with_axes(problem))
            farthest = FARTHEST if freedom is None else _FARTHEST_OF_LOOPS
            found = find_unbalanced_motion(problem, q, farthest)
            if found is None:
                return None
            motion = still.copy()
            motion[list(problem.places)] = found[0]
            for places, axes in self._axes_of_free_hinges(q):
                motion[places] = axes.T @ motion[places]
            if freedom is not None:
                motion = freedom.following(q, problem.places) @ found[0]
        except (NumericalFailure, SceneError):
            return None
        engine = model.looped
        efforts = engine.inverse_dynamics(self._t, q, still, still, engine.start_memory())
        return motion, -np.asarray(efforts), found[1]

    def _with_axes(self, problem: Rest) -> Callable[[Array], Array]:
        """Efforts of a problem with forces on free hinges in the axes of their inboard sides."""

        def needed(q: Array) -> Array:
            efforts = np.zeros(self._model.nu)
            efforts[list(problem.places)] = problem.needed(q)
            for places, axes in self._axes_of_free_hinges(q):
                efforts[places] = axes @ efforts[places]
            return efforts[list(problem.places)]

        return needed

    def _axes_of_free_hinges(self, q: Array) -> Iterator[tuple[NDArray[np.int64], Array]]:
        """Of each free hinge of a tree the places of its velocity and its axes (3, 3) at q."""
        model, engine, units = self._model, self._model.looped, np.eye(self._model.nu)
        for slots in model.layout.hinges.values() if model.freedom is None else ():
            places = np.arange(slots.nu)[:3] + slots.u_slice.start
            if slots.nu == 6 and not slots.straight and {*places} <= {*model.free_speeds}:
                rates = [engine.rates(self._t, q, units[j], engine.start_memory()) for j in places]
                yield places, np.array(rates)[:, slots.q : slots.q + 3].T

    def residuals(self, q: Array) -> dict[str, float]:
        """Efforts that are missing at a rest, by the names of speeds."""
        model, freedom = self._model, self._model.freedom
        if self._is_driven:
            return {}
        if self._sweeps is None or self._by_differences is not None:
            assert self._by_differences is not None
            places, efforts = self._by_differences.places, self._by_differences.needed(q)
            return {model.layout.u_name(j): float(x) for j, x in zip(places, efforts, strict=True)}
        stiffness = self._sweeps.stiffness
        if freedom is None or not self._is_decided:
            own, missing = set(stiffness.own.tolist()), stiffness.residual(q)
            places = tuple(j for j in model.free_speeds if j not in own)
            efforts = missing[list(places)]
        else:
            places = freedom.chosen(q)
            efforts = freedom.following(q, places).T @ stiffness.residual(q)
        return {model.layout.u_name(j): float(x) for j, x in zip(places, efforts, strict=True)}


def _counted(progress: Progress | None) -> Progress | None:
    """The same with steps counted over several searches."""
    steps = itertools.count()
    return None if progress is None else lambda _, length: progress(next(steps), length)


def _with_rotors(model: CompiledScene, weight: float) -> LoopedEngine:
    """The engine of the model with rotors on all hinges, as heavy as so many scenes."""
    packed = model.packed
    rotors = weight * (total_mass(model) or 1.0) * (scene_length(model) / speed_scales(model)) ** 2
    engine = LoopedEngine(packed_system(with_rotors(packed.system, rotors.tolist()), packed))
    if model.closed is not None:
        LoopCalls(engine, model.closed.start[0])  # judges its rows
    return engine


def _problem(model: CompiledScene, t: float, free: list[int]) -> Rest:
    engine, still = model.looped, np.zeros(model.nu)
    memory, quaternions = engine.start_memory(), model.layout.quaternions
    straight = _straight_places(model, free)

    def needed(q: Array) -> Array:
        return np.asarray(engine.inverse_dynamics(t, q, still, still, memory)[free])

    def moved(q: Array, increment: Array) -> Array:
        if straight is not None:
            result = q.copy()
            result[straight] += increment
            return result
        speeds = np.zeros(model.nu)
        speeds[free] = increment
        result = q + engine.rates(t, q, speeds, memory)
        for first in quaternions:
            unit = result[first : first + 4]
            result[first : first + 4] = unit / np.linalg.norm(unit)
        return np.asarray(result)

    return Rest(needed, moved, speed_scales(model)[free], tuple(free))


def _of_mechanism(model: CompiledScene, freedom: IndependentSpeeds, q: Array, t: float) -> Rest:
    """The way of a closed q to rest along the independent speeds there: what the tree needs along
    the motions that the loops leave, which the loads of loops do not see."""
    engine, still, closed = model.looped, np.zeros(model.nu), ClosedStates(model, freedom, t)

    def along(places: tuple[int, ...]) -> Rest:
        sizes = closed.sizes[list(places)]

        def needed(q: Array) -> Array:
            efforts = engine.inverse_dynamics(t, q, still, still, closed.memory)
            found = np.asarray(freedom.following(q, places).T @ efforts)
            # What nothing pushes must not go by rounding of what cancels.
            whole = float(np.abs(efforts) @ freedom.sizes)
            return np.where(np.abs(found) * sizes > _CANCELLED * whole, found, 0.0)

        def moved(q: Array, increment: Array) -> Array:
            return closed.moved(q, places, increment)

        problem = Rest(needed, moved, sizes, places, lambda q: there(places, problem, q))
        return problem

    def there(places: tuple[int, ...], problem: Rest, q: Array) -> Rest:
        chosen = freedom.chosen(q)
        return problem if chosen == places else along(chosen)

    return along(freedom.chosen(q))


def _straight_places(model: CompiledScene, free: list[int]) -> NDArray[np.int64] | None:
    """Places in q whose rates are the free speeds; None where a hinge has others."""
    places = np.zeros(model.nu, dtype=np.int64)
    for slots in model.layout.hinges.values():
        if slots.nu and not slots.straight:
            return None
        places[slots.u_slice] = np.arange(slots.q, slots.q + slots.nq)
    for slots in model.layout.modal.values():
        places[slots.u_slice] = np.arange(slots.q, slots.q + slots.nq)
    return np.asarray(places[free])
