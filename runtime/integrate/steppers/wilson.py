"""Wilson's method: linear acceleration up to 1.4 steps ahead, where the equations are satisfied.

E. L. Wilson, I. Farhoomand, K. J. Bathe, Nonlinear dynamic analysis of complex structures,
Earthquake Engineering and Structural Dynamics 1 (1973) 241-252.  For comparison, with fixed steps.
"""

from __future__ import annotations

from .implicit_methods import Implicit, make_newmark_family


def tableau() -> Implicit:
    """The method `wilson`."""
    return make_newmark_family(
        "wilson", "Wilson, Farhoomand and Bathe (1973)", adaptive=False, beta_n=1.0 / 6.0,
        gamma_n=0.5, collocation=1.4,
    )  # fmt: skip
