"""Matrices of bodies and hinges put into the premises they are derived from, at random numbers."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np

from mstmm.derive.classical.discrete.body_options import Space
from mstmm.derive.classical.discrete.hinge import Pairing
from mstmm.derive.classical.state_vector import StateVector
from mstmm.derive.definition.derivation import Derivation
from mstmm.derive.verification.kernel_evaluation import evaluate
from mstmm.ir import KernelIR
from tests.support.classical.discrete_bodies import (
    DIGITS,
    Array,
    ParticleBody,
    kernel_inputs,
    random_matrix,
    stack_columns,
)
from tests.support.classical.premises import Premises

Values = dict[str, Array]


def matrices(ir: KernelIR, inputs: dict[str, list[Any]]) -> Values:
    """Outputs of a kernel at 80 digits, as matrices."""
    values, found = evaluate(ir, inputs, digits=DIGITS), {}
    for port in ir.outputs:
        rows, columns = (int(extent) for extent in port.shape)
        found[port.name] = mpmath.matrix(
            [values[port.name][i * columns : (i + 1) * columns] for i in range(rows)]
        )
    return found


def blocks(state: StateVector, values: Array, end: str) -> Values:
    """Blocks of a state vector by name, such as r_I."""
    found, first = {}, 0
    for name, size in zip(state.names, state.sizes, strict=True):
        found[f"{name}_{end}"] = values[first : first + size, 0]
        first += size
    return found


def drawn_state(rng: np.random.Generator, state: StateVector) -> Array:
    """A state vector, 1 last."""
    values = random_matrix(rng, state.length)
    values[state.length - 1] = 1
    return values


def largest(residuals: Values) -> float:
    """Largest magnitude among all residuals."""
    return float(max(mpmath.norm(value, mpmath.inf) for value in residuals.values()))


# --- bodies -----------------------------------------------------------------------------------


def body_residual(
    premises: Premises, ir: KernelIR, body: ParticleBody, rng: np.random.Generator, space: Space
) -> float:
    """How far z_O = U z_I, and W z_I, miss the body's linearised premises at a drawn z_I."""
    with mpmath.workdps(DIGITS):
        found = matrices(ir, kernel_inputs(body, ir))
        state = space.state(body.modes)
        inner = drawn_state(rng, state)
        outer = found["U"] * inner
        start = _start(body, space)
        ends = blocks(state, inner, "I") | blocks(state, outer, "O")
        step = {name: ends[name] - start[name] for name in ends}
        residuals = premises.linearised_residuals(body.values | start, step)
        if body.modes:
            residuals["balance of the modes"] -= found["W"] * inner
        return largest(residuals)


def _start(body: ParticleBody, space: Space) -> Values:
    """The states at which the premises are linearised."""
    v, turns = body.values, space.rotation_count
    none = mpmath.zeros(turns, 1)
    still = mpmath.zeros(body.rigid_count + body.modes, 1)
    angle = v["theta_p"] if space.planar else none
    start = {
        "r_I": v["r_p"], "r_O": v["r_p"] + body.arm(still), "q_O": v["q_p"],
        "q_I": mpmath.zeros(space.translation_count, 1), "m_O": v.get("m_p", none),
        "m_I": v.get("m_pI", none), f"{space.angle}_I": angle, f"{space.angle}_O": angle,
    }  # fmt: skip
    if body.modes:
        start |= {"eta_I": v["eta_p"], "eta_O": v["eta_p"]}
    return start


# --- hinges -----------------------------------------------------------------------------------


def hinge_residual(
    premises: Premises,
    ir: KernelIR,
    derivation: Derivation,
    pair: Pairing,
    rng: np.random.Generator,
) -> float:
    """How far z_O = U_h z_I misses the hinge's premises at a drawn z_I."""
    with mpmath.workdps(DIGITS):
        values = {q.name: random_matrix(rng, q.rows, q.columns) for q in derivation.inputs}
        if "U" in values:
            closing = values["U"].rows - 1
            for j in range(closing + 1):
                values["U"][closing, j] = int(j == closing)
        inner = drawn_state(rng, pair.state_in)
        found = matrices(ir, {name: list(value) for name, value in values.items()})
        outer = found["U_h"] * inner
        ends = blocks(pair.state_in, inner, "I") | blocks(pair.state_out, outer, "O")
        if "U" in values:
            ends |= blocks(pair.state_out, values["U"] * outer, "N")
        start = {name: 0 * value for name, value in ends.items()}
        if "theta_s" in values:
            start["theta_I"] = values["theta_s"]
            start["theta_O"] = values["theta_s"] + values["phi_s"]
        ends, start = _free_turn(ends, start, values, pair)
        step = {name: ends[name] - start[name] for name in ends}
        return largest(premises.linearised_residuals(values | start, step))


def _free_turn(ends: Values, start: Values, values: Values, pair: Pairing) -> tuple[Values, Values]:
    """The hinge's own unknown: all of the angle, or what a pin's sections differ by along a."""
    angle = pair.space.angle
    if "a" in values:
        gap = _section(ends, values, pair, "O") - _section(ends, values, pair, "I")
        axis = values["a"]
        free = axis.T * (gap - values["beta"]) / (axis.T * axis)[0]
    elif "U" in values:
        free = ends[f"{angle}_O"]
    else:
        return ends, start
    return ends | {"x_turn": stack_columns(free)}, start | {"x_turn": 0 * stack_columns(free)}


def _section(ends: Values, values: Values, pair: Pairing, end: str) -> Array:
    modes = pair.inboard if end == "I" else pair.outboard
    turned = ends[f"psi_{end}"]
    if modes:
        turned = turned + values[f"S_{end}"] * (ends[f"eta_{end}"] - values[f"eta_p{end}"])
    return turned
