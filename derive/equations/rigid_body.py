"""Rigid body as used by the sweep: accelerations out, forces in.

One input end I, any number of output ends O_1, O_2, ..., external forces and moments at any points;
full inertia about I.  The coefficients of the accelerations are extracted from the integrals of
`newton_euler`, not transcribed.
"""

from __future__ import annotations

from dataclasses import replace

import sympy as sp

from ..definition.derivation import Derivation, Equation, Quantity, tilde, vector
from ..definition.notation import Matrix, Tilde, explicit
from . import newton_euler as ne
from .newton_euler import from_inertia_tensor

SOURCE = "Rui, Wang, Zhang, Transfer Matrix Method for Multibody Systems, Wiley 2019, ch. 5"

MASS = sp.MatrixSymbol("M", 1, 1)
CENTER = vector("r_IC", 3)
INERTIA = sp.MatrixSymbol("J_I", 3, 3)
OMEGA = vector("omega", 3)

#: Quantities of every rigid body, in any common axes (body or inertial).
BODY_INPUTS = (
    Quantity(MASS, "kg", "mass"),
    Quantity(CENTER, "m", "mass centre from the input end I"),
    Quantity(INERTIA, "kg*m2", "inertia tensor about I", symmetric=True),
    Quantity(OMEGA, "rad/s", "angular velocity of the body"),
)


def inertial_wrench(acceleration: sp.MatrixSymbol) -> Matrix:
    """[int a dm; int r x a dm] about I, with a = [acceleration of I; angular acceleration].

    6 x 1: the integrals of `newton_euler` with this body's data in place of their symbols.
    """
    a = explicit(acceleration)
    inertia = explicit(INERTIA)
    symmetric = Matrix(3, 3, lambda i, j: inertia[min(i, j), max(i, j)])
    body = from_inertia_tensor(MASS[0, 0], explicit(CENTER), symmetric)
    names = dict(zip((*ne.A0, *ne.OMEGADOT), a, strict=True))
    names |= dict(zip(ne.OMEGA, explicit(OMEGA), strict=True))
    wrench = ne.inertial_force(body).col_join(ne.euler_form(body))
    return Matrix(wrench.xreplace(names))


def rigid_body(outputs: int = 1, loads: int = 0) -> Derivation:
    """f_I = mass_matrix a_I + bias + sum over outputs of X_k^T f_k, a_k = X_k a_I + b_k.

    a = [acceleration of the end; angular acceleration], f = [force; moment], the wrench of the
    inboard on the outboard side.  `loads` external wrenches act at points r_L1, r_L2, ... .
    """
    accelerations = vector("a_I", 6)
    wrench = inertial_wrench(accelerations)
    mass_matrix = wrench.jacobian(explicit(accelerations))
    bias = (wrench - mass_matrix * explicit(accelerations)).applyfunc(sp.expand)
    ends = [_output(k + 1) for k in range(outputs)]
    acting = [_load(k + 1) for k in range(loads)]
    for point, force, moment in acting:
        bias -= explicit(force).col_join(tilde(point) * explicit(force) + explicit(moment))
    definitions = [
        Equation("mass matrix", sp.MatrixSymbol("mass_matrix", 6, 6), Matrix(mass_matrix)),
        Equation("bias wrench", vector("bias", 6), Matrix(bias)),
    ]
    for end, shift, centripetal in ends:
        definitions += [
            Equation("rigid shift to the output end", shift, _shift(explicit(end))),
            Equation("centripetal acceleration", centripetal, _centripetal(explicit(end))),
        ]
    return Derivation(
        element="body_rigid",
        title=f"rigid body with {outputs} output end(s) and {loads} external load(s)",
        inputs=(*BODY_INPUTS, *_input_quantities(ends, acting)),
        outputs=_output_quantities(ends),
        definitions=tuple(definitions),
        premises=_premises(ends, acting),
        sources=(f"{SOURCE}, (5.19) to (5.25)",),
        notes=("Any axes, the same for all arguments.",),
    )


