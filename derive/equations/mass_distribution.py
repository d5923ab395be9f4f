"""Mass distribution of a rigid body: integrals over its mass in terms of ten moments.

A rigid body enters its equations of motion only through polynomials of second degree in the
coordinates x, y, z of its points, so ten numbers represent any distribution: the mass, the mass
centre, three moments and three products of inertia.
"""

from __future__ import annotations

from dataclasses import dataclass

import sympy as sp

from ..definition.derivation import tilde
from ..definition.notation import Matrix


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
