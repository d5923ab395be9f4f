"""Classical fourth-order Runge-Kutta method, for fixed steps.

W. Kutta, Beitrag zur naeherungsweisen Integration totaler Differentialgleichungen, Zeitschrift
fuer Mathematik und Physik 46 (1901) 435-453.  Dense output is the cubic Hermite interpolant; the
slope at the end of a step is the first stage of the next step, so it adds no evaluation.
"""

from __future__ import annotations

from .tableau import Tableau, hermite, to_read_only


def tableau() -> Tableau:
    """The method `rk4`."""
    weights = [1 / 6, 1 / 3, 1 / 3, 1 / 6]
    return Tableau(
        name="rk4",
        order=4,
        A=to_read_only([[0.0, 0, 0, 0], [0.5, 0, 0, 0], [0.0, 0.5, 0, 0], [0.0, 0, 1, 0]]),
        B=to_read_only(weights),
        C=to_read_only([0.0, 0.5, 0.5, 1.0]),
        dense=hermite(weights),
        dense_order=3,
        source="Kutta (1901)",
    )
