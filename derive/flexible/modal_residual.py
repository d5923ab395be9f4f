"""Residual, momentum and energy of a flexible body in its floating frame.

The kinetic energy is T = 1/2 yd^T M(eta) yd with yd = [v; w; etad], frame axes, origin o:

        | m 1    -c~      Ct  |      c = c0 + C eta - 1/2 eta^T G eta       Ct = dc / deta
    M = | c~      J       Gt  |      R = R2 + B eta + 1/2 eta^T Z eta       A  = dR / deta
        | Ct^T   Gt^T     M_ff|      J = tr(R) 1 - R                        Gt = P + eta^T Y

truncated after the second order in eta and etad.  Its equations of Boltzmann and Hamel are the
residual; being those of an energy they conserve it to rounding, truncated or not.
"""

from __future__ import annotations

import sympy as sp

from ..definition.derivation import Derivation, Equation, Quantity, tilde, vector
from ..definition.notation import part, stack
from ..equations.riccati_sweep import MOTION, E, S

# --- arrays shared by the kernels -----------------------------------------------------------------
# The displacement of a material point r0 is u = phi eta - 1/2 eta^T g eta (g: second order, such as
# foreshortening by bending, or deflection by bending and twist).  All inertia integrals are moments
# of the fields [1, r0, phi, g] under the mass density rho:
#
#     m, c0 = int r0, R2_ab = int r0_a r0_b            C_a = int phi_a,     E_ab = int r0_a phi_b
#     F_ab = int phi_a phi_b^T,  M = sum_a F_aa        G_a = int g_a,       X_ab = int r0_a g_b
#
#     B_ab = E_ab + E_ba              Z_ab = F_ab + F_ab^T - X_ab - X_ba    (ab = xx xy xz yy yz zz)
#     P_i = eps_iab E_ab              Y_i = eps_iab (F_ab - X_ab)

#: Number of modes.
N = sp.Symbol("n", integer=True, positive=True)

AXES = ("x", "y", "z")
PAIRS = ("xx", "xy", "xz", "yy", "yz", "zz")

SOURCES = (
    "Shabana, Dynamics of Multibody Systems, ch. 5 (floating frame of reference)",
    "Schwertassek, Wallrapp, Dynamik flexibler Mehrkoerpersysteme (invariants, unit loads)",
    "Rui, Wang, Zhang, ch. 8 (rigid-flexible systems)",
)


def modal_columns(name: str, rows: int, meaning: str = "", unit: str = "") -> Quantity:
    """Array with a column per mode."""
    return Quantity(sp.MatrixSymbol(name, rows, N), unit, meaning)


def modal_pair(name: str, meaning: str = "", unit: str = "", accumulate: bool = False) -> Quantity:
    """Array with a row and a column per mode."""
    return Quantity(sp.MatrixSymbol(name, N, N), unit, meaning, accumulate=accumulate)


def modal_vector(
    name: str, meaning: str = "", unit: str = "", accumulate: bool = False
) -> Quantity:
    """One number per mode."""
    return Quantity(sp.MatrixSymbol(name, N, 1), unit, meaning, accumulate=accumulate)


RIGID = Quantity(
    sp.MatrixSymbol("p", 10, 1), "", "m, c0 (3), R2 (xx xy xz yy yz zz); frame axes, about o"
)
C = modal_columns("C", 3, "int rho phi")
P = modal_columns("P", 3, "int rho r0 x phi")
B = modal_columns("B", 6, "first derivatives of the second moments: E_ab + E_ba")
Z = tuple(modal_pair(f"Z_{ab}", f"second derivative of the second moment {ab}") for ab in PAIRS)
Y = tuple(modal_pair(f"Y_{i}", f"(int rho phi x phi - r0 x g)_{i}") for i in AXES)
G = tuple(modal_pair(f"G_{a}", f"int rho g_{a}") for a in AXES)
MASS = modal_pair("M", "int rho phi . phi")
STIFFNESS = modal_pair("K", "stiffness")
DAMPING = modal_pair("D", "damping")
ETA = modal_vector("eta", "modal coordinates")
ETAD = modal_vector("etad", "modal speeds")

#: Moments of one density: data of the kernels `residual` and `momentum`.
MOMENTS = (RIGID, C, P, B, *Z, *Y, *G, MASS)


