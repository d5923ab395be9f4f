"""Static equilibrium by Newton's method and load steps: coordinates that need no effort.

Efforts of different kinds (N and N*m, of an axial shape and of a twist) are never compared: every
stiffness is scaled by those of its own coordinate, and every step by the characteristic scale of
its coordinate, a motion that changes the geometry noticeably.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mstmm.arrays import Array
from mstmm.errors import NumericalFailure

_LONGEST = 0.5  # step, in characteristic scales of the coordinates
#: Scaled stiffness below which a direction counts as slack: by simple differences, and by exact
#: ones, which are used after steps shorter than the third number, in characteristic scales.
_SOFT, _SOFTEST, _NEAR = 1e-8, 1e-10, 0.1
_MAX_ITERATIONS, _ITERATIONS_OF_A_PART = 200, 20
#: Forces without potential have no descent direction: relative asymmetry of their stiffness, and
#: the number of iterations that then shows whether Newton's method converges.
_SKEW, _ITERATIONS_WITHOUT_POTENTIAL = 1e-4, 20
_HALVINGS = 40
#: Permitted growth of efforts in a step: by this factor, or up to those of such a motion in
#: characteristic scales.
_MORE, _ASTRAY = 10.0, 1e-3
#: Steps of the difference quotients in characteristic scales: coarse, fine, and of fourth order,
#: which are exact to about 1e-12, simple ones to 1e-8.  A stiffness that is no rounding agrees with
#: the fine ones.
_COARSE, _FINE, _WIDE = 1e-4, 1e-5, 1e-3
#: Stiffness that is rounding, relative to the largest one, all in J.
_NOTHING = 1e-16
#: First fraction of the load that is tried if the whole load fails, and the smallest.
_FIRST_PART, _LEAST_PART = 0.25, 2.0**-10


class Unsettled(NumericalFailure):
    """No equilibrium found; `residual` (n,) are the remaining efforts in the coordinates."""

    def __init__(self, message: str, residual: Array, problem: Rest | None = None) -> None:
        super().__init__(message)
        self.residual, self.problem = residual, problem


class Undetermined(NumericalFailure):
    """Equilibrium without stiffness in some directions.

    `places` are the coordinates of `problem` that these directions move.
    """

    def __init__(self, places: Sequence[int], problem: Rest) -> None:
        super().__init__("")
        self.places, self.problem = tuple(places), problem


@dataclass(frozen=True)
class Rest:
    """Equilibrium problem in n coordinates.

    Attributes:
        needed: q -> efforts (n,) that equilibrium needs in the coordinates, N, N*m.
        moved: q and a small motion (n,) -> q after it.
        sizes: (n,) characteristic scales of the coordinates: 1 rad, the length of a body; m, rad.
        places: indices of the coordinates among the speeds of the scene.
        there: q -> the same problem in coordinates that are independent at that q.
    """

    needed: Callable[[Array], Array]
    moved: Callable[[Array, Array], Array]
    sizes: Array
    places: tuple[int, ...] = ()
    there: Callable[[Array], Rest] | None = None

    def at(self, q: Array) -> Rest:
        """The same problem in coordinates that are independent at q."""
        return self if self.there is None else self.there(q)

    def efforts(self, q: Array) -> Array:
        """Efforts (n,) times characteristic scales, J.  NumericalFailure if not finite."""
        with np.errstate(all="ignore"):
            found = self.needed(q) * self.sizes
        if not np.isfinite(found).all():
            raise NumericalFailure("the efforts of this state are not finite")
        return found

    def after(self, q: Array, step: Array) -> Array:
        """Move q by a motion given in characteristic scales."""
        return self.moved(q, step * self.sizes)

    def slope(self, q: Array, size: float = _COARSE) -> Array:
        """Stiffness (n, n) in J, by central differences."""
        columns = [
            (self.efforts(self.after(q, unit)) - self.efforts(self.after(q, -unit))) / (2 * size)
            for unit in size * np.eye(len(self.sizes))
        ]
        return np.array(columns).reshape(len(columns), len(columns)).T

    def exact_slope(self, q: Array) -> Array:
        """Stiffness (n, n) in J, by differences of fourth order."""
        return np.asarray((4 * self.slope(q, _WIDE) - self.slope(q, 2 * _WIDE)) / 3)


def at_rest(problem: Rest, q: Array, tolerance: float) -> Array:
    """Find an equilibrium as `approached` does; Undetermined if it has neutral directions."""
    found = approached(problem, q, tolerance)
    leaving(problem.at(found), found)
    return found


def approached(problem: Rest, q: Array, tolerance: float) -> Array:
    """Find q at rest, to `tolerance` times the characteristic scales, or to rounding.

    Newton's method is applied to the whole load, else in load steps: the efforts missing at the
    start act as external efforts, which are reduced to zero in steps.  Raises Unsettled.
    """
    try:
        return _newton(problem, q, tolerance, _MAX_ITERATIONS, _downhill)
    except Unsettled as failure:
        try:
            return _in_parts(problem, q, tolerance)
        except NumericalFailure:
            raise failure from None


def _in_parts(problem: Rest, q: Array, tolerance: float) -> Array:
    missing = problem.needed(q)
    done, part = 0.0, _FIRST_PART
    while done < 1.0:
        goal = min(1.0, done + part)
        loaded = Rest(_less(problem.needed, (1 - goal) * missing), problem.moved, problem.sizes)
        try:
            q = _newton(loaded, q, tolerance, _ITERATIONS_OF_A_PART, _along_the_path)
        except NumericalFailure:
            part /= 2
            if part < _LEAST_PART:
                raise
            continue
        done, part = goal, 1.5 * part
    return q


def _less(needed: Callable[[Array], Array], given: Array) -> Callable[[Array], Array]:
    return lambda q: needed(q) - given


# --- Newton's method ------------------------------------------------------------------------------


#: (slope, residual, scale, stiffness that is slack) -> step; all (n,) in sizes, or (n, n).
Stepping = Callable[[Array, Array, Array, float], Array]


def _newton(
    problem: Rest, q: Array, tolerance: float, iterations: int, stepping: Stepping
) -> Array:
    residual, length = problem.efforts(q), np.inf
    for k in range(iterations):
        nearby = problem.at(q)
        if nearby is not problem:
            problem, residual = nearby, nearby.efforts(q)
        near = length < _NEAR
        try:
            slope = problem.exact_slope(q) if near else problem.slope(q)
        except NumericalFailure as failure:
            raise Unsettled(str(failure), residual / problem.sizes, problem) from None
        scale = _scale(slope, residual)
        if k >= _ITERATIONS_WITHOUT_POTENTIAL and _is_skew(slope, scale):
            iterations = k
            break
        step = stepping(slope, residual, scale, _SOFTEST if near else _SOFT)
        length = float(np.abs(step).max(initial=0.0))
        if length <= tolerance:
            return problem.after(q, step)
        q, residual, falls = _followed(problem, q, residual, step, scale)
        if not falls and length < _COARSE and _is_rounding(problem, q, residual):
            return q
    raise Unsettled(
        f"not converged after {iterations} iterations", residual / problem.sizes, problem
    )


def _is_skew(slope: Array, scale: Array) -> bool:
    root = np.sqrt(scale)
    skew = np.abs(slope - slope.T) / np.outer(root, root)
    return float(skew.max(initial=0.0)) > _SKEW


def _scale(slope: Array, residual: Array, noise: Array | float = 0.0) -> Array:
    """Scale (n,) of the stiffness of each coordinate: the largest of K_ii, K_ij^2 / K_jj, effort.

    `noise` is the rounding error of K_jj.
    """
    own = np.maximum(np.maximum(np.abs(np.diag(slope)), noise), 1e-300)
    coupled = np.max(((slope + slope.T) / 2) ** 2 / own, axis=1, initial=0.0)
    return np.maximum.reduce([own, coupled, np.abs(residual)])


def _downhill(slope: Array, residual: Array, scale: Array, soft: float) -> Array:
    """Newton step if the stiffness is positive definite, else a modified step of descent.

    In directions with negative or zero stiffness Newton's step would ascend or be too long; there
    the step follows the forces, so that unstable equilibria are avoided (for forces without
    potential this is only a heuristic).
    """
    root = np.sqrt(scale)
    scaled, force = slope / np.outer(root, root), residual / root
    values, directions = np.linalg.eigh((scaled + scaled.T) / 2)
    if values.min(initial=np.inf) > soft:
        return np.asarray(np.linalg.solve(scaled, -force) / root)
    softened = np.maximum(np.abs(values), soft)
    return np.asarray(-directions @ ((directions.T @ force) / softened) / root)


def _along_the_path(slope: Array, residual: Array, scale: Array, _: float) -> Array:
    """Unmodified Newton step: the equilibrium for the previous load is near."""
    root = np.sqrt(scale)
    try:
        return np.asarray(np.linalg.solve(slope / np.outer(root, root), -residual / root) / root)
    except np.linalg.LinAlgError:
        raise NumericalFailure("the stiffness is singular") from None


def _followed(
    problem: Rest, q: Array, residual: Array, step: Array, scale: Array
) -> tuple[Array, Array, bool]:
    """Line search: q after the step, the efforts there, and whether they are smaller.

    The step, at most _LONGEST long, is halved until its end is a valid state and the efforts
    decrease or do not reverse.  If forces have a potential, `needed` is its gradient: the step has
    not passed the minimum far unless the gradient along it has reversed to more than half its size.
    The efforts must also not grow much across a direction of little stiffness.
    """
    step = step / max(1.0, float(np.abs(step).max(initial=0.0)) / _LONGEST)
    before, along = _size(residual, scale), abs(float(residual @ step))
    most = max(_MORE * before, _ASTRAY * float(np.sqrt(scale.max(initial=0.0))))
    reached: tuple[Array, Array] | None = None
    for _ in range(_HALVINGS):
        try:
            trial = problem.after(q, step)
            left = problem.efforts(trial)
        except NumericalFailure:
            step, along = step / 2, along / 2
            continue
        reached = trial, left
        after = _size(left, scale)
        if after < before or (float(left @ step) <= along / 2 and after < most):
            return trial, left, after < before
        step, along = step / 2, along / 2
    if reached is None:
        raise Unsettled("no step leads to another state", residual / problem.sizes, problem)
    return *reached, False


def _size(residual: Array, scale: Array) -> float:
    return float(np.linalg.norm(residual / np.sqrt(scale)))


# --- rounding -------------------------------------------------------------------------------------


def _noise(problem: Rest, q: Array) -> tuple[Array, Array]:
    """Stiffness (n, n) in J, and the difference of two difference quotients of it."""
    exact, fine = problem.exact_slope(q), problem.slope(q, _FINE)
    return exact, np.abs(exact - fine)


def _is_rounding(problem: Rest, q: Array, residual: Array) -> bool:
    """True if the remaining efforts are rounding of larger ones that cancel."""
    _, noise = _noise(problem, q)
    return bool((np.abs(residual) <= 10 * _FINE * noise.max(axis=1, initial=0.0)).all())


def leaving(problem: Rest, q: Array) -> tuple[int, ...]:
    """Unstable coordinates of an equilibrium, by negative stiffness.

    Empty if efforts have no potential, because their stiffness then does not show stability.
    Raises Undetermined for directions whose stiffness is rounding relative to that of their
    coordinates, Unsettled for remaining efforts that no small motion removes: next to a coordinate
    without stiffness the scale of another one may be so large that steps become short far from
    equilibrium.
    """
    slope, noise = _noise(problem, q)
    nothing = _NOTHING * float(np.abs(slope).max(initial=0.0))
    scale = _scale(slope, np.zeros(len(slope)), np.maximum(np.diag(noise), nothing))
    root = np.sqrt(scale)
    both = (slope + slope.T) / 2
    values, directions = np.linalg.eigh(both / np.outer(root, root))
    spread = np.abs(directions) / root[:, None]
    unsure = 4 * np.einsum("ik,ij,jk->k", spread, noise, spread) + 1e-13

    def moving(which: NDArray[np.bool_]) -> tuple[int, ...]:
        share = spread[:, which].max(axis=1, initial=0.0) * root
        return tuple(np.flatnonzero(share > 0.1).tolist())

    loose = np.abs(values) <= unsure
    if loose.any():
        raise Undetermined(moving(loose), problem)
    residual = problem.efforts(q)
    if np.abs(residual).max(initial=0.0) > len(slope) * _COARSE * np.abs(slope).max(initial=0.0):
        raise Unsettled(
            "steps become short far from equilibrium", residual / problem.sizes, problem
        )
    return () if _is_skew(slope, scale) else moving(values < 0)
