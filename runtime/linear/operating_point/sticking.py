"""Dry friction that a linear model leaves out: sticking of hinges, and friction by expressions."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import lstsq

from mstmm.arrays import Array
from mstmm.risk import Risk

from ...engine.sizes import speed_sizes
from .friction import Rubbing

if TYPE_CHECKING:
    from ..equations import Equations

#: Part of a radian or a length of the scene below which sticking is no doubt.
_SMALL = 0.01
#: Radians or lengths of the scene beyond which nothing pushes a hinge back.
_FAR = 10.0
#: Speed in sizes a second, damping in 1/s that is none, and the part of the damping at
#: small speeds below which that at this speed is another.
_FAST, _FAINT, _SATURATED = 0.1, 1e-6, 0.1
#: Speeds, in sizes a second, at which an effort that jumps is the same; the part of a jump by which
#: it may differ, and acceleration in sizes/s^2 that is none.
_NEAR, _STEADY, _CREEP = (1e-6, 1e-8), 0.5, 1e-6
#: Entries that a message lists; stiffness that is none, in parts.
_LISTED, _SOFT = 4, 1e-12


def friction_risks(linear: Equations) -> Iterator[Risk]:
    """One risk for all hinges whose friction is left out: the amplitude below which they stick."""
    left = [one for one in linear.dry.rubbing.values() if not one.given] if linear.dry else []
    if not left:
        return
    amplitudes = _stuck_below(linear, left)
    sizes = speed_sizes(linear.model)[[one.speed for one in left]]
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


def saturation_risks(linear: Equations) -> Iterator[Risk]:
    """Coordinates with friction that an expression describes: their effort jumps with the speed at
    the state, -10*sign(u), or their damping is that of small speeds alone, -10*tanh(u/0.001)."""
    sizes, tree, state = speed_sizes(linear.model)[list(linear.free)], linear.tree, linear.state
    memory, basis = tree.start_memory(), linear.spread(np.eye(len(linear)))

    def change(k: int, speed: float) -> float:
        """Effort along coordinate k at this speed beyond that at the opposite one."""
        ahead, behind = (
            basis[:, k] @ tree.inverse_dynamics(
                state.t, state.q, state.u + way * speed * basis[:, k], state.a, memory
            )
            for way in (1.0, -1.0)
        )  # fmt: skip
        return float(ahead - behind)

    for k, (name, size) in enumerate(zip(linear.coordinates, sizes.tolist(), strict=True)):
        slope, mass, speed = float(linear.C[k, k]), float(linear.M[k, k]), _FAST * size
        first, jump = (change(k, part * size) for part in _NEAR)
        least = _CREEP * mass * size
        if abs(jump) > least and abs(first - jump) < _STEADY * abs(jump):
            yield _jump_risk(linear, k, abs(jump), least)
        elif slope > _FAINT * mass:
            part = abs(change(k, speed)) / (2 * slope * speed)
            if part < _SATURATED:
                yield Risk(
                    "dry-friction", name,
                    f"damping of {name} is that of speeds near the state alone: at {speed:.3g} "
                    f"{linear.units[k]}/s it is {part:.2g} times as large, as of dry friction",
                    "give it as law.friction of the hinge, or as a linear damping", part,
                    _SATURATED,
                )  # fmt: skip


def _jump_risk(linear: Equations, k: int, jump: float, least: float) -> Risk:
    """An effort that jumps with the speed of coordinate k."""
    name, unit = linear.coordinates[k], "N*m" if linear.units[k] == "rad" else "N"
    return Risk(
        "dry-friction", name,
        f"an effort along {name} jumps by {jump:.4g} {unit} with its speed at this state, as of "
        "dry friction: the model leaves the jump out",
        "give it as law.friction of the hinge, or as a linear damping", jump, least, unit,
    )  # fmt: skip


def _sentence(name: str, unit: str, amplitude: float, static: float) -> str:
    """Of one speed: below what it sticks."""
    effort = f"{static:.4g} {'N*m' if unit == 'rad' else 'N'}"
    hinge = name.rpartition(".")[0]
    if not math.isfinite(amplitude):
        return f"{hinge} under efforts below {effort}, at any amplitude, for nothing pushes it back"
    return f"{hinge} below an amplitude of {amplitude:.4g} {unit} or efforts of {effort}"


def _unit(linear: Equations, speed: int) -> str:
    slots = linear.model.layout.hinge_of_speed(speed)
    return slots.u_units[speed - slots.u].removesuffix("/s")


def _stuck_below(linear: Equations, left: list[Rubbing]) -> Array:
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
    sizes = speed_sizes(linear.model)[list(linear.free)]
    stiffness, rows = linear.K * np.outer(sizes, sizes), ways * sizes
    moved = lstsq(stiffness, rows.T, cond=_SOFT, lapack_driver="gelsy")[0]
    missing = np.abs(stiffness @ moved - rows.T).max(axis=0, initial=0.0)
    held = missing <= 1e-6 * np.abs(rows).max(axis=1, initial=0.0)
    flexibility = np.abs(np.einsum("kn,nk->k", rows, moved))
    found = np.array([one.static for one in left]) * flexibility
    far = _FAR * speed_sizes(linear.model)[[one.speed for one in left]]
    return np.where(held & (found > 0) & (found < far), found, np.inf)
