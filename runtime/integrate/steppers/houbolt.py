"""Houbolt's differences over three steps, after two of Newmark's.

J. C. Houbolt, A recurrence matrix solution for the dynamic response of elastic aircraft, Journal of
the Aeronautical Sciences 17 (1950) 540-550.  For comparison, with fixed steps.
"""

from __future__ import annotations

from .implicit_methods import Implicit, make_newmark_family


def tableau() -> Implicit:
    """The method `houbolt`."""
    return make_newmark_family(
        "houbolt", "Houbolt (1950)", adaptive=False, beta_n=0.25, gamma_n=0.5, backward=True
    )
