"""Dry friction that a linear model leaves out: sticking of hinges, and friction by expressions."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import lstsq

from mstmm.array_validation import Array
from mstmm.risk import Risk

from ...engine.characteristic_scales import speed_scales
from .friction import Rubbing

if TYPE_CHECKING:
    from ..linear_equations import LinearEquations

#: Part of a radian or a length of the scene below which sticking is no doubt.
_SMALL = 0.01
#: Radians or lengths of the scene beyond which nothing pushes a hinge back.
_FAR = 10.0
#: Speeds in sizes a second, damping in 1/s that is none, and the part of the damping at
#: the small speed below which that at the other one is another.
_SLOW, _FAST, _FAINT, _SATURATED = 1e-3, 0.1, 1e-6, 0.1
#: A speed at which smooth efforts differ by rounding, and how far above that others are some.
_NOISE, _ABOVE = 1e-13, 30.0
#: Coordinates up to which each is moved by itself; beyond, how many neighbours move the same way.
_SINGLE, _RUNS = 50, (1, 2, 1 << 30)
#: Speeds, in sizes a second, at which an effort that jumps is the same; the part of a jump by which
#: it may differ, and acceleration in sizes/s^2 that is none.
_NEAR, _STEADY, _CREEP = (1e-6, 1e-8), 0.5, 1e-6
#: Entries that a message lists; stiffness that is none, in parts.
_LISTED, _SOFT = 4, 1e-12


def friction_risks(linear: LinearEquations) -> Iterator[Risk]:
    """One risk for all hinges whose friction is left out: the amplitude below which they stick."""
    left = [one for one in linear.dry.rubbing.values() if not one.given] if linear.dry else []
    if not left:
        return
    amplitudes = _stuck_below(linear, left)
    sizes = speed_scales(linear.model)[[one.speed for one in left]]
    order = np.argsort(-amplitudes / sizes, kind="stable")
    layout, worst = linear.model.layout, int(order[0])
    listed = [
        _sentence(layout.u_name(left[k].speed), _unit(linear, left[k].speed),
                  float(amplitudes[k]), left[k].static)
        for k in order[:_LISTED]
    ]  # fmt: skip
    more = len(left) - len(listed)
    hinge = layout.hinge_of_speed(left[worst].speed).name
    yield Risk(
        "dry-friction", f'hinge "{hinge}"',
        "dry friction is left out, and the model holds for larger motions than those at which a "
        f"hinge sticks: {'; '.join(listed)}{f'; and {more} more' if more > 0 else ''}",
        "give friction, an amplitude of speed at which it counts as viscous damping of equal work",
        float(amplitudes[worst]), _SMALL * float(sizes[worst]), _unit(linear, left[worst].speed),
        doubt=bool(amplitudes[worst] > _SMALL * sizes[worst]),
    )  # fmt: skip


@dataclass(frozen=True)
class Ways:
    """Independent motions beside a state: names, units of increments, characteristic scales (n,),
    `along` from (n,) to all speeds (nu,), and `onto` from efforts (nu,) to those along them."""

    names: Sequence[str]
    units: Sequence[str]
    sizes: Array
    along: Callable[[Array], Array]
    onto: Callable[[Array], Array]


def ways_of(linear: LinearEquations) -> Ways:
    """Those of x, of a rotor in axes that turn along with it."""
    plain, free, loops = replace(linear, carrying=None), list(linear.free), linear.mechanism
    return Ways(
        linear.coordinates, linear.units, speed_scales(linear.model)[free], plain.spread,
        lambda efforts: efforts[free] if loops is None else loops.ways.T @ efforts,
    )  # fmt: skip


def saturation_risks(linear: LinearEquations, ways: Ways) -> Iterator[Risk]:
    """Coordinates with friction that an expression describes: an effort that jumps with speeds at
    the state, -10*sign(u), or damping that is that of small speeds alone, -10*tanh(u/0.001)."""
    n = len(ways.sizes)
    if not n:
        return
    signs = (
        np.eye(n) if n <= _SINGLE else np.array([1 - 2 * (np.arange(n) // k % 2) for k in _RUNS])
    )
    work = _work(linear, ways, signs)
    mass = np.maximum(np.abs(work(0.0)).max(axis=0), np.finfo(float).tiny)
    first, jumps = (work(part) for part in _NEAR)
    steady = np.abs(first - jumps) < _STEADY * np.abs(jumps)
    jump = np.where(steady, np.abs(jumps), 0.0).max(axis=0)
    slow, fast = work(_SLOW) / (2 * _SLOW), work(_FAST) / (2 * _FAST)
    noise = _ABOVE * float((np.abs(work(_NOISE)) / mass).max()) / _SLOW
    damped = slow > (_FAINT + noise) * mass
    parts = np.divide(np.abs(fast), slow, out=np.zeros_like(slow), where=damped).max(axis=0)
    for k, name in enumerate(ways.names):
        least = _CREEP * float(mass[k])
        if jump[k] > least:
            yield _jump_risk(name, ways.units[k], float(jump[k]), least)
        elif damped[:, k].any() and parts[k] < _SATURATED:
            yield _saturated_risk(name, ways, k, float(parts[k]))


def _work(linear: LinearEquations, ways: Ways, signs: Array) -> Callable[[float], Array]:
    """The function of a speed, in sizes a second, that gives (k, n) how much larger efforts along
    the coordinates are at this speed with `signs` (k, n) than at the opposite one; at 0, at an
    acceleration of one size/s^2.  Of single coordinates (n, n) each has its own alone, (1, n)."""
    tree, state, memory = linear.tree, linear.state, linear.tree.start_memory()

    def efforts(u: Array, a: Array) -> Array:
        return tree.inverse_dynamics(state.t, state.q, u, a, memory)

    def one(speed: float, row: Array) -> Array:
        step = ways.along(row * ways.sizes)
        if speed:
            step = speed * step
            return efforts(state.u + step, state.a) - efforts(state.u - step, state.a)
        return efforts(state.u, state.a + step) - efforts(state.u, state.a)

    def work(speed: float) -> Array:
        found = np.array([ways.onto(one(speed, row)) for row in signs]) * signs
        return found if len(ways.sizes) > _SINGLE else found.diagonal()[None]

    return work


def _jump_risk(name: str, unit: str, jump: float, least: float) -> Risk:
    """An effort that jumps with speeds."""
    unit = "N*m" if unit == "rad" else "N"
    return Risk(
        "dry-friction", name,
        f"an effort along {name} jumps by {jump:.4g} {unit} with speeds at this state, as of "
        "dry friction: the model leaves the jump out",
        "give it as law.friction of the hinge, or as a linear damping", jump, least, unit,
    )  # fmt: skip


def _saturated_risk(name: str, ways: Ways, k: int, part: float) -> Risk:
    """Damping that is a part of that at small speeds."""
    return Risk(
        "dry-friction", name,
        f"damping of {name} is that of speeds near the state alone: at "
        f"{_FAST * ways.sizes[k]:.3g} {ways.units[k]}/s it is {part:.2g} times as large, as of dry "
        "friction",
        "give it as law.friction of the hinge, or as a linear damping", part, _SATURATED,
    )  # fmt: skip


def _sentence(name: str, unit: str, amplitude: float, static: float) -> str:
    """Of one speed: below what it sticks."""
    effort = f"{static:.4g} {'N*m' if unit == 'rad' else 'N'}"
    hinge = name.rpartition(".")[0]
    if not math.isfinite(amplitude):
        return f"{hinge} under efforts below {effort}, at any amplitude, for nothing pushes it back"
    return f"{hinge} below an amplitude of {amplitude:.4g} {unit} or efforts of {effort}"


def _unit(linear: LinearEquations, speed: int) -> str:
    slots = linear.model.layout.hinge_of_speed(speed)
    return slots.u_units[speed - slots.u].removesuffix("/s")


def _stuck_below(linear: LinearEquations, left: list[Rubbing]) -> Array:
    """(k,) how far static friction holds each of some speeds against the stiffness there is, all
    other coordinates following; infinite where there is none."""
    ways = np.zeros((len(left), len(linear)))
    if not linear.has_stiffness:
        return np.full(len(left), np.inf)
    if linear.mechanism is not None:
        ways = linear.mechanism.ways[[one.speed for one in left]]
    else:
        places = {speed: k for k, speed in enumerate(linear.free)}
        for row, one in zip(ways, left, strict=True):
            row[places[one.speed]] = 1.0
    sizes = speed_scales(linear.model)[list(linear.free)]
    stiffness, rows = linear.K * np.outer(sizes, sizes), ways * sizes
    moved = lstsq(stiffness, rows.T, cond=_SOFT, lapack_driver="gelsy")[0]
    missing = np.abs(stiffness @ moved - rows.T).max(axis=0, initial=0.0)
    held = missing <= 1e-6 * np.abs(rows).max(axis=1, initial=0.0)
    flexibility = np.abs(np.einsum("kn,nk->k", rows, moved))
    found = np.array([one.static for one in left]) * flexibility
    far = _FAR * speed_scales(linear.model)[[one.speed for one in left]]
    return np.where(held & (found > 0) & (found < far), found, np.inf)
