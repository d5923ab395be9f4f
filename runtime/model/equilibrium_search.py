"""Search for static equilibrium: by Riccati sweeps, or by a finite-difference stiffness."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure, SceneError

from ..engine.compiled_scene import scene_length, speed_scales, total_mass
from ..engine.looped_engine import LoopedEngine
from ..engine.loops.independent_speeds import IndependentSpeeds
from ..engine.loops.loop_calls import LoopCalls
from ..engine.pseudo_transient_equilibrium import (
    PseudoTransientEquilibrium,
    ShiftedStiffness,
    Stability,
    find_stability,
)
from ..engine.static_equilibrium import (
    FARTHEST,
    EquilibriumNotFoundError,
    EquilibriumProblem,
    find_equilibrium,
    find_unbalanced_motion,
    unstable_coordinates,
)
from ..engine.tangent_matrix import TangentMatrix
from ..packing.scene_packing import packed_system
from ..packing.system_variants import with_rotors
from ..run.scene_system import SceneSystem
from ..run.start_state import ClosedStates

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene

#: Largest number of free speeds of trees, and of mechanisms, for which a stiffness matrix by finite
#: differences is used if the sweep finds no equilibrium.
_MAX_DENSE, _MAX_DENSE_LOOPS = 20, 6
#: Largest mobility of a mechanism whose independent speeds are determined.
MAX_INDEPENDENT = 200
#: Efforts along motions of loops that are rounding, relative to the work of all that cancel.
_CANCELLATION = 1e-14
#: Number of steps with light rotors before heavy ones are tried.
_LIGHT_STEPS = 100
#: Largest number of saddles that are left, and the step off them, in characteristic scales.
_MAX_SADDLES, _SADDLE_STEP = 20, 0.05
#: Test step near a singular state, in characteristic scales, the largest growth of the step by
#: closing the loops, and the number of random directions.
_TEST_STEP, _MAX_STEP_GROWTH, _RANDOM_COUNT = 0.02, 10.0, 6

#: Distance of closed states at which loads are compared, in characteristic scales.
_FARTHEST_LOOP_STATE = 5.0

#: Called with the number and the length of every step, in characteristic scales.
Progress = Callable[[int, float], None]


class _SweepSearch:
    """Search by sweeps with rotors on all hinges, of a weight relative to the mass of the scene."""

    def __init__(self, model: CompiledScene, t: float, weight: float) -> None:
        packed, mass = model.packed_scene, total_mass(model)
        rotors = weight * (mass or 1.0) * (scene_length(model) / speed_scales(model)) ** 2
        engine = LoopedEngine(packed_system(with_rotors(packed.system, rotors.tolist()), packed))
        if model.loop_start is not None:
            LoopCalls(engine, model.loop_start.start[0])  # determines its redundant rows
        self._scene = SceneSystem(engine, with_power=False)  # allocates the tapes
        self.stiffness = ShiftedStiffness(TangentMatrix(engine), t, speed_scales(model))
        gravity = float(np.linalg.norm(model.scene.gravity))
        self._load = mass * gravity * scene_length(model)

    def find(
        self, q: Array, tolerance: float, max_steps: int, progress: Progress | None
    ) -> tuple[Array, bool]:
        """Equilibrium q, and whether any steps were needed."""
        sweep = PseudoTransientEquilibrium(
            self.stiffness, self.consistent_state, self._load, max_steps, progress
        )
        return sweep.find(q, tolerance), sweep.steps > 0

    def consistent_state(self, q: Array) -> Array:
        """Nearby state with consistent drives, quaternions and loops."""
        try:
            return self._scene.start(self.stiffness.t, q, self.stiffness.zero_speeds)[: len(q)]
        except SceneError as error:
            raise NumericalFailure(str(error)) from None


class EquilibriumSearch:
    """Search for the equilibrium of one model at time t (s).

    By sweeps; for few coordinates, if these fail, by a finite-difference stiffness and load steps.
    """

    def __init__(self, model: CompiledScene, t: float) -> None:
        self._model, self._t = model, t
        mobility = len(model.free_speed_indices)
        if model.loop_start is not None:
            mobility = model.loop_start.loops.mobility
        self._is_driven = mobility == 0  # drives and loops alone determine the state
        self._has_few_independent = mobility <= MAX_INDEPENDENT
        self._is_small = mobility <= (
            _MAX_DENSE if model.independent_speeds is None else _MAX_DENSE_LOOPS
        )
        self._light_search: _SweepSearch | None = None
        try:
            self._light_search = _SweepSearch(model, t, 1.0)
        except SceneError:  # old elements without derivatives
            if not self._is_small:
                raise
        self._difference_problem: EquilibriumProblem | None = None

    def find(
        self, q: Array, tolerance: float, max_steps: int, progress: Progress | None
    ) -> tuple[Array, Stability]:
        """Equilibrium q and its stability; saddles reached by steps are left again."""
        if self._is_driven:
            return q, Stability()
        if self._light_search is None:
            return self._find_by_differences(q, tolerance)
        limits = tolerance, max_steps, _count_steps(progress)
        try:
            rest, has_moved = self._find_by_sweeps(self._light_search, q, *limits)
        except NumericalFailure as failure:
            if not self._is_small or self.find_unbalanced(q) is not None:
                raise
            try:
                return self._find_by_differences(q, tolerance)
            except NumericalFailure:
                raise failure from None
        stability = find_stability(self._light_search.stiffness, rest)
        for _ in range(_MAX_SADDLES if has_moved else 0):
            if not stability.unstable:
                break
            start = self._step_off_saddle(self._light_search.stiffness, rest, stability.unstable)
            try:
                rest, _ = self._find_by_sweeps(self._light_search, start, *limits)
            except NumericalFailure:
                break
            stability = find_stability(self._light_search.stiffness, rest)
        if stability.unstable and self._resists_near_singularity(
            self._light_search, rest, stability.unstable
        ):
            stability = Stability([], stability.neutral)
        return rest, stability

    def _resists_near_singularity(
        self, search: _SweepSearch, q: Array, motions: list[Array]
    ) -> bool:
        """Whether all states near a singular q, along motions (nu,), need work to be reached.

        At a singular configuration the loop loads, and with them the stiffness, are indeterminate,
        so that a negative stiffness along `motions` proves no instability.
        """
        model, freedom, stiffness = self._model, self._model.independent_speeds, search.stiffness
        coordinates = _coordinates_of_speeds(model, list(range(model.nu)))
        if (
            freedom is None
            or model.loop_start is None
            or coordinates is None
            or not self._has_few_independent
        ):
            return False
        if len(freedom.select(q)) <= model.loop_start.loops.mobility:
            return False
        weights = np.random.default_rng(0).uniform(-1.0, 1.0, (_RANDOM_COUNT, len(motions)))
        resists, directions = list[bool](), [*motions, *(weights @ np.array(motions))]
        for direction in [*directions, *map(np.negative, directions)]:
            efforts = stiffness.residual(q)
            increment = _TEST_STEP / stiffness.length(direction) * direction
            step = stiffness.tangent.coordinates(increment)
            try:
                nearby = search.consistent_state(q + step)
            except NumericalFailure:
                continue
            change = (nearby - q)[coordinates]
            if stiffness.length(change) < _MAX_STEP_GROWTH * _TEST_STEP:
                resists.append(float((efforts + stiffness.residual(nearby)) @ change) > 0)
        stiffness.residual(q)
        return bool(resists) and all(resists)

    def _find_by_sweeps(
        self,
        light: _SweepSearch,
        q: Array,
        tolerance: float,
        max_steps: int,
        progress: Progress | None,
    ) -> tuple[Array, bool]:
        """Equilibrium q, and whether any steps were needed.

        With many coordinates a slow search is repeated with heavy rotors first.
        """
        model = self._model
        first_steps = max_steps if self._is_small else min(max_steps, _LIGHT_STEPS)
        try:
            return light.find(q, tolerance, first_steps, progress)
        except EquilibriumNotFoundError:
            if first_steps == max_steps:
                raise
        remaining = max_steps - first_steps
        try:
            heavy = _SweepSearch(model, self._t, float(len(model.free_speed_indices)))
            rest, _ = heavy.find(q, tolerance, remaining, progress)
            return light.find(rest, tolerance, remaining, progress)[0], True
        except NumericalFailure:
            pass
        try:
            return light.find(q, tolerance, remaining, progress)
        except EquilibriumNotFoundError as failure:
            raise EquilibriumNotFoundError(
                f"not converged after {max_steps} steps", failure.residual
            ) from None

    @staticmethod
    def _step_off_saddle(stiffness: ShiftedStiffness, q: Array, motions: list[Array]) -> Array:
        """q after a small step along the sum of some motions (nu,)."""
        direction = np.zeros_like(motions[0])
        for motion in motions:
            direction += motion / motion[np.abs(motion / stiffness.sizes).argmax()]
        step = _SADDLE_STEP / stiffness.length(direction) * direction
        return np.asarray(q + stiffness.tangent.rates(q, step))

    def _find_by_differences(self, q: Array, tolerance: float) -> tuple[Array, Stability]:
        model = self._model
        if model.independent_speeds is not None:
            problem = _mechanism_problem(model, model.independent_speeds, q, self._t)
        else:
            problem = _tree_problem(model, self._t, list(model.free_speed_indices))
        rest = find_equilibrium(problem, q, tolerance)
        self._difference_problem = problem = problem.at_state(rest)
        units = np.eye(model.nu)
        return rest, Stability(
            [units[problem.coordinate_indices[k]] for k in unstable_coordinates(problem, rest)]
        )

    def find_unbalanced(self, q: Array) -> tuple[Array, Array, int] | None:
        """Motion (nu,) along which loads do the same work at all random states, if there is one.

        Returns the motion, the loads (nu,) at q and the number of states; else None.
        """
        model, freedom = self._model, self._model.independent_speeds
        if self._is_driven or not self._has_few_independent:
            return None
        zeros = np.zeros(model.nu)
        try:
            if freedom is None:
                problem = _tree_problem(model, self._t, list(model.free_speed_indices))
            else:
                problem = _mechanism_problem(model, freedom, q, self._t)
            problem = replace(problem, required_efforts=self._efforts_in_inboard_axes(problem))
            farthest = FARTHEST if freedom is None else _FARTHEST_LOOP_STATE
            unbalanced = find_unbalanced_motion(problem, q, farthest)
            if unbalanced is None:
                return None
            motion = zeros.copy()
            motion[list(problem.coordinate_indices)] = unbalanced[0]
            for places, axes in self._axes_of_free_hinges(q):
                motion[places] = axes.T @ motion[places]
            if freedom is not None:
                motion = freedom.motion_matrix(q, problem.coordinate_indices) @ unbalanced[0]
        except (NumericalFailure, SceneError):
            return None
        engine = model.looped
        efforts = engine.inverse_dynamics(self._t, q, zeros, zeros, engine.start_memory())
        return motion, -np.asarray(efforts), unbalanced[1]

    def _efforts_in_inboard_axes(self, problem: EquilibriumProblem) -> Callable[[Array], Array]:
        """Function of the efforts, with forces on free hinges in the axes of their inboard ends."""

        def required_efforts(q: Array) -> Array:
            efforts = np.zeros(self._model.nu)
            efforts[list(problem.coordinate_indices)] = problem.required_efforts(q)
            for places, axes in self._axes_of_free_hinges(q):
                efforts[places] = axes @ efforts[places]
            return efforts[list(problem.coordinate_indices)]

        return required_efforts

    def _axes_of_free_hinges(self, q: Array) -> Iterator[tuple[NDArray[np.int64], Array]]:
        """Indices of the velocity, and axes (3, 3) at q, of each free hinge of a tree."""
        model, engine, units = self._model, self._model.looped, np.eye(self._model.nu)
        for slots in (
            model.coordinate_layout.hinges.values() if model.independent_speeds is None else ()
        ):
            places = np.arange(slots.nu)[:3] + slots.u_slice.start
            if (
                slots.nu == 6
                and not slots.rates_are_speeds
                and {*places} <= {*model.free_speed_indices}
            ):
                rates = [engine.rates(self._t, q, units[j], engine.start_memory()) for j in places]
                yield places, np.array(rates)[:, slots.q : slots.q + 3].T

    def residuals(self, q: Array) -> dict[str, float]:
        """Remaining efforts at an equilibrium by the names of speeds."""
        model, freedom = self._model, self._model.independent_speeds
        if self._is_driven:
            return {}
        if self._light_search is None or self._difference_problem is not None:
            assert self._difference_problem is not None
            places = self._difference_problem.coordinate_indices
            efforts = self._difference_problem.required_efforts(q)
        elif freedom is None or not self._has_few_independent:
            stiffness = self._light_search.stiffness
            cut_speeds, missing = set(stiffness.closing_speeds.tolist()), stiffness.residual(q)
            places = tuple(j for j in model.free_speed_indices if j not in cut_speeds)
            efforts = missing[list(places)]
        else:
            places = freedom.select(q)
            residual = self._light_search.stiffness.residual(q)
            efforts = freedom.motion_matrix(q, places).T @ residual
        return {
            model.coordinate_layout.u_name(j): float(x)
            for j, x in zip(places, efforts, strict=True)
        }


def _count_steps(progress: Progress | None) -> Progress | None:
    """Progress callback that counts steps over several searches."""
    steps = itertools.count()
    return None if progress is None else lambda _, length: progress(next(steps), length)


def _tree_problem(model: CompiledScene, t: float, free: list[int]) -> EquilibriumProblem:
    engine, zeros = model.looped, np.zeros(model.nu)
    memory, quaternions = engine.start_memory(), model.coordinate_layout.quaternions
    coordinates = _coordinates_of_speeds(model, free)

    def required_efforts(q: Array) -> Array:
        return np.asarray(engine.inverse_dynamics(t, q, zeros, zeros, memory)[free])

    def move(q: Array, increment: Array) -> Array:
        if coordinates is not None:
            result = q.copy()
            result[coordinates] += increment
            return result
        speeds = np.zeros(model.nu)
        speeds[free] = increment
        result = q + engine.rates(t, q, speeds, memory)
        for first in quaternions:
            unit = result[first : first + 4]
            result[first : first + 4] = unit / np.linalg.norm(unit)
        return np.asarray(result)

    return EquilibriumProblem(required_efforts, move, speed_scales(model)[free], tuple(free))


def _mechanism_problem(
    model: CompiledScene, freedom: IndependentSpeeds, q: Array, t: float
) -> EquilibriumProblem:
    """Equilibrium problem of a mechanism in its independent speeds at a closed q.

    The efforts are those of the tree along the free motions of the loops; constraint loads do no
    work along these.
    """
    engine, zeros, states = model.looped, np.zeros(model.nu), ClosedStates(model, freedom, t)

    def problem_along(places: tuple[int, ...]) -> EquilibriumProblem:
        scales = states.sizes[list(places)]

        def required_efforts(q: Array) -> Array:
            efforts = engine.inverse_dynamics(t, q, zeros, zeros, states.memory)
            reduced = np.asarray(freedom.motion_matrix(q, places).T @ efforts)
            # Motions without load must not follow the rounding of efforts that cancel.
            work = float(np.abs(efforts) @ freedom.sizes)
            return np.where(np.abs(reduced) * scales > _CANCELLATION * work, reduced, 0.0)

        def move(q: Array, increment: Array) -> Array:
            return states.move(q, places, increment)

        problem = EquilibriumProblem(
            required_efforts, move, scales, places, lambda q: problem_at(places, problem, q)
        )
        return problem

    def problem_at(
        places: tuple[int, ...], problem: EquilibriumProblem, q: Array
    ) -> EquilibriumProblem:
        chosen = freedom.select(q)
        return problem if chosen == places else problem_along(chosen)

    return problem_along(freedom.select(q))


def _coordinates_of_speeds(model: CompiledScene, free: list[int]) -> NDArray[np.int64] | None:
    """Indices in q of the coordinates whose rates are the free speeds; None for other hinges."""
    places = np.zeros(model.nu, dtype=np.int64)
    for slots in model.coordinate_layout.hinges.values():
        if slots.nu and not slots.rates_are_speeds:
            return None
        places[slots.u_slice] = np.arange(slots.q, slots.q + slots.nq)
    for slots in model.coordinate_layout.modal.values():
        places[slots.u_slice] = np.arange(slots.q, slots.q + slots.nq)
    return np.asarray(places[free])
