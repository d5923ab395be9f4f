"""Spring-damper-actuator between two ends, along the line that joins them."""

import sympy as sp

from ..definition.element import ForceElement, Param, Symbols


class Spring(ForceElement):
    """Effort along the line: -stiffness (length - rest) - damping d(length)/dt + effort.

    A positive effort pushes the ends apart.
    """

    name = "spring"
    title = "spring-damper-actuator"
    parameters = (
        Param("stiffness", "N/m", "spring stiffness", default=0.0, minimum=0.0),
        Param("rest", "m", "length without spring force", default=0.0, minimum=0.0),
        Param("damping", "N*s/m", "damping of the length's rate", default=0.0, minimum=0.0),
    )

    def wrench(
        self,
        x: sp.Matrix,
        v: sp.Matrix,
        rotation: sp.Matrix,
        w: sp.Matrix,
        p: Symbols,
        effort: sp.Symbol,
        t: sp.Symbol,
    ) -> tuple[sp.Matrix, sp.Matrix]:
        length = sp.sqrt(x.dot(x))
        direction = x / length
        pull = -p.stiffness * (length - p.rest) - p.damping * direction.dot(v) + effort
        return pull * direction, sp.zeros(3, 1)

    def potential(self, x: sp.Matrix, p: Symbols) -> sp.Expr:
        return p.stiffness * (sp.sqrt(x.dot(x)) - p.rest) ** 2 / 2

    def domain(self, x: sp.Matrix, p: Symbols) -> sp.Basic:
        return x.dot(x) > sp.Rational(1, 10**24)