def newton_euler_form() -> Derivation:
    """Single body, free at its output ends, in the parameters of the element `rigid`.

    These are mass = M, the column mc = M r_IC and the tensor J = J_I.
    """
    return replace(
        rigid_body(outputs=0),
        title="Newton and Euler about the input end I, and the mass matrix that follows",
        notes=(
            "rdd_I is the acceleration of I, omegadot the angular acceleration; q_I and m_I are "
            "the force and the moment that this motion requires there. a_I is [rdd_I; omegadot] "
            "and f_I is [q_I; m_I], so that f_I = mass_matrix a_I + bias.",
            "Parameters of the element are mass = M, mc = M r_IC and J = J_I.",
        ),
    )


Triple = tuple[sp.MatrixSymbol, sp.MatrixSymbol, sp.MatrixSymbol]


def _output(k: int) -> Triple:
    return vector(f"r_O{k}", 3), sp.MatrixSymbol(f"X_{k}", 6, 6), vector(f"b_{k}", 6)


def _load(k: int) -> Triple:
    return vector(f"r_L{k}", 3), vector(f"f_L{k}", 3), vector(f"m_L{k}", 3)


def _shift(r: Matrix) -> Matrix:
    """Matrix (6 x 6) from accelerations at I to accelerations at the end at r."""
    return Matrix(sp.Matrix(sp.BlockMatrix([[sp.eye(3), -tilde(r)], [sp.zeros(3), sp.eye(3)]])))


def _centripetal(r: Matrix) -> Matrix:
    spin = tilde(explicit(OMEGA))
    return Matrix((spin * (spin * r)).col_join(sp.zeros(3, 1)))


def _input_quantities(ends: list[Triple], acting: list[Triple]) -> tuple[Quantity, ...]:
    quantities = [
        Quantity(r, "m", f"output end {k} from I") for k, (r, _, _) in enumerate(ends, start=1)
    ]
    for k, (point, force, moment) in enumerate(acting):
        quantities += [
            Quantity(point, "m", f"point of load {k + 1} from I"),
            Quantity(force, "N", f"external force {k + 1}"),
            Quantity(moment, "N*m", f"external moment {k + 1}"),
        ]
    return tuple(quantities)


def _output_quantities(ends: list[Triple]) -> tuple[Quantity, ...]:
    mass_matrix = sp.MatrixSymbol("mass_matrix", 6, 6)
    quantities = [
        Quantity(mass_matrix, "kg, kg*m, kg*m2", "d f_I / d a_I", symmetric=True),
        Quantity(vector("bias", 6), "N, N*m", "f_I at zero a_I and free output ends"),
    ]
    for k, (_, shift, centripetal) in enumerate(ends):
        quantities += [
            Quantity(shift, "-, m", f"d a_O{k + 1} / d a_I"),
            Quantity(centripetal, "m/s2, rad/s2", f"a_O{k + 1} at zero a_I"),
        ]
    return tuple(quantities)


def _premises(ends: list[Triple], acting: list[Triple]) -> tuple[Equation, ...]:
    """Newton's and Euler's laws about I, and the geometry of each output end."""
    rdd, wd = vector("rdd_I", 3), vector("omegadot", 3)
    spin = Tilde(OMEGA)
    force, moment = vector("q_I", 3), vector("m_I", 3)
    equations = []
    for k, (end, _, _) in enumerate(ends):
        rdd_o, q_o, m_o = (vector(f"{name}_O{k + 1}", 3) for name in ("rdd", "q", "m"))
        geometry = rdd - Tilde(end) * wd + spin * spin * end
        equations.append(Equation("acceleration of the output end", rdd_o, geometry, "(5.19)"))
        force, moment = force - q_o, moment - m_o - Tilde(end) * q_o
    for point, f, m in acting:
        force, moment = force + f, moment + Tilde(point) * f + m
    mass = MASS[0, 0]
    linear = mass * (rdd - Tilde(CENTER) * wd + spin * spin * CENTER)
    angular = INERTIA * wd + spin * INERTIA * OMEGA + mass * Tilde(CENTER) * rdd
    equations += [
        Equation("Newton", linear, force, "(5.20)", "force = rate of linear momentum"),
        Equation("Euler", angular, moment, "(5.21)", "moment about I = int r x a dm"),
    ]
    return tuple(equations)
