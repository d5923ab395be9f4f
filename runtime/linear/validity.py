"""Validity limits of a linear model: unsteady states, omitted effects and instability."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array
from mstmm.display import abbreviate_names
from mstmm.risk import RUN, Risk, information

from ..result.checks.answer_checks import find_state_risks
from .input_channels import GROUND, Channel
from .mode_solvers import modes
from .modes import INPUT_RISKS, OUTPUT_LEFT_OUT
from .operating_point.departure import LARGEST, MATRICES, Departure, find_changes, find_departure
from .operating_point.later_states import LaterStates
from .operating_point.omitted_effects import (
    find_start_risks,
    friction_risks,
    independent_motions,
    saturation_risks,
)
from .outputs import unavailable_outputs
from .rotors import find_blades

if TYPE_CHECKING:
    from .linear_equations import LinearEquations

#: Efforts that are rounding, relative to those that cancel.
_CANCELLED = 1e-11
#: Largest number of coordinates for which all modes are computed.
_ALL_MOTIONS = 400


def find_linear_risks(linear: LinearEquations) -> Iterator[Risk]:
    """Risks of the operating point and of omitted effects, most severe first."""
    state = linear.state
    yield from find_state_risks(linear.model, state.t, state.q, state.u)
    unsteady = list(_unsteady(linear))
    yield from unsteady
    if len(linear) <= LARGEST:
        yield from friction_risks(linear)
    yield from saturation_risks(linear, independent_motions(linear))
    yield from find_start_risks(linear, _ALL_MOTIONS)
    changing = {risk.element for risk in unsteady}
    yield from (
        risk for risk in ineffective_input_risks(linear, linear.V) if risk.element not in changing
    )
    yield from find_omissions(linear)
    if len(linear) <= _ALL_MOTIONS:
        yield from modes(linear, None, None).motion_risks()
    else:
        yield information(
            "stability-unknown", RUN,
            f"more than {_ALL_MOTIONS} coordinates: not examined for unstable or unrestrained "
            "motions", "compute the lowest modes, modes(count=...)",
        )  # fmt: skip


def find_omissions(linear: LinearEquations) -> Iterator[Risk]:
    """Risks of omissions of a linear model: controllers, outputs, dependence on time."""
    for controller in linear.model.scene.controller:
        yield information(
            "controller-left-out",
            f'controller "{controller.name}"',
            f'controller "{controller.name}" is left out: its inputs '
            f"({abbreviate_names(list(controller.outputs))}) "
            "are constant, with the values of the scene",
            "close the loop by the inputs of this model",
        )
    for name, why in unavailable_outputs(linear):
        yield information(
            "output-left-out", f'output "{name}"', f"output {name} is not among the outputs: {why}",
            "use an output that has a linear form",
        )  # fmt: skip
    if linear.model.packed_scene.system.has_timed_loads:
        yield information(
            "time-dependent", RUN, f"loads depend on time: linearised at t = {linear.state.t:g} s",
            "give the intended time, t=...",
        )  # fmt: skip


def find_response_risks(
    linear: LinearEquations, pushes: Sequence[Channel], are_outputs_chosen: bool = False
) -> Iterator[Risk]:
    """Risks of a linear model for its steady-state response to inputs.

    Instability is an objection because it prevents a steady state.  Inputs and outputs that were
    not requested are left out.
    """
    input_elements = {f'input "{channel.name}"' for channel in pushes}
    for risk in linear.risks:
        if risk.name in INPUT_RISKS and risk.element not in input_elements:
            continue
        if not (are_outputs_chosen and risk.name == OUTPUT_LEFT_OUT):
            yield replace(risk, invalidates=True) if risk.name == "unstable" else risk


def _unsteady(linear: LinearEquations) -> Iterator[Risk]:
    """Risks of an unsteady state, and of matrices and inputs that change along its motion."""
    later = LaterStates(linear)
    leaving = find_departure(linear, later)
    if leaving is not None:
        yield departure_risk(linear.state.t, leaving, later.cause)
    if len(linear) > LARGEST:
        if later.compared_states:
            yield information(
                "stability-unknown", RUN,
                f"more than {LARGEST} coordinates: not examined for matrices that change along "
                "the motion or with time", "analyse a smaller part of the scene",
            )  # fmt: skip
        return
    input_channels = (
        *linear.input_channels,
        *(() if linear.disturbance_names == GROUND else linear.disturbance_channels),
    )
    changing = find_changes(linear, later, input_channels)
    if MATRICES in changing:
        yield Risk(
            "changing-coefficients", RUN,
            "the matrices change along the motion of this state or with time: frequencies and "
            "growth rates at one time are not those of the motion",
            "use to_fixed_frame(), which has constant matrices where the rotor is isotropic"
            if find_blades(linear)
            else "simulate the motion, or linearise about a state that keeps its matrices",
        )  # fmt: skip
    yield from (changing_risk(linear, name) for name in changing if name != MATRICES)


def changing_risk(linear: LinearEquations, name: str) -> Risk:
    """Risk of an input column or output row that changes along the motion or with time."""
    return Risk(
        "changing-input", f'input "{name}"',
        f"the effect of {name} changes along the motion of this state or with time: the model uses "
        f"that at t = {linear.state.t:g} s", "use efforts and speeds of hinges, or simulate",
    )  # fmt: skip


def departure_risk(t: float, leaving: Departure, cause: str) -> Risk:
    """Risk of an unsteady state at t (s)."""
    names = abbreviate_names(leaving.coordinates)
    if leaving.t == t:
        means = (
            f"the state is not steady: {names} accelerate, so that the model describes deviations "
            "from the motion through it, for a short time only"
        )
    else:
        change = "changes slowly" if leaving.is_small else "is not steady"
        means = f"the state of t = {t:g} s {change}: {cause}, {leaving} moves {names}"
    return Risk(
        "unsteady-state", names, means, "use an equilibrium or a steady motion, or simulate",
        abs(leaving.effort), None, leaving.unit, invalidates=not leaving.is_small,
    )  # fmt: skip


def ineffective_input_risks(linear: LinearEquations, effects: Array) -> Iterator[Risk]:
    """Risks of inputs whose columns in `effects` (n, inputs) are zero."""
    for name, column in zip(linear.input_names, effects.T, strict=True):
        if len(linear) and not column.any():
            yield information(
                "input-without-effect", f'input "{name}"', f"input {name} has no effect here",
                "use another input or state",
            )  # fmt: skip


def is_unsteady(linear: LinearEquations) -> bool:
    """Whether closed loops are at an unsteady state, so that accelerations rotate rows."""
    if linear.constrained_motion is None or find_departure(linear) is None:
        return False
    return not _is_balanced(linear, linear.constrained_motion.motion_basis)


def _is_balanced(linear: LinearEquations, motions: Array) -> bool:
    """Whether efforts along the independent motions of a mechanism are rounding errors.

    They are relative to the efforts that cancel.  Rounding may still move weakly constrained
    coordinates.
    """
    state, tree = linear.state, linear.open_tree
    efforts = tree.inverse_dynamics(state.t, state.q, state.u, 0 * state.udot, tree.start_memory())
    left, whole = np.abs(motions.T @ efforts), np.abs(motions).T @ np.abs(efforts)
    return bool((left <= _CANCELLED * whole).all())