def symmetric_matrix(symmetric: sp.Basic) -> sp.ImmutableDenseMatrix:
    """Symmetric 3 x 3 matrix from a column xx xy xz yy yz zz."""
    xx, xy, xz, yy, yz, zz = (symmetric[i, 0] for i in range(6))
    return sp.ImmutableDenseMatrix([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def inertia_of_second_moments(second: sp.Basic) -> sp.ImmutableDenseMatrix:
    """Moments of inertia tr(R) 1 - R of second moments R (6, in a column)."""
    second_moment_matrix = symmetric_matrix(second)
    return sp.ImmutableDenseMatrix(
        (second_moment_matrix[0, 0] + second_moment_matrix[1, 1] + second_moment_matrix[2, 2])
        * sp.eye(3)
        - second_moment_matrix
    )


# --- residual -------------------------------------------------------------------------------------

eta, etad = ETA.symbol, ETAD.symbol
HALF = sp.Rational(1, 2)

S_RF = modal_columns("S_rf", 6, "rows of the frame, columns of the modes: [Ct; Gt]")
S_FF = modal_pair("S_ff", "rows and columns of the modes")
E_F = modal_vector("e_f", "load required by the modes")
SECOND_MOMENT_DERIVATIVES = modal_columns("A", 6, "derivatives of the second moments by the modes")


def _geometry_equations() -> tuple[Equation, ...]:
    """[Ct; Gt], A, and the moments c, R of the deformed body."""
    rows = [C.symbol[a, :] - eta.T * g.symbol for a, g in enumerate(G)]
    rows += [P.symbol[i, :] + eta.T * y.symbol for i, y in enumerate(Y)]
    second_moments = [B.symbol[k, :] + eta.T * z.symbol for k, z in enumerate(Z)]
    return (
        Equation("[Ct; Gt]", S_RF.symbol, stack(*rows)),
        Equation("A = dR / deta", SECOND_MOMENT_DERIVATIVES.symbol, stack(*second_moments)),
        Equation("(C + Ct) eta / 2", vector("c_s", 3), _half_sum(C.symbol, S_RF.symbol[:3, :])),
        Equation("first moments", vector("c", 3), part(RIGID.symbol, 1) + vector("c_s", 3)),
        Equation(
            "(B + A) eta / 2",
            vector("R_s", 6),
            _half_sum(B.symbol, SECOND_MOMENT_DERIVATIVES.symbol),
        ),
        Equation("second moments", vector("R", 6), part(RIGID.symbol, 4, 6) + vector("R_s", 6)),
    )


def _half_sum(at_rest: sp.Basic, now: sp.Basic) -> sp.Basic:
    return HALF * (at_rest * eta) + HALF * (now * eta)


def _mass_equation() -> Equation:
    c, m = part(vector("c", 3), 0), RIGID.symbol[0, 0]
    lever = tilde(c)
    blocks = sp.BlockMatrix(
        [
            [sp.ImmutableDenseMatrix(m * sp.eye(3)), -lever],
            [lever, inertia_of_second_moments(vector("R", 6))],
        ]
    )
    return Equation("frame part of M", S.symbol, blocks)


def _rate_equations() -> tuple[Equation, ...]:
    """Rates of the moments and of [Ct; Gt] in the direction of etad."""
    rotation_terms = [(etad.T * y.symbol) * etad for y in Y]
    translation_terms = [-(etad.T * g.symbol) * etad for g in G]
    return (
        Equation("rate of c", vector("cd", 3), S_RF.symbol[:3, :] * etad),
        Equation("Gt etad", vector("l_s", 3), S_RF.symbol[3:, :] * etad),
        Equation("rate of R", vector("Rd", 6), SECOND_MOMENT_DERIVATIVES.symbol * etad),
        Equation(
            "(rate of [Ct; Gt]) etad", vector("s_s", 6), stack(*translation_terms, *rotation_terms)
        ),
    )


def _spin_weights(w: sp.Basic) -> sp.ImmutableDenseMatrix:
    """Coefficients of R (6) in w^T J w."""
    x, y, z = (w[i, 0] for i in range(3))
    return sp.ImmutableDenseMatrix(
        [y * y + z * z, -2 * x * y, -2 * x * z, x * x + z * z, -2 * y * z, x * x + y * y]
    )


def residual() -> Derivation:
    """M [a; wd] + h and its modal rows at a motion (w, wd, a of the frame) with etadd = 0.

    h = [w~ w~ c + 2 w~ cd + Ctd etad;  Jd w + Gtd etad + w~ (J w + Gt etad)]
    h_f = sum_i w_i (Y_i^T - Y_i) etad - 1/2 A^T (coefficients of R in w^T J w) + K eta + D etad
    """
    motion = MOTION.symbol
    w, wd, a = (part(motion, k) for k in (0, 3, 6))
    spin = tilde(w)
    c, cd = part(vector("c", 3), 0), part(vector("cd", 3), 0)
    angular_momentum = inertia_of_second_moments(vector("R", 6)) * w + part(vector("l_s", 3), 0)
    rate_terms = part(vector("s_s", 6), 0, 6)
    frame_acceleration = sp.ImmutableDenseMatrix([*a, *wd])
    force = spin * (spin * c) + 2 * spin * cd + rate_terms[:3, :]
    moment = (
        inertia_of_second_moments(vector("Rd", 6)) * w + rate_terms[3:, :] + spin * angular_momentum
    )
    bias = sp.ImmutableDenseMatrix([*force, *moment])
    gyroscopic = sum(
        (w[i, 0] * (y.symbol.T * etad) - w[i, 0] * (y.symbol * etad) for i, y in enumerate(Y)),
        sp.ZeroMatrix(N, 1),
    )
    centrifugal = SECOND_MOMENT_DERIVATIVES.symbol.T * sp.ImmutableDenseMatrix(
        -HALF * _spin_weights(w)
    )
    elastic = STIFFNESS.symbol * eta + DAMPING.symbol * etad
    return Derivation(
        "modal",
        "residual of a flexible body in its floating frame",
        (*MOMENTS, STIFFNESS, DAMPING, ETA, ETAD, MOTION),
        (S, S_RF, SECOND_MOMENT_DERIVATIVES, S_FF, E, E_F),
        (
            *_geometry_equations(),
            _mass_equation(),
            Equation("modal part of M", S_FF.symbol, MASS.symbol),
            *_rate_equations(),
            Equation("bias", vector("h", 6), bias),
            Equation("e = M [a; wd] + h", E.symbol, S.symbol * frame_acceleration + vector("h", 6)),
            Equation(
                "modal rows",
                E_F.symbol,
                S_RF.symbol.T * frame_acceleration + gyroscopic + centrifugal + elastic,
            ),
        ),
        sources=SOURCES,
    )


V_FRAME = Quantity(vector("v", 3), "m/s", "velocity of the frame's origin, frame axes")
W_FRAME = Quantity(vector("w", 3), "rad/s", "angular velocity of the frame, frame axes")


def momentum() -> Derivation:
    """dT/d[v; w; etad] = M [v; w; etad], and T.

    With the density of a viscous drag in place of the mass density, the momentum is the drag
    load.
    """
    frame_momentum = Quantity(vector("h", 6), "N*s, N*m*s", "momentum, moment of momentum about o")
    modal_momentum = modal_vector("h_f", "modal momentum")
    energy = Quantity(vector("T", 1), "J", "kinetic energy")
    twist = sp.ImmutableDenseMatrix([*part(V_FRAME.symbol, 0), *part(W_FRAME.symbol, 0)])
    twice = twist.T * frame_momentum.symbol + modal_momentum.symbol.T * etad
    return Derivation(
        "modal",
        "momentum and kinetic energy of a flexible body",
        (*MOMENTS, ETA, ETAD, V_FRAME, W_FRAME),
        (S, S_RF, SECOND_MOMENT_DERIVATIVES, frame_momentum, modal_momentum, energy),
        (
            *_geometry_equations(),
            _mass_equation(),
            Equation(
                "momentum of the frame",
                frame_momentum.symbol,
                S.symbol * twist + S_RF.symbol * etad,
            ),
            Equation(
                "modal momentum", modal_momentum.symbol, S_RF.symbol.T * twist + MASS.symbol * etad
            ),
            Equation("T", energy.symbol, HALF * twice),
        ),
        sources=SOURCES,
    )


def strain_energy() -> Derivation:
    """V = 1/2 eta^T K eta, and the power etad^T D etad dissipated by damping."""
    potential = Quantity(vector("V", 1), "J", "strain energy")
    damping_power = Quantity(vector("W_d", 1), "W", "power lost in damping")
    return Derivation(
        "modal",
        "strain energy and damping of a flexible body",
        (STIFFNESS, DAMPING, ETA, ETAD),
        (potential, damping_power),
        (
            Equation("V", potential.symbol, HALF * (eta.T * STIFFNESS.symbol * eta)),
            Equation("damping", damping_power.symbol, etad.T * DAMPING.symbol * etad),
        ),
        sources=SOURCES,
    )
