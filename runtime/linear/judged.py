"""What a linear model cannot say of its scene: states that do not last, and what nothing holds."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from mstmm.arrays import Array
from mstmm.errors import NumericalFailure
from mstmm.printable import abbreviate
from mstmm.risk import RUN, Risk, advice

from ..engine.sizes import speed_sizes
from ..guard.answers import find_state_risks
from .modes import modes
from .operating_point.sticking import friction_risks
from .output.outputs import left_out
from .rotors.later import SAME, apart, later

if TYPE_CHECKING:
    from .equations import Equations

#: Distance from rest, and acceleration per s^2 of what nothing holds, in sizes of coordinates;
#: stiffness that counts as none, in parts.
_STILL, _SOFT = 1e-6, 1e-13
#: Efforts that are rounding, in parts of those that cancel.
_CANCELLED = 1e-11
#: Coordinates up to which matrices are made to look at the state, and up to which all motions are.
_LARGEST, _ALL_MOTIONS = 2000, 400


def find_linear_risks(linear: Equations) -> Iterator[Risk]:
    """Risks of the state and of what the linear model leaves out, the gravest first."""
    state = linear.state
    yield from find_state_risks(linear.model, state.t, state.q, state.u)
    yield from _unsteady(linear)
    if len(linear) <= _LARGEST:
        yield from friction_risks(linear)
    yield from without_effect(linear, linear.V)
    yield from find_omissions(linear)
    if len(linear) <= _ALL_MOTIONS:
        yield from modes(linear, None, None).motion_risks()
    else:
        yield advice(
            "stability-unknown", RUN,
            f"more than {_ALL_MOTIONS} coordinates: not examined for motions that grow or that "
            "nothing pushes back", "look at the slowest modes, modes(count=...)",
        )  # fmt: skip


def find_omissions(linear: Equations) -> Iterator[Risk]:
    """What of the scene a linear model leaves out: controllers, outputs, the time."""
    for one in linear.model.scene.controller:
        yield advice(
            "controller-left-out", f'controller "{one.name}"',
            f'controller "{one.name}" is left out: its inputs ({abbreviate(list(one.outputs))}) '
            "stand still at the values of the scene", "close the loop by the inputs of this model",
        )  # fmt: skip
    for name, why in left_out(linear):
        yield advice(
            "output-left-out", f'output "{name}"', f"output {name} is not among the outputs: {why}",
            "name an output that has a linear form",
        )  # fmt: skip
    if linear.model.packed.system.timed:
        yield advice(
            "time-dependent", RUN, f"loads depend on time: linearised at t = {linear.state.t:g} s",
            "give the time that is meant, t=...",
        )  # fmt: skip


def find_response_risks(linear: Equations) -> Iterator[Risk]:
    """Risks of a linear model for its steady response, which a growing motion prevents."""
    for risk in linear.risks:
        yield replace(risk, doubt=True) if risk.name == "unstable" else risk


def _unsteady(linear: Equations) -> Iterator[Risk]:
    """A state that does not last, or along whose motion the matrices change."""
    leaving = accelerating(linear)
    if leaving:
        yield Risk(
            "unsteady-state", abbreviate(leaving),
            f"the state does not last: {abbreviate(leaving)} accelerate there, so that the model "
            "holds beside the motion through it, and only for a moment",
            "linearise at an equilibrium or a steady motion",
        )  # fmt: skip
    elif len(linear) <= _LARGEST and linear.state.u.any() and _changes(linear):
        yield Risk(
            "changing-coefficients", RUN,
            "the matrices change along the motion of this state: frequencies and growth of one "
            "moment are not those of the motion",
            "simulate the motion, or linearise about a state that keeps its matrices",
        )  # fmt: skip


def without_effect(linear: Equations, effects: Array) -> Iterator[Risk]:
    """Inputs whose effects, columns (n, inputs), are zero."""
    for name, column in zip(linear.inputs, effects.T, strict=True):
        if len(linear) and not column.any():
            yield advice(
                "input-without-effect", f'input "{name}"', f"input {name} has no effect here",
                "choose another input or state",
            )  # fmt: skip


def unrest(linear: Equations) -> bool:
    """Whether closed loops are at a state that does not last, so that accelerations turn rows."""
    if linear.mechanism is None or not accelerating(linear):
        return False
    return not _balanced(linear, linear.mechanism.ways)


def _balanced(linear: Equations, ways: Array) -> bool:
    """Whether what pushes along the motions of a mechanism is rounding of what cancels there, which
    may still move what hardly anything holds."""
    state, tree = linear.state, linear.tree
    efforts = tree.inverse_dynamics(state.t, state.q, state.u, 0 * state.a, tree.start_memory())
    left, whole = np.abs(ways.T @ efforts), np.abs(ways).T @ np.abs(efforts)
    return bool((left <= _CANCELLED * whole).all())


def accelerating(linear: Equations) -> list[str]:
    """Coordinates that leave the state: those further from rest than a small part of their sizes,
    and those that accelerate though nothing holds them."""
    free = list(linear.free)
    a, sizes = linear.state.a[free], speed_sizes(linear.model)[free]
    if not a.any():
        return []
    if len(linear) > _LARGEST:
        away, left = _displacement_by_sweep(linear, a) / sizes, np.zeros(len(a))
    else:
        stiffness = linear.K * np.outer(sizes, sizes)
        pushed = (linear.M @ a) * sizes
        away = np.asarray(np.linalg.lstsq(stiffness, pushed, rcond=_SOFT)[0], dtype=np.float64)
        missing = (pushed - stiffness @ away) / sizes
        left = np.asarray(np.linalg.solve(linear.M, missing) / sizes, dtype=np.float64)
    leaves = (np.abs(away) > _STILL) | (np.abs(left) > _STILL)
    return [linear.coordinates[k] for k in np.flatnonzero(leaves)]


def _displacement_by_sweep(linear: Equations, a: Array) -> Array:
    """(n,) distance from rest, K^-1 M a, without matrices; infinite where K is singular."""
    if linear.mechanism is not None or linear.turning is not None:
        return np.where(a == 0, 0.0, np.inf)
    pencil = linear.pencil
    try:
        pencil.factor(0.0)
    except NumericalFailure:
        return np.where(a == 0, 0.0, np.inf)
    return np.asarray(pencil.solve(pencil.mass(a)), dtype=np.float64)


def _changes(linear: Equations) -> bool:
    """Whether the matrices are others a little further along the motion."""
    there = later(linear)
    return any(apart(getattr(linear, x), getattr(there, x)) > SAME for x in "MCK")
