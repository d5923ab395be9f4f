"""Rigid body with full inertia about its input end; any number of output ends."""

import sympy as sp

from ..definition.derivation import tilde
from ..definition.element import Body, Param, Symbols

PARAMETERS = (
    Param("mass", "kg", "mass", minimum=0.0),
    *(Param(f"mc{n}", "kg*m", "mass times mass centre from the input end") for n in "xyz"),
    *(
        Param(f"J{n}", "kg*m2", "inertia tensor entry about the input end")
        for n in ("xx", "xy", "xz", "yy", "yz", "zz")
    ),
)


def inertia_tensor(p: Symbols) -> sp.Matrix:
    """Inertia tensor (3 x 3) about the input end from the parameters."""
    return sp.Matrix([[p.Jxx, p.Jxy, p.Jxz], [p.Jxy, p.Jyy, p.Jyz], [p.Jxz, p.Jyz, p.Jzz]])


class RigidBody(Body):
    """Newton-Euler equations about the input end I, derived in `derive.equations.newton_euler`."""

    name = "rigid"
    title = "rigid body"
    parameters = PARAMETERS
    sources = ("Rui, Wang, Zhang, ch. 5, (5.20)-(5.25)",)
    uses_hinge_axes = True

    def residual(self, a: sp.Matrix, alpha: sp.Matrix, w: sp.Matrix, p: Symbols) -> sp.Matrix:
        moment, inertia = sp.Matrix([p.mcx, p.mcy, p.mcz]), inertia_tensor(p)
        carrier = sp.Matrix(tilde(alpha)) + sp.Matrix(tilde(w)) * sp.Matrix(tilde(w))
        force = p.mass * a + carrier * moment
        about_input = inertia * alpha + w.cross(inertia * w) + moment.cross(a)
        return sp.Matrix.vstack(force, about_input)

    def kinetic_energy(self, v: sp.Matrix, w: sp.Matrix, p: Symbols) -> sp.Expr:
        moment = sp.Matrix([p.mcx, p.mcy, p.mcz])
        spin = (w.T * inertia_tensor(p) * w)[0, 0]
        return p.mass * v.dot(v) / 2 + v.dot(w.cross(moment)) + spin / 2
