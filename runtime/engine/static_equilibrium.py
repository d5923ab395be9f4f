"""Static equilibrium by Newton's method and load steps, and loads without equilibrium.

Efforts of different kinds (N and N*m, of an axial shape and of a twist) are never compared: every
stiffness is scaled by those of its own coordinate, and every step by the characteristic scale of
its coordinate, a motion that changes the geometry noticeably.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure, SceneError

_MAX_STEP = 0.5  # in characteristic scales of the coordinates
#: Scaled stiffness below which a direction counts as slack: for central differences, and for those
#: of fourth order, which are used after steps shorter than the third number, in characteristic
#: scales.
_SLACK_STIFFNESS, _SLACK_EXACT_STIFFNESS, _EXACT_STEP = 1e-8, 1e-10, 0.1
_MAX_ITERATIONS, _MAX_PART_ITERATIONS = 200, 20
#: Forces without potential have no descent direction: relative asymmetry of their stiffness, and
#: number of iterations after which Newton's method then counts as not convergent.
_MAX_ASYMMETRY, _ITERATIONS_WITHOUT_POTENTIAL = 1e-4, 20
_MAX_HALVINGS = 40
#: Permitted growth of efforts in a step: by the first factor, or up to the efforts of a motion of
#: the second size, in characteristic scales.
_MAX_EFFORT_GROWTH, _MAX_EFFORT_MOTION = 10.0, 1e-3
#: Steps of the difference quotients in characteristic scales: coarse, fine, and of fourth order.
#: Errors are about 1e-12 for those of fourth order and 1e-8 for the others.  A stiffness above
#: rounding agrees with the fine ones.
_COARSE_STEP, _FINE_STEP, _FOURTH_ORDER_STEP = 1e-4, 1e-5, 1e-3
#: Stiffness that counts as rounding, relative to the largest one, all in J.
_RELATIVE_ROUNDING = 1e-16
#: Initial load step if the whole load fails, and smallest load step, as fractions of the load.
_INITIAL_LOAD_STEP, _MIN_LOAD_STEP = 0.25, 2.0**-10


class EquilibriumNotFoundError(NumericalFailure):
    """Equilibrium not found; `residual` (n,) are the remaining efforts in the coordinates."""

    def __init__(
        self, message: str, residual: Array, problem: EquilibriumProblem | None = None
    ) -> None:
        super().__init__(message)
        self.residual, self.problem = residual, problem


class UndeterminedEquilibriumError(NumericalFailure):
    """Equilibrium without stiffness in some directions.

    `places` are the coordinates of `problem` that these directions move.
    """

    def __init__(self, places: Sequence[int], problem: EquilibriumProblem) -> None:
        super().__init__("")
        self.coordinate_indices, self.problem = tuple(places), problem


@dataclass(frozen=True)
class EquilibriumProblem:
    """Equilibrium problem in n coordinates.

    Attributes:
        required_efforts: q -> efforts (n,) required for equilibrium in the coordinates, N, N*m.
        move: q and a small motion (n,) -> q after the motion.
        sizes: (n,) characteristic scales of the coordinates: 1 rad, the length of a body; m, rad.
        coordinate_indices: indices of the coordinates among the speeds of the scene.
        problem_at: q -> the same problem in coordinates that are independent at that q.
    """

    required_efforts: Callable[[Array], Array]
    move: Callable[[Array, Array], Array]
    sizes: Array
    coordinate_indices: tuple[int, ...] = ()
    problem_at: Callable[[Array], EquilibriumProblem] | None = None

    def at_state(self, q: Array) -> EquilibriumProblem:
        """Same problem in coordinates that are independent at q."""
        return self if self.problem_at is None else self.problem_at(q)

    def efforts(self, q: Array) -> Array:
        """Efforts (n,) times characteristic scales, J; raises NumericalFailure if not finite."""
        with np.errstate(all="ignore"):
            scaled_efforts = self.required_efforts(q) * self.sizes
        if not np.isfinite(scaled_efforts).all():
            raise NumericalFailure("the efforts of this state are not finite")
        return scaled_efforts

    def advance_state(self, q: Array, step: Array) -> Array:
        """Move q by a motion given in characteristic scales."""
        return self.move(q, step * self.sizes)

    def slope(self, q: Array, size: float = _COARSE_STEP) -> Array:
        """Stiffness (n, n) in J, by central differences."""
        columns = [
            (self.efforts(self.advance_state(q, unit)) - self.efforts(self.advance_state(q, -unit)))
            / (2 * size)
            for unit in size * np.eye(len(self.sizes))
        ]
        return np.array(columns).reshape(len(columns), len(columns)).T

    def exact_slope(self, q: Array) -> Array:
        """Stiffness (n, n) in J, by differences of fourth order."""
        return np.asarray(
            (4 * self.slope(q, _FOURTH_ORDER_STEP) - self.slope(q, 2 * _FOURTH_ORDER_STEP)) / 3
        )


def find_determined_equilibrium(problem: EquilibriumProblem, q: Array, tolerance: float) -> Array:
    """Find an equilibrium; UndeterminedEquilibriumError if it has neutral directions."""
    equilibrium_q = find_equilibrium(problem, q, tolerance)
    unstable_coordinates(problem.at_state(equilibrium_q), equilibrium_q)
    return equilibrium_q


def find_equilibrium(problem: EquilibriumProblem, q: Array, tolerance: float) -> Array:
    """Find q at rest, to `tolerance` times the characteristic scales, or to rounding.

    Newton's method is applied to the whole load; if that fails, the unbalanced efforts at the start
    act as external efforts, which are reduced to zero in load steps.  Raises
    EquilibriumNotFoundError.
    """
    try:
        return _solve_newton(problem, q, tolerance, _MAX_ITERATIONS, _descent_step)
    except EquilibriumNotFoundError as failure:
        try:
            return _solve_in_load_steps(problem, q, tolerance)
        except NumericalFailure:
            raise failure from None


def _solve_in_load_steps(problem: EquilibriumProblem, q: Array, tolerance: float) -> Array:
    missing_efforts = problem.required_efforts(q)
    load_fraction, load_step = 0.0, _INITIAL_LOAD_STEP
    while load_fraction < 1.0:
        target_fraction = min(1.0, load_fraction + load_step)
        loaded_problem = EquilibriumProblem(
            _with_external_efforts(
                problem.required_efforts, (1 - target_fraction) * missing_efforts
            ),
            problem.move,
            problem.sizes,
        )
        try:
            q = _solve_newton(loaded_problem, q, tolerance, _MAX_PART_ITERATIONS, _newton_step)
        except NumericalFailure:
            load_step /= 2
            if load_step < _MIN_LOAD_STEP:
                raise
            continue
        load_fraction, load_step = target_fraction, 1.5 * load_step
    return q


def _with_external_efforts(
    needed: Callable[[Array], Array], given: Array
) -> Callable[[Array], Array]:
    return lambda q: needed(q) - given


# --- Newton's method ------------------------------------------------------------------------------


#: (slope, residual, scale, slack stiffness) -> step; all (n,), or (n, n), in characteristic scales.
Stepping = Callable[[Array, Array, Array, float], Array]


def _solve_newton(
    problem: EquilibriumProblem, q: Array, tolerance: float, iterations: int, stepping: Stepping
) -> Array:
    residual, step_length = problem.efforts(q), np.inf
    for k in range(iterations):
        adapted_problem = problem.at_state(q)
        if adapted_problem is not problem:
            problem, residual = adapted_problem, adapted_problem.efforts(q)
        is_near = step_length < _EXACT_STEP
        try:
            stiffness = problem.exact_slope(q) if is_near else problem.slope(q)
        except NumericalFailure as failure:
            raise EquilibriumNotFoundError(
                str(failure), residual / problem.sizes, problem
            ) from None
        scale = _stiffness_scale(stiffness, residual)
        if k >= _ITERATIONS_WITHOUT_POTENTIAL and _is_asymmetric(stiffness, scale):
            iterations = k
            break
        step = stepping(
            stiffness, residual, scale, _SLACK_EXACT_STIFFNESS if is_near else _SLACK_STIFFNESS
        )
        step_length = float(np.abs(step).max(initial=0.0))
        if step_length <= tolerance:
            return problem.advance_state(q, step)
        q, residual, is_decreasing = _line_search(problem, q, residual, step, scale)
        if not is_decreasing and step_length < _COARSE_STEP and _is_rounding(problem, q, residual):
            return q
    raise EquilibriumNotFoundError(
        f"not converged after {iterations} iterations", residual / problem.sizes, problem
    )


def _is_asymmetric(slope: Array, scale: Array) -> bool:
    root = np.sqrt(scale)
    asymmetry = np.abs(slope - slope.T) / np.outer(root, root)
    return float(asymmetry.max(initial=0.0)) > _MAX_ASYMMETRY


def _stiffness_scale(slope: Array, residual: Array, noise: Array | float = 0.0) -> Array:
    """Stiffness scale (n,) of each coordinate: the largest of K_ii, K_ij^2 / K_jj, effort.

    `noise` is the rounding error of K_jj.
    """
    diagonal = np.maximum(np.maximum(np.abs(np.diag(slope)), noise), 1e-300)
    coupled = np.max(((slope + slope.T) / 2) ** 2 / diagonal, axis=1, initial=0.0)
    return np.maximum.reduce([diagonal, coupled, np.abs(residual)])


def _descent_step(slope: Array, residual: Array, scale: Array, soft: float) -> Array:
    """Newton step if the stiffness is positive definite, else a modified descent step.

    In directions of negative or zero stiffness a Newton step would ascend or be too long; there the
    step follows the forces, so that unstable equilibria are avoided (for forces without potential
    this is only a heuristic).
    """
    root = np.sqrt(scale)
    scaled_stiffness, scaled_efforts = slope / np.outer(root, root), residual / root
    values, directions = np.linalg.eigh((scaled_stiffness + scaled_stiffness.T) / 2)
    if values.min(initial=np.inf) > soft:
        return np.asarray(np.linalg.solve(scaled_stiffness, -scaled_efforts) / root)
    softened = np.maximum(np.abs(values), soft)
    return np.asarray(-directions @ ((directions.T @ scaled_efforts) / softened) / root)


def _newton_step(slope: Array, residual: Array, scale: Array, _: float) -> Array:
    """Unmodified Newton step, for use near the equilibrium for the previous load."""
    root = np.sqrt(scale)
    try:
        return np.asarray(np.linalg.solve(slope / np.outer(root, root), -residual / root) / root)
    except np.linalg.LinAlgError:
        raise NumericalFailure("the stiffness is singular") from None


def _line_search(
    problem: EquilibriumProblem, q: Array, residual: Array, step: Array, scale: Array
) -> tuple[Array, Array, bool]:
    """Line search: q after the step, the efforts there, and whether they have decreased.

    The step, limited to `_MAX_STEP`, is halved until its end is a valid state and the efforts
    decrease or do not reverse.  If forces have a potential, the required efforts are its gradient:
    a step that passes the minimum far reverses the gradient along it to more than half its size.
    The efforts must also not grow much across a direction of little stiffness.
    """
    step = step / max(1.0, float(np.abs(step).max(initial=0.0)) / _MAX_STEP)
    size_before, work = _scaled_norm(residual, scale), abs(float(residual @ step))
    max_size = max(
        _MAX_EFFORT_GROWTH * size_before,
        _MAX_EFFORT_MOTION * float(np.sqrt(scale.max(initial=0.0))),
    )
    last_valid: tuple[Array, Array] | None = None
    for _ in range(_MAX_HALVINGS):
        try:
            trial = problem.advance_state(q, step)
            efforts = problem.efforts(trial)
        except NumericalFailure:
            step, work = step / 2, work / 2
            continue
        last_valid = trial, efforts
        size_after = _scaled_norm(efforts, scale)
        if size_after < size_before or (
            float(efforts @ step) <= work / 2 and size_after < max_size
        ):
            return trial, efforts, size_after < size_before
        step, work = step / 2, work / 2
    if last_valid is None:
        raise EquilibriumNotFoundError(
            "no step changes the state", residual / problem.sizes, problem
        )
    return *last_valid, False


def _scaled_norm(residual: Array, scale: Array) -> float:
    return float(np.linalg.norm(residual / np.sqrt(scale)))


# --- rounding -------------------------------------------------------------------------------------


def _stiffness_and_noise(problem: EquilibriumProblem, q: Array) -> tuple[Array, Array]:
    """Stiffness (n, n) in J, and its deviation between two difference quotients."""
    exact, fine = problem.exact_slope(q), problem.slope(q, _FINE_STEP)
    return exact, np.abs(exact - fine)


def _is_rounding(problem: EquilibriumProblem, q: Array, residual: Array) -> bool:
    """True if the remaining efforts are rounding errors of larger ones that cancel."""
    _, noise = _stiffness_and_noise(problem, q)
    return bool((np.abs(residual) <= 10 * _FINE_STEP * noise.max(axis=1, initial=0.0)).all())


def unstable_coordinates(problem: EquilibriumProblem, q: Array) -> tuple[int, ...]:
    """Unstable coordinates of an equilibrium, by negative stiffness.

    Empty if efforts have no potential, because their stiffness then does not determine stability.
    Raises UndeterminedEquilibriumError for directions with stiffness at rounding level relative to
    that of their coordinates, and EquilibriumNotFoundError for remaining efforts that no small
    motion removes:
        with a coordinate
    without stiffness, the scale of another one may be so large that steps become short far from
    equilibrium.
    """
    stiffness, noise = _stiffness_and_noise(problem, q)
    rounding = _RELATIVE_ROUNDING * float(np.abs(stiffness).max(initial=0.0))
    scale = _stiffness_scale(
        stiffness, np.zeros(len(stiffness)), np.maximum(np.diag(noise), rounding)
    )
    root = np.sqrt(scale)
    symmetric_stiffness = (stiffness + stiffness.T) / 2
    values, directions = np.linalg.eigh(symmetric_stiffness / np.outer(root, root))
    spread = np.abs(directions) / root[:, None]
    uncertainty = 4 * np.einsum("ik,ij,jk->k", spread, noise, spread) + 1e-13

    def moving_indices(which: NDArray[np.bool_]) -> tuple[int, ...]:
        share = spread[:, which].max(axis=1, initial=0.0) * root
        return tuple(np.flatnonzero(share > 0.1).tolist())

    is_neutral = np.abs(values) <= uncertainty
    if is_neutral.any():
        raise UndeterminedEquilibriumError(moving_indices(is_neutral), problem)
    residual = problem.efforts(q)
    if np.abs(residual).max(initial=0.0) > len(stiffness) * _COARSE_STEP * np.abs(stiffness).max(
        initial=0.0
    ):
        raise EquilibriumNotFoundError(
            "steps become too short far from equilibrium", residual / problem.sizes, problem
        )
    return () if _is_asymmetric(stiffness, scale) else moving_indices(values < 0)


#: Maximum number of coordinates, number of random states in addition to that of coordinates, and
#: number of attempts per state.
_MAX_COORDINATES, _SPARE, _DRAWS = 200, 12, 2
#: Distances of the states, in characteristic scales: far enough to reach stops and the stiffness of
#: soft springs.
_NEAREST, FARTHEST = 0.1, 1e4
#: Variation that counts as rounding: of efforts, relative to the largest ones, and of the load.
_ROUNDING, _CONSTANT = 1e-9, 1e-6
#: Smallest scale of the efforts of a coordinate, relative to the largest scale.
_MIN_EFFORT_SCALE = 1e-5


def find_unbalanced_motion(
    problem: EquilibriumProblem, q: Array, farthest: float = FARTHEST
) -> tuple[Array, int] | None:
    """Motion (n,) with a constant non-zero load along it, and the number of states examined.

    Random states are drawn around q, at distances from 0.1 to `farthest` characteristic scales.
    None if every load varies, or if too few of the states are valid.
    """
    count = len(problem.sizes)
    if not 0 < count <= _MAX_COORDINATES:
        return None
    efforts = _random_efforts(problem, q, count + _SPARE, farthest)
    if len(efforts) < count + _SPARE:
        return None
    scale = np.abs(efforts).max(axis=0)
    if not scale.any():
        return None
    scale = np.maximum(scale, _MIN_EFFORT_SCALE * scale.max())
    rows = efforts / scale
    _, values, directions = np.linalg.svd(rows[1:] - rows[0])
    still = directions[values <= _ROUNDING * len(rows)]
    motion = still.T @ (still @ rows[0])
    loads = rows @ motion
    if np.linalg.norm(motion) <= _ROUNDING or np.ptp(loads) > _CONSTANT * abs(loads[0]):
        return None
    return motion / scale * problem.sizes, len(efforts)


def _random_efforts(problem: EquilibriumProblem, q: Array, count: int, farthest: float) -> Array:
    """Efforts (k, n), J, at q and at random states around it, with k at most `count`."""
    draw, effort_samples = np.random.default_rng(0), [problem.efforts(q)]
    for _ in range(_DRAWS * count):
        if len(effort_samples) == count:
            break
        distance = np.exp(draw.uniform(np.log(_NEAREST), np.log(farthest)))
        step = distance * draw.uniform(-1.0, 1.0, len(problem.sizes))
        try:
            effort_samples.append(problem.efforts(problem.advance_state(q, step)))
        except (NumericalFailure, SceneError):
            continue
    return np.array(effort_samples)
