"""Effects that a linear model omits, as risks: dry friction, initial speeds."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import lstsq

from mstmm.array_validation import Array
from mstmm.display import abbreviate_names
from mstmm.errors import NumericalFailure
from mstmm.risk import Risk, information

from ...engine.compiled_scene import speed_scales
from ...run.start_state import initial_state
from .friction import StickingFriction

if TYPE_CHECKING:
    from ..linear_equations import LinearEquations


# --- dry friction: sticking hinges, friction by expressions ---------------------------------------

#: Fraction of a radian or a scene length below which sticking is no objection.
_SMALL = 0.01
#: Radians or scene lengths beyond which a hinge counts as unrestrained.
_FAR = 10.0
#: Low and high speed in characteristic scales per second, negligible damping in 1/s, and ratio of
#: the damping at high speed to that at low speed below which it is saturated.
_SLOW, _FAST, _FAINT, _SATURATED = 1e-3, 0.1, 1e-6, 0.1
#: Speed at which smooth efforts differ only by rounding, and multiple of this rounding above which
#: damping is significant.
_NOISE, _ABOVE = 1e-13, 30.0
#: Number of coordinates up to which each is moved individually; above it, numbers of neighbours
#: that move with the same sign.
_SINGLE, _RUNS = 50, (1, 2, 1 << 30)
#: Speeds, in characteristic scales per second, between which a jump of an effort does not change;
#: the fraction by which it may differ; negligible acceleration in scales/s^2.
_NEAR, _STEADY, _CREEP = (1e-6, 1e-8), 0.5, 1e-6
#: Number of entries in a message; relative stiffness that counts as zero.
_LISTED, _SOFT = 4, 1e-12


def friction_risks(linear: LinearEquations) -> Iterator[Risk]:
    """Risk for all hinges whose friction is omitted: the amplitude below which they stick."""
    left = (
        [friction for friction in linear.dry.sticking.values() if not friction.is_given]
        if linear.dry
        else []
    )
    if not left:
        return
    amplitudes = _sticking_amplitudes(linear, left)
    sizes = speed_scales(linear.model)[[friction.speed for friction in left]]
    order = np.argsort(-amplitudes / sizes, kind="stable")
    layout, worst = linear.model.coordinate_layout, int(order[0])
    listed = [
        _sentence(layout.u_name(left[k].speed), _unit(linear, left[k].speed),
                  float(amplitudes[k]), left[k].static)
        for k in order[:_LISTED]
    ]  # fmt: skip
    more = len(left) - len(listed)
    hinge = layout.hinge_of_speed(left[worst].speed).name
    yield Risk(
        "dry-friction", f'hinge "{hinge}"',
        "dry friction is neglected: the model is valid for motions larger than those at which a "
        f"hinge sticks: {'; '.join(listed)}{f'; and {more} more' if more > 0 else ''}",
        "give friction, a speed amplitude at which it is replaced by viscous damping of equal work",
        float(amplitudes[worst]), _SMALL * float(sizes[worst]), _unit(linear, left[worst].speed),
        invalidates=bool(amplitudes[worst] > _SMALL * sizes[worst]),
    )  # fmt: skip


@dataclass(frozen=True)
class IndependentMotions:
    """Independent motions about a state.

    Attributes:
        names, units: names and units of increments.
        sizes: (n,) characteristic scales.
        to_speeds: map from increments (n,) to all speeds (nu,).
        to_motion_efforts: map from efforts (nu,) to efforts along the motions (n,).
    """

    names: Sequence[str]
    units: Sequence[str]
    sizes: Array
    to_speeds: Callable[[Array], Array]
    to_motion_efforts: Callable[[Array], Array]


def independent_motions(linear: LinearEquations) -> IndependentMotions:
    """Independent motions of x; for a rotor in axes that rotate with it."""
    plain, free, loops = (
        replace(linear, frame_transform=None),
        list(linear.free_speed_indices),
        linear.constrained_motion,
    )
    return IndependentMotions(
        linear.coordinate_names,
        linear.coordinate_units,
        speed_scales(linear.model)[free],
        plain.expand,
        lambda efforts: efforts[free] if loops is None else loops.motion_basis.T @ efforts,
    )


def saturation_risks(linear: LinearEquations, motions: IndependentMotions) -> Iterator[Risk]:
    """Risks of coordinates with friction by an expression.

    These have an effort that jumps with speed at the state, such as -10*sign(u), or damping that
    saturates above low speeds, such as -10*tanh(u/0.001).
    """
    n = len(motions.sizes)
    if not n:
        return
    signs = (
        np.eye(n) if n <= _SINGLE else np.array([1 - 2 * (np.arange(n) // k % 2) for k in _RUNS])
    )
    work = _work(linear, motions, signs)
    mass = np.maximum(np.abs(work(0.0)).max(axis=0), np.finfo(float).tiny)
    first, jumps = (work(part) for part in _NEAR)
    steady = np.abs(first - jumps) < _STEADY * np.abs(jumps)
    jump = np.where(steady, np.abs(jumps), 0.0).max(axis=0)
    slow, fast = work(_SLOW) / (2 * _SLOW), work(_FAST) / (2 * _FAST)
    noise = _ABOVE * float((np.abs(work(_NOISE)) / mass).max()) / _SLOW
    damped = slow > (_FAINT + noise) * mass
    parts = np.divide(np.abs(fast), slow, out=np.zeros_like(slow), where=damped).max(axis=0)
    for k, name in enumerate(motions.names):
        least = _CREEP * float(mass[k])
        if jump[k] > least:
            yield _jump_risk(name, motions.units[k], float(jump[k]), least)
        elif damped[:, k].any() and parts[k] < _SATURATED:
            yield _saturated_risk(name, motions, k, float(parts[k]))


def _work(
    linear: LinearEquations, motions: IndependentMotions, signs: Array
) -> Callable[[float], Array]:
    """Function of a speed that returns differences (k, n) of efforts along the coordinates.

    The differences are between this speed, in characteristic scales per second with `signs` (k, n),
    and its opposite; at 0, between an acceleration of one scale/s^2 and none.  If coordinates are
    moved individually, the result (1, n) has only the effort of each along itself.
    """
    tree, state, memory = linear.open_tree, linear.state, linear.open_tree.start_memory()

    def efforts(u: Array, a: Array) -> Array:
        return tree.inverse_dynamics(state.t, state.q, u, a, memory)

    def effort_difference(speed: float, row: Array) -> Array:
        step = motions.to_speeds(row * motions.sizes)
        if speed:
            step = speed * step
            return efforts(state.u + step, state.udot) - efforts(state.u - step, state.udot)
        return efforts(state.u, state.udot + step) - efforts(state.u, state.udot)

    def work(speed: float) -> Array:
        efforts = (
            np.array([motions.to_motion_efforts(effort_difference(speed, row)) for row in signs])
            * signs
        )
        return efforts if len(motions.sizes) > _SINGLE else efforts.diagonal()[None]

    return work


def _jump_risk(name: str, unit: str, jump: float, least: float) -> Risk:
    """Risk of an effort that jumps with speed."""
    unit = "N*m" if unit == "rad" else "N"
    return Risk(
        "dry-friction", name,
        f"an effort along {name} jumps by {jump:.4g} {unit} with the speed at this state, as "
        "with dry friction: the model neglects the jump",
        "give it as law.friction of the hinge, or as a linear damping", jump, least, unit,
    )  # fmt: skip


def _saturated_risk(name: str, motions: IndependentMotions, k: int, part: float) -> Risk:
    """Risk of damping that saturates above low speeds."""
    return Risk(
        "dry-friction", name,
        f"the damping of {name} is valid for speeds close to the state only: at "
        f"{_FAST * motions.sizes[k]:.3g} {motions.units[k]}/s it is {part:.2g} times as large, as "
        "with dry friction",
        "give it as law.friction of the hinge, or as a linear damping", part, _SATURATED,
    )  # fmt: skip


def _sentence(name: str, unit: str, amplitude: float, static: float) -> str:
    """Text on the amplitude and effort below which a hinge sticks."""
    effort = f"{static:.4g} {'N*m' if unit == 'rad' else 'N'}"
    hinge = name.rpartition(".")[0]
    if not math.isfinite(amplitude):
        return f"{hinge} under efforts below {effort}, at any amplitude, as no stiffness acts on it"
    return f"{hinge} below an amplitude of {amplitude:.4g} {unit} or efforts of {effort}"


def _unit(linear: LinearEquations, speed: int) -> str:
    slots = linear.model.coordinate_layout.hinge_of_speed(speed)
    return slots.u_units[speed - slots.u].removesuffix("/s")


def _sticking_amplitudes(linear: LinearEquations, left: list[StickingFriction]) -> Array:
    """Amplitude (k,) below which static friction holds each speed against the stiffness.

    All other coordinates follow.  It is infinite without stiffness.
    """
    motions = np.zeros((len(left), len(linear)))
    if not linear.has_stiffness:
        return np.full(len(left), np.inf)
    if linear.constrained_motion is not None:
        motions = linear.constrained_motion.motion_basis[[friction.speed for friction in left]]
    else:
        row_by_speed = {speed: k for k, speed in enumerate(linear.free_speed_indices)}
        for row, friction in zip(motions, left, strict=True):
            row[row_by_speed[friction.speed]] = 1.0
    sizes = speed_scales(linear.model)[list(linear.free_speed_indices)]
    stiffness, rows = linear.K * np.outer(sizes, sizes), motions * sizes
    moved = lstsq(stiffness, rows.T, cond=_SOFT, lapack_driver="gelsy")[0]
    missing = np.abs(stiffness @ moved - rows.T).max(axis=0, initial=0.0)
    held = missing <= 1e-6 * np.abs(rows).max(axis=1, initial=0.0)
    flexibility = np.abs(np.einsum("kn,nk->k", rows, moved))
    amplitudes = np.array([friction.static for friction in left]) * flexibility
    far = _FAR * speed_scales(linear.model)[[friction.speed for friction in left]]
    return np.where(held & (amplitudes > 0) & (amplitudes < far), amplitudes, np.inf)


# --- initial speeds of a scene that persist -------------------------------------------------------

#: Stiffness and damping per mass are weak below these fractions of the squared speed and of the
#: speed, in characteristic scales per second.
_WEAK, _WEAKLY_DAMPED = 0.01, 0.1
#: Significant changes of the matrices, relative to the speed, and relative rounding.
_CHANGED, _ROUNDING = 1e-3, 1e-9


def find_start_risks(linear: LinearEquations, most: int) -> Iterator[Risk]:
    """Risk of initial speeds that persist and change a model that is at rest.

    It applies if the model is at rest because no state was given.  With more than `most`
    coordinates any initial speed counts.
    """
    if linear.equations_at_speeds is None or not len(linear):
        return
    speeds = initial_state(linear.model)[1][list(linear.free_speed_indices)]
    if not speeds.any():
        return
    plain = replace(linear, frame_transform=None)
    if len(linear) <= most:
        speeds = _persistent_speeds(plain, speeds)
        if not speeds.any() or not _are_significant(plain, speeds):
            return
    moving = np.flatnonzero(np.abs(speeds) > _ROUNDING * np.abs(speeds).max())
    names = abbreviate_names(
        [linear.model.coordinate_layout.u_name(linear.free_speed_indices[k]) for k in moving]
    )
    yield information(
        "start-at-speed", names,
        f"the scene starts with steady speeds ({names}), but this model is linearised at rest, "
        "without their effects",
        "to linearise about the initial motion give its state, linearize(*model.initial_state()), "
        "or --at-start on the command line",
    )  # fmt: skip


def _fastest(linear: LinearEquations, speeds: Array) -> float:
    """Largest of the speeds (n,), in characteristic scales per second."""
    return float(np.abs(speeds / speed_scales(linear.model)[list(linear.free_speed_indices)]).max())


def _persistent_speeds(linear: LinearEquations, speeds: Array) -> Array:
    """Part of the speeds (n,) that no stiffness or damping changes within a revolution."""
    scale = np.sqrt(linear.M.diagonal())
    fastest, stiffness = _fastest(linear, speeds), linear.K / np.outer(scale, scale)
    _, squares, motions = np.linalg.svd(stiffness)
    kept = motions[squares < _WEAK * fastest**2]
    lasting = np.asarray(kept.T @ (kept @ (scale * speeds)) / scale)
    slowed, energy = lasting @ linear.C @ lasting, lasting @ linear.M @ lasting
    return lasting if slowed < _WEAKLY_DAMPED * fastest * energy else np.zeros_like(lasting)


def _are_significant(linear: LinearEquations, speeds: Array) -> bool:
    """Whether the matrices at these speeds (n,) differ from those at rest."""
    assert linear.equations_at_speeds is not None
    try:
        beside = linear.equations_at_speeds(linear.state.u + linear.expand(speeds))
    except NumericalFailure:
        return True
    if not beside.has_stiffness or beside.free_speed_indices != linear.free_speed_indices:
        return True
    fastest, scale = _fastest(linear, speeds), np.sqrt(linear.M.diagonal())
    pairs = ((linear.C, beside.C, fastest), (linear.K, beside.K, fastest**2))
    return any(
        float(np.abs((there - here) / np.outer(scale, scale)).max())
        > _CHANGED * rate + _ROUNDING * float(np.abs(here / np.outer(scale, scale)).max())
        for here, there, rate in pairs
    )
