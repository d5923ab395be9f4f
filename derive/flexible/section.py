"""Sections of a flexible body as ports: pose, subspace and bias relative to the frame.

The rotation of a section is exp(Psi~) with the rotation vector Psi = theta eta - 1/2 eta^T h eta,
consistently in pose, rates and virtual power.  Its angular velocity is T(Psi) Psid in the section's
axes, T(-Psi) Psid in the frame's, T(Psi) = 1 - b Psi~ + c Psi~ Psi~.  The even functions

    a = sin t / t,   b = (1 - cos t) / t^2,   c = (t - sin t) / t^3,    t^2 = s = Psi . Psi

are evaluated by their series in s, which are exact to rounding up to the largest accepted rotation.
There is therefore no special case of small angles, and planar bending folds to plain sines and
cosines.
"""

from __future__ import annotations

import sympy as sp

from ..definition.derivation import Derivation, Equation, Quantity, tilde, vector
from ..definition.notation import part, stack
from .modal_residual import ETA, ETAD, SOURCES, modal_columns, modal_pair, modal_vector

eta, etad = ETA.symbol, ETAD.symbol

#: Largest rotation of a section relative to its frame, rad.
MAX_SECTION_ROTATION = sp.Rational(3, 2)
#: Terms of the series.
SERIES_TERM_COUNT = 11

POINT = Quantity(vector("r", 3), "m", "section point at rest from o, frame axes")
PHI = modal_columns("phi", 3, "displacement of the point per mode")
THETA = modal_columns("theta", 3, "rotation vector of the section per mode")
SECOND_DISPLACEMENTS = tuple(
    modal_pair(f"g_{a}", f"displacement of second order along {a}: -1/2 eta^T g eta") for a in "xyz"
)
SECOND_ROTATIONS = tuple(
    modal_pair(f"h_{a}", f"rotation vector of second order about {a}: -1/2 eta^T h eta")
    for a in "xyz"
)
JACOBIAN = modal_columns("Phi", 6, "rates of point and rotation vector per modal speed")

END_ROTATION = Quantity(sp.MatrixSymbol("R_end", 3, 3), "", "rotation, end axes to section axes")
POSITION = Quantity(vector("x", 3), "m", "section point from o, frame axes")
ROTATION_VECTOR = Quantity(vector("Psi", 3), "rad", "rotation vector of the section, frame axes")
POSITION_RATE = Quantity(vector("xd", 3), "m/s", "rate of x")
ROTATION_VECTOR_RATE = Quantity(vector("Psid", 3), "rad/s", "rate of Psi")
POSITION_BIAS = Quantity(vector("xdd", 3), "m/s2", "second rate of x at etadd = 0")
ROTATION_VECTOR_BIAS = Quantity(vector("Psidd", 3), "rad/s2", "second rate of Psi at etadd = 0")
SECTION_MOTION = (
    POSITION,
    ROTATION_VECTOR,
    POSITION_RATE,
    ROTATION_VECTOR_RATE,
    POSITION_BIAS,
    ROTATION_VECTOR_BIAS,
)


def section() -> Derivation:
    """Position and rotation vector of a section, their rates, and their modal derivatives."""
    at_rest = [field.symbol[a, :] for field in (PHI, THETA) for a in range(3)]
    second_order = [g.symbol for g in (*SECOND_DISPLACEMENTS, *SECOND_ROTATIONS)]
    rows = [row - eta.T * g for row, g in zip(at_rest, second_order, strict=True)]
    second_rates = [-(etad.T * g) * etad for g in second_order]
    point_rows, rotation_rows = JACOBIAN.symbol[:3, :], JACOBIAN.symbol[3:, :]
    return Derivation(
        "modal",
        "section of a flexible body",
        (POINT, PHI, THETA, *SECOND_DISPLACEMENTS, *SECOND_ROTATIONS, ETA, ETAD),
        (JACOBIAN, *SECTION_MOTION),
        (
            Equation("rates per mode", JACOBIAN.symbol, stack(*rows)),
            Equation(
                "x = r + phi eta - eta^T g eta / 2",
                POSITION.symbol,
                POINT.symbol + _displacement_of_rates(PHI.symbol, point_rows),
            ),
            Equation(
                "Psi", ROTATION_VECTOR.symbol, _displacement_of_rates(THETA.symbol, rotation_rows)
            ),
            Equation("xd", POSITION_RATE.symbol, point_rows * etad),
            Equation("Psid", ROTATION_VECTOR_RATE.symbol, rotation_rows * etad),
            Equation("xdd", POSITION_BIAS.symbol, stack(*second_rates[:3])),
            Equation("Psidd", ROTATION_VECTOR_BIAS.symbol, stack(*second_rates[3:])),
        ),
        sources=SOURCES,
    )


