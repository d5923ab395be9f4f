"""A rigid body of revolution with a wheel inside that a motor keeps at a given rate."""

import sympy as sp

from mstmm.derive import Body, Param


class Flywheel(Body):
    """About the mass centre; the wheel turns about z at `spin` against the body."""

    name = "flywheel"
    parameters = (
        Param("mass", "kg", "with the wheel", minimum=0),
        Param("across", "kg*m^2", "inertia about x and y, with the wheel", minimum=0),
        Param("along", "kg*m^2", "inertia about z, with the wheel", minimum=0),
        Param("wheel", "kg*m^2", "the wheel's own inertia about z", minimum=0),
        Param("spin", "rad/s", "rate of the wheel against the body"),
    )

    def inertia(self, p):
        return sp.diag(p.across, p.across, p.along)

    def residual(self, a, alpha, w, p):
        momentum = self.inertia(p) * w + sp.Matrix([0, 0, p.wheel * p.spin])
        return sp.Matrix.vstack(p.mass * a, self.inertia(p) * alpha + w.cross(momentum))

    def kinetic_energy(self, v, w, p):
        return (p.mass * v.dot(v) + (w.T * self.inertia(p) * w)[0, 0]) / 2
