"""The way to rest: coordinates at which no effort is needed, by Newton's method and load steps.

Efforts of different kinds stand side by side (N beside N*m, an axial shape beside a twist), so
nothing is compared across coordinates: every stiffness is judged beside those of its own coordinate
and every step beside the size of its coordinate, a motion that changes the shape of things.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mstmm.arrays import Array
from mstmm.errors import NumericalFailure

_LONGEST = 0.5  # step, in sizes of the coordinates
#: Scaled stiffness below which a direction counts as slack: that of simple differences, and that of
#: exact ones, which are taken behind steps shorter than the third number, in sizes.
_SOFT, _SOFTEST, _NEAR = 1e-8, 1e-10, 0.1
_MAX_ITERATIONS, _ITERATIONS_OF_A_PART = 200, 20
#: Forces without potential have no downhill to follow: a stiffness so far from symmetric, and the
#: iterations that are then enough to see whether Newton's method goes there by itself.
_SKEW, _ITERATIONS_WITHOUT_POTENTIAL = 1e-4, 20
_HALVINGS = 40
#: How much efforts may climb in a step: so many times, or to those of such a motion, in sizes.
_MORE, _ASTRAY = 10.0, 1e-3
#: Steps of the difference quotients, in sizes; of those of fourth order, which are exact to some
#: 1e-12 where simple ones are to 1e-8: where a stiffness is no rounding it agrees with fine ones.
_COARSE, _FINE, _WIDE = 1e-4, 1e-5, 1e-3
#: Stiffness in parts of the largest one, all in J, that is rounding of it.
_NOTHING = 1e-16
#: First part of the load that is tried where the whole is too much, and the smallest.
_FIRST_PART, _LEAST_PART = 0.25, 2.0**-10


class Unsettled(NumericalFailure):
    """No rest found; `residual` (n,) is what was left along coordinates of `problem`."""

    def __init__(self, message: str, residual: Array, problem: Rest | None = None) -> None:
        super().__init__(message)
        self.residual, self.problem = residual, problem


class Undetermined(NumericalFailure):
    """Rest that nothing holds in some directions; `places` are the coordinates they move among
    those of `problem`."""

    def __init__(self, places: Sequence[int], problem: Rest) -> None:
        super().__init__("")
        self.places, self.problem = tuple(places), problem


@dataclass(frozen=True)
class Rest:
    """What is to come to rest, n coordinates of it.

    Attributes:
        needed: q -> efforts (n,) that rest needs in the coordinates, N, N*m.
        moved: q and a small motion (n,) -> q after it.
        sizes: (n,) motions of order one: 1 rad, the length of a body; m or rad.
        places: which speeds of the scene they are, for who asks.
        there: the same in coordinates that tell motions of another q apart, where those of here
            need not.
    """

    needed: Callable[[Array], Array]
    moved: Callable[[Array, Array], Array]
    sizes: Array
    places: tuple[int, ...] = ()
    there: Callable[[Array], Rest] | None = None

    def at(self, q: Array) -> Rest:
        """In coordinates that serve at q."""
        return self if self.there is None else self.there(q)

    def efforts(self, q: Array) -> Array:
        """Efforts times sizes, J.  NumericalFailure where they are not finite."""
        with np.errstate(all="ignore"):
            found = self.needed(q) * self.sizes
        if not np.isfinite(found).all():
            raise NumericalFailure("the efforts of this state are not finite")
        return found

    def after(self, q: Array, step: Array) -> Array:
        """q after a motion given in sizes."""
        return self.moved(q, step * self.sizes)

    def slope(self, q: Array, size: float = _COARSE) -> Array:
        """(n, n) stiffness in J, by central differences."""
        columns = [
            (self.efforts(self.after(q, unit)) - self.efforts(self.after(q, -unit))) / (2 * size)
            for unit in size * np.eye(len(self.sizes))
        ]
        return np.array(columns).reshape(len(columns), len(columns)).T

    def exact_slope(self, q: Array) -> Array:
        """(n, n) stiffness in J, by differences of fourth order."""
        return np.asarray((4 * self.slope(q, _WIDE) - self.slope(q, 2 * _WIDE)) / 3)


def at_rest(problem: Rest, q: Array, tolerance: float) -> Array:
    """`approached`, and refused where nothing pushes a motion back: Undetermined."""
    found = approached(problem, q, tolerance)
    leaving(problem.at(found), found)
    return found


def approached(problem: Rest, q: Array, tolerance: float) -> Array:
    """q at rest, coordinates within `tolerance` times their sizes, or within rounding.

    Newton's method at once, else with the load in parts: what is missing at the start is given as
    an effort from outside and taken away bit by bit.  Raises Unsettled.
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
    raise Unsettled(f"no rest after {iterations} steps", residual / problem.sizes, problem)