def _displacement_of_rates(at_rest: sp.Basic, now: sp.Basic) -> sp.Basic:
    """phi eta - 1/2 eta^T g eta from the rates phi at rest and phi - eta^T g now."""
    half = sp.Rational(1, 2)
    return half * (at_rest * eta) + half * (now * eta)


def even_series(
    first: int, s: sp.Expr, derivative: bool = False, term_count: int = SERIES_TERM_COUNT
) -> sp.Expr:
    """sum_k (-s)^k / (2 k + first)!, or its derivative by s, in Horner's form."""
    signs = [sp.Integer((-1) ** k) / sp.factorial(2 * k + first) for k in range(term_count)]
    terms = [k * c for k, c in enumerate(signs)][1:] if derivative else signs
    value = sp.Integer(0)
    for coefficient in reversed(terms):
        value = coefficient + s * value
    return value


SQUARE, COEFFICIENTS = vector("s", 1), vector("abc", 5)


def _coefficient_equations() -> tuple[Equation, ...]:
    psi, psid = part(ROTATION_VECTOR.symbol, 0), part(ROTATION_VECTOR_RATE.symbol, 0)
    s = SQUARE[0, 0]
    rate = 2 * sum(p * d for p, d in zip(psi, psid, strict=True))
    values = [even_series(k, s) for k in (1, 2, 3)]
    values += [rate * even_series(k, s, derivative=True) for k in (2, 3)]
    return (
        Equation("s = Psi . Psi", SQUARE, sp.ImmutableDenseMatrix([sum(p * p for p in psi)])),
        Equation("a, b, c, rates of b and c", COEFFICIENTS, sp.ImmutableDenseMatrix(values)),
    )


def _rotation_matrix() -> sp.ImmutableDenseMatrix:
    a, b = COEFFICIENTS[0, 0], COEFFICIENTS[1, 0]
    turn = tilde(part(ROTATION_VECTOR.symbol, 0))
    return sp.ImmutableDenseMatrix(sp.eye(3) + a * turn + b * (turn * turn))


def _tangent_operator(sign: int) -> sp.ImmutableDenseMatrix:
    """T(sign Psi)."""
    b, c = COEFFICIENTS[1, 0], COEFFICIENTS[2, 0]
    turn = tilde(part(ROTATION_VECTOR.symbol, 0))
    return sp.ImmutableDenseMatrix(sp.eye(3) - sign * b * turn + c * (turn * turn))


def _spin_rate(sign: int) -> sp.ImmutableDenseMatrix:
    """d/dt (T(sign Psi) Psid) at etadd = 0."""
    c, bd, cd = (COEFFICIENTS[k, 0] for k in (2, 3, 4))
    turn, rate = (
        tilde(part(ROTATION_VECTOR.symbol, 0)),
        tilde(part(ROTATION_VECTOR_RATE.symbol, 0)),
    )
    cross_term = turn * part(ROTATION_VECTOR_RATE.symbol, 0)
    tangent_term = _tangent_operator(sign) * part(ROTATION_VECTOR_BIAS.symbol, 0)
    return sp.ImmutableDenseMatrix(
        tangent_term - sign * bd * cross_term + cd * (turn * cross_term) + c * (rate * cross_term)
    )


MOTION_OUTPUTS = (
    Quantity(sp.MatrixSymbol("R", 3, 3), "", "rotation, outboard axes to inboard axes"),
    Quantity(vector("d", 3), "m", "outboard point from the inboard one, inboard axes"),
    Quantity(
        sp.MatrixSymbol("H6", 6, 6), "", "subspace by [xd; Psid], rows v then w, outboard axes"
    ),
    Quantity(vector("v", 3), "m/s", "relative velocity, outboard axes"),
    Quantity(vector("w", 3), "rad/s", "relative angular velocity, outboard axes"),
    Quantity(vector("c", 6), "m/s2, rad/s2", "relative acceleration at etadd = 0, outboard axes"),
)


def _motion_derivation(title: str, definitions: tuple[Equation, ...]) -> Derivation:
    return Derivation(
        "modal",
        title,
        (END_ROTATION, *SECTION_MOTION),
        MOTION_OUTPUTS,
        (*_coefficient_equations(), *definitions),
        sources=SOURCES,
    )


