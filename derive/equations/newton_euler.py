"""Rigid-body equations of motion, derived by integrating Newton's law over the mass.

Premises: every mass element obeys dm a = df; the internal forces have no resultant and no moment;
the body is rigid, so that its points are fixed in body axes.  Two derivations lead to Euler's
equations at an arbitrary body-fixed origin o: the moments of the inertial forces, int r x a dm, and
the rate of the angular momentum about the inertial origin.  `forms_difference` shows that they
agree identically.

Vectors are 3 x 1 columns of components in body axes unless a name says otherwise; SI units.  Source
for comparison: Jing and Stephansson, Fundamentals of Discrete Element Methods for Rock Engineering,
Elsevier 2007, ch. 2, (2.18) to (2.36); `tests/derive/equations/test_newton_euler.py` compares.
"""

from __future__ import annotations

from dataclasses import dataclass

import sympy as sp

from ..definition.derivation import tilde
from ..definition.notation import Matrix

# --- mass distribution ----------------------------------------------------------------------------
# A rigid body enters its equations of motion only through polynomials of second degree in the
# coordinates x, y, z of its points, so ten numbers represent any distribution: the mass, the mass
# centre, three moments and three products of inertia.


@dataclass(frozen=True)
class MassDistribution:
    """Moments of a mass distribution about the origin of the axes x, y, z.

    `moments` are Ixx, Iyy, Izz = int (y^2 + z^2) dm and so on; `products` are Ixy, Ixz, Iyz =
    int x y dm and so on, positive as Jing and Stephansson, Fundamentals of Discrete Element
    Methods for Rock Engineering, Elsevier 2007, ch. 2, (2.9) define them.  The inertia tensor has
    the products with a minus sign.  SI: kg, m, kg m^2.
    """

    mass: sp.Expr
    center: Matrix
    moments: tuple[sp.Expr, sp.Expr, sp.Expr]
    products: tuple[sp.Expr, sp.Expr, sp.Expr]

    @property
    def inertia(self) -> Matrix:
        """Inertia tensor J = int (r.r I - r r^T) dm about the origin (3 x 3, kg m^2)."""
        (xx, yy, zz), (xy, xz, yz) = self.moments, self.products
        return Matrix([[xx, -xy, -xz], [-xy, yy, -yz], [-xz, -yz, zz]])

    @property
    def second_moments(self) -> dict[tuple[int, ...], sp.Expr]:
        """int x^a y^b z^c dm for a + b + c = 2, by exponents."""
        (xx, yy, zz), (xy, xz, yz) = self.moments, self.products
        return {
            (2, 0, 0): (yy + zz - xx) / 2,
            (0, 2, 0): (xx + zz - yy) / 2,
            (0, 0, 2): (xx + yy - zz) / 2,
            (1, 1, 0): xy,
            (1, 0, 1): xz,
            (0, 1, 1): yz,
        }

    def integral(self, integrand: Matrix) -> Matrix:
        """int integrand dm, component by component.

        The integrand is a polynomial in `POINT`; ValueError if its degree exceeds two (no such
        term occurs in the dynamics of a rigid body).
        """
        weights: dict[tuple[int, ...], sp.Expr] = {
            (0, 0, 0): self.mass,
            (1, 0, 0): self.mass * self.center[0],
            (0, 1, 0): self.mass * self.center[1],
            (0, 0, 1): self.mass * self.center[2],
            **self.second_moments,
        }

        def component(entry: sp.Expr) -> sp.Expr:
            total = sp.Integer(0)
            for powers, coefficient in sp.Poly(entry, *POINT).terms():
                if powers not in weights:
                    raise ValueError(f"{entry}: expected degree <= 2, found degree {sum(powers)}")
                total += coefficient * weights[powers]
            return sp.expand(total)

        return Matrix(integrand).applyfunc(component)


#: Coordinates of the mass element dm in body axes, from the body's origin (m).
POINT = Matrix(sp.symbols("x y z", real=True))


def general() -> MassDistribution:
    """Ten free symbols M, x_c, y_c, z_c, I_xx ... I_yz: any body, origin and body axes."""
    return MassDistribution(
        sp.Symbol("M", positive=True),
        Matrix(sp.symbols("x_c y_c z_c", real=True)),
        sp.symbols("I_xx I_yy I_zz", real=True),
        sp.symbols("I_xy I_xz I_yz", real=True),
    )


def from_inertia_tensor(mass: sp.Expr, center: Matrix, inertia: Matrix) -> MassDistribution:
    """Distribution with this mass, mass centre and symmetric inertia tensor about the origin."""
    return MassDistribution(
        mass,
        Matrix(center),
        (inertia[0, 0], inertia[1, 1], inertia[2, 2]),
        (-inertia[0, 1], -inertia[0, 2], -inertia[1, 2]),
    )


def point_masses(masses: list[sp.Expr], positions: list[Matrix]) -> MassDistribution:
    """Distribution of finitely many mass points (positions 3 x 1 in body axes)."""
    total = sum(masses, sp.Integer(0))
    center = sum((m * p for m, p in zip(masses, positions, strict=True)), sp.zeros(3, 1)) / total
    inertia = sp.zeros(3, 3)
    for m, p in zip(masses, positions, strict=True):
        inertia -= m * tilde(p) * tilde(p)
    return from_inertia_tensor(total, Matrix(center), Matrix(inertia))


