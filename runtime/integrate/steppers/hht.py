"""Method of Hilber, Hughes and Taylor with low damping, alpha = 0.05.

H. M. Hilber, T. J. R. Hughes, R. L. Taylor, Improved numerical dissipation for time integration
algorithms in structural dynamics, Earthquake Engineering and Structural Dynamics 5 (1977) 283-292.
"""

from __future__ import annotations

from .implicit_methods import Implicit, make_newmark_family

_ALPHA = 0.05


def tableau() -> Implicit:
    """The method `hht`."""
    return make_newmark_family(
        "hht", "Hilber, Hughes and Taylor (1977)", alpha_f=_ALPHA,
        beta_n=0.25 * (1.0 + _ALPHA) ** 2, gamma_n=0.5 + _ALPHA,
    )  # fmt: skip