def _velocity_equations(subspace: sp.Basic) -> tuple[Equation, ...]:
    h6 = MOTION_OUTPUTS[2].symbol
    rates = stack(POSITION_RATE.symbol, ROTATION_VECTOR_RATE.symbol)
    velocities = vector("vw", 6)
    return (
        Equation("H6", h6, subspace),
        Equation("relative velocities", velocities, h6 * rates),
        Equation("v", MOTION_OUTPUTS[3].symbol, part(velocities, 0)),
        Equation("w", MOTION_OUTPUTS[4].symbol, part(velocities, 3)),
    )


def end_motion() -> Derivation:
    """Motion from the floating frame (inboard) to an end (outboard), as a hinge kernel."""
    rotation, end_rotation = MOTION_OUTPUTS[0].symbol, END_ROTATION.symbol
    zero_block = sp.zeros(3, 3)
    subspace = sp.BlockMatrix(
        [[rotation.T, zero_block], [zero_block, end_rotation.T * _tangent_operator(1)]]
    )
    return _motion_derivation(
        "end of a flexible body relative to its floating frame",
        (
            Equation("rotation", rotation, _rotation_matrix() * end_rotation),
            Equation("place", MOTION_OUTPUTS[1].symbol, part(POSITION.symbol, 0)),
            *_velocity_equations(subspace),
            Equation(
                "bias",
                MOTION_OUTPUTS[5].symbol,
                stack(rotation.T * POSITION_BIAS.symbol, end_rotation.T * _spin_rate(1)),
            ),
        ),
    )


def frame_motion() -> Derivation:
    """Motion from the supported end (inboard) to the floating frame (outboard).

    The inverse of `end_motion`: w = -W with W = T(-Psi) Psid the spin of the section in frame
    axes, v = W x x - xd.
    """
    rotation, end_rotation = MOTION_OUTPUTS[0].symbol, END_ROTATION.symbol
    lever = tilde(part(POSITION.symbol, 0))
    spin, rate = vector("W", 3), vector("Wd", 3)
    zero_block = sp.zeros(3, 3)
    subspace = sp.BlockMatrix(
        [
            [-sp.ImmutableDenseMatrix(sp.eye(3)), -lever * _tangent_operator(-1)],
            [zero_block, -_tangent_operator(-1)],
        ]
    )
    turn, x = tilde(part(spin, 0)), part(POSITION.symbol, 0)
    relative_velocity = turn * x
    linear = (
        tilde(part(rate, 0)) * x
        + 2 * turn * part(POSITION_RATE.symbol, 0)
        - part(POSITION_BIAS.symbol, 0)
        - turn * relative_velocity
    )
    return _motion_derivation(
        "floating frame relative to the supported end of the body",
        (
            Equation("rotation", rotation, end_rotation.T * _rotation_matrix().T),
            Equation("place", MOTION_OUTPUTS[1].symbol, -rotation * POSITION.symbol),
            *_velocity_equations(subspace),
            Equation("spin of the section", spin, -part(MOTION_OUTPUTS[4].symbol, 0)),
            Equation("its rate", rate, _spin_rate(-1)),
            Equation("bias", MOTION_OUTPUTS[5].symbol, stack(linear, -part(rate, 0))),
        ),
    )


def rotation_guards() -> tuple[tuple[sp.Basic, int, str], ...]:
    """Guards of the section rotation: range of the series and of the model."""
    text = (
        f"a section rotates by more than {MAX_SECTION_ROTATION} rad relative to its floating frame"
    )
    return ((SQUARE[0, 0] < MAX_SECTION_ROTATION**2, 1, text),)


def subspace() -> Derivation:
    """H = H6 Phi: relative velocity of a port per modal speed."""
    h = modal_columns("H", 6, "motion subspace of the modes, rows v then w, outboard axes")
    return Derivation(
        "modal",
        "subspace of a port",
        (MOTION_OUTPUTS[2], JACOBIAN),
        (h,),
        (Equation("H = H6 Phi", h.symbol, MOTION_OUTPUTS[2].symbol * JACOBIAN.symbol),),
        sources=SOURCES,
    )


def prescribed_bias() -> Derivation:
    """Bias of a port with prescribed modal accelerations s: c + H s."""
    h = modal_columns("H", 6, "motion subspace of the modes")
    s = modal_vector("s", "prescribed modal accelerations")
    total = Quantity(vector("c_s", 6), "", "relative acceleration")
    return Derivation(
        "modal",
        "bias of a port with prescribed modal accelerations",
        (h, s, MOTION_OUTPUTS[5]),
        (total,),
        (Equation("c + H s", total.symbol, MOTION_OUTPUTS[5].symbol + h.symbol * s.symbol),),
        sources=SOURCES,
    )