# --- equations of motion --------------------------------------------------------------------------

#: Position, velocity and acceleration of the body-fixed origin o, in body axes (m, m/s, m/s^2).
X0 = Matrix(sp.symbols("X0_x X0_y X0_z", real=True))
V0 = Matrix(sp.symbols("V0_x V0_y V0_z", real=True))
A0 = Matrix(sp.symbols("a0_x a0_y a0_z", real=True))
#: Angular velocity of the body and its rate, in body axes (rad/s, rad/s^2).
OMEGA = Matrix(sp.symbols("omega_x omega_y omega_z", real=True))
OMEGADOT = Matrix(sp.symbols("omegadot_x omegadot_y omegadot_z", real=True))


def component_rate(v: Matrix) -> Matrix:
    """Time derivative of the components of `v`, which may contain X0, V0, OMEGA and POINT.

    Points are fixed in body axes; the components of X0 and V0 change because the origin moves and
    because the axes turn under it.
    """
    rates = {X0: V0 - tilde(OMEGA) * X0, V0: A0 - tilde(OMEGA) * V0, OMEGA: OMEGADOT}
    total = sp.zeros(*v.shape)
    for quantity, rate in rates.items():
        total += Matrix(v.jacobian(quantity)) * rate
    return Matrix(total).expand()


def rate(v: Matrix) -> Matrix:
    """Body-axes components of the inertial time derivative of the vector `v`.

    With R from body to inertial axes and dR/dt = R tilde(omega): R^T d(R v)/dt = dv/dt + omega x v.
    """
    return Matrix(component_rate(v) + tilde(OMEGA) * v).expand()


def acceleration_field() -> Matrix:
    """Acceleration of the point x, y, z of the body, cf. (2.18) (3 x 1, m/s^2)."""
    return rate(rate(Matrix(X0 + POINT)))


def inertial_force(body: MassDistribution) -> Matrix:
    """int a dm, cf. (2.17) (3 x 1, N)."""
    return body.integral(acceleration_field())


def euler_form(body: MassDistribution | None = None) -> Matrix:
    """int r x a dm about the body-fixed origin o: the left side of (2.22) (3 x 1, N m)."""
    return (body or general()).integral(tilde(POINT) * acceleration_field())


def angular_momentum_form(body: MassDistribution | None = None) -> Matrix:
    """Moment about o from the angular momentum about the inertial origin O (3 x 1, N m).

    d(int X x V dm)/dt is the moment about O, (2.30); less X0 x force it is the moment about o.
    The acceleration field is not used.
    """
    body = body or general()
    position = Matrix(X0 + POINT)
    velocity = rate(position)
    about_inertial_origin = rate(body.integral(tilde(position) * velocity))
    force = rate(body.integral(velocity))
    return Matrix(about_inertial_origin - tilde(X0) * force).expand()


def relative_momentum_form(body: MassDistribution | None = None) -> Matrix:
    """Moment about o as M r_c x a0 + dh/dt (3 x 1, N m), cf. (2.35).

    h = int r x (omega x r) dm; dh/dt is the inertial rate: the rate of the components of h in
    body axes plus omega x h.
    """
    body = body or general()
    momentum = relative_momentum(body)
    return Matrix(body.mass * tilde(body.center) * A0 + rate(momentum)).expand()


def relative_momentum(body: MassDistribution) -> Matrix:
    """h = int r x dr/dt dm about o, of the motion relative to o (3 x 1, kg m^2/s)."""
    return body.integral(tilde(POINT) * rate(POINT))


def forms_difference(body: MassDistribution | None = None) -> tuple[Matrix, Matrix]:
    """Euler form less angular-momentum form, less relative form: both vanish identically."""
    euler = euler_form(body)
    return (
        Matrix(euler - angular_momentum_form(body)).expand(),
        Matrix(euler - relative_momentum_form(body)).expand(),
    )


def tensor_form(body: MassDistribution) -> Matrix:
    """Euler's equations with the tensor J: M r_c x a0 + J omegadot + omega x J omega."""
    inertia = body.inertia
    return Matrix(
        body.mass * tilde(body.center) * A0 + inertia * OMEGADOT + tilde(OMEGA) * inertia * OMEGA
    ).expand()


def principal_axes(body: MassDistribution) -> MassDistribution:
    """Same body in axes that are principal at o: no products of inertia, (2.24)."""
    zero = sp.Integer(0)
    return MassDistribution(body.mass, body.center, body.moments, (zero, zero, zero))


def about_mass_center(body: MassDistribution) -> MassDistribution:
    """Body whose origin is its mass centre, (2.25) case (b)."""
    return MassDistribution(body.mass, Matrix.zeros(3, 1), body.moments, body.products)


def with_unaccelerated_origin(moment: Matrix) -> Matrix:
    """Moment if o has no acceleration, as for a body point fixed in space, (2.25)."""
    return Matrix(moment.subs(dict.fromkeys(A0, 0)))