def _is_skew(slope: Array, scale: Array) -> bool:
    root = np.sqrt(scale)
    skew = np.abs(slope - slope.T) / np.outer(root, root)
    return float(skew.max(initial=0.0)) > _SKEW


def _scale(slope: Array, residual: Array, noise: Array | float = 0.0) -> Array:
    """(n,) the stiffness of each coordinate as it shows: K_ii, or K_ij^2 / K_jj, or the effort;
    `noise` is what of K_jj is rounding."""
    own = np.maximum(np.maximum(np.abs(np.diag(slope)), noise), 1e-300)
    coupled = np.max(((slope + slope.T) / 2) ** 2 / own, axis=1, initial=0.0)
    return np.maximum.reduce([own, coupled, np.abs(residual)])


def _downhill(slope: Array, residual: Array, scale: Array, soft: float) -> Array:
    """Newton's step where the stiffness is positive definite; else one that runs downhill too.

    Along directions in which the stiffness is negative or vanishes, Newton would run uphill or far
    away; the step goes with the forces there, so that unstable equilibria are left behind (for
    forces without potential this is only a heuristic).
    """
    root = np.sqrt(scale)
    scaled, force = slope / np.outer(root, root), residual / root
    values, directions = np.linalg.eigh((scaled + scaled.T) / 2)
    if values.min(initial=np.inf) > soft:
        return np.asarray(np.linalg.solve(scaled, -force) / root)
    softened = np.maximum(np.abs(values), soft)
    return np.asarray(-directions @ ((directions.T @ force) / softened) / root)


def _along_the_path(slope: Array, residual: Array, scale: Array, _: float) -> Array:
    """Newton's step as it is: what was at rest under a little less load is close by."""
    root = np.sqrt(scale)
    try:
        return np.asarray(np.linalg.solve(slope / np.outer(root, root), -residual / root) / root)
    except np.linalg.LinAlgError:
        raise NumericalFailure("the stiffness is singular") from None


def _followed(
    problem: Rest, q: Array, residual: Array, step: Array, scale: Array
) -> tuple[Array, Array, bool]:
    """q after the step, at most _LONGEST long, what is left there, and whether it is less.

    The step is halved until there is a state at its end and the efforts fall or do not climb again:
    where forces have a potential, `needed` is its gradient, and the step has not passed the bottom
    by much as long as the gradient along it has not turned around to more than half its size, nor
    others have grown out of sight of the bottom, beside a slack valley.
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
    """The stiffness (n, n) in J, and how far two difference quotients of it lie apart."""
    exact, fine = problem.exact_slope(q), problem.slope(q, _FINE)
    return exact, np.abs(exact - fine)


def _is_rounding(problem: Rest, q: Array, residual: Array) -> bool:
    """Whether the efforts left are what rounding leaves of larger ones that cancel."""
    _, noise = _noise(problem, q)
    return bool((np.abs(residual) <= 10 * _FINE * noise.max(axis=1, initial=0.0)).all())


def leaving(problem: Rest, q: Array) -> tuple[int, ...]:
    """Coordinates that leave a rest once it is disturbed, as their stiffness is negative; none
    where efforts have no potential, whose stiffness does not tell.

    Raises Undetermined for directions whose stiffness is rounding beside that of their coordinates,
    Unsettled where efforts are left that no small motion takes away: beside a coordinate without
    stiffness of its own another one may count as so stiff that steps get short far from rest.
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
        raise Unsettled("steps get short far from rest", residual / problem.sizes, problem)
    return () if _is_skew(slope, scale) else moving(values < 0)
