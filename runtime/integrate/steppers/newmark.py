"""Newmark's method with constant average acceleration: no numerical damping.

N. M. Newmark, A method of computation for structural dynamics, Journal of the Engineering Mechanics
Division 85 (1959) 67-94.
"""

from __future__ import annotations

from .implicit_methods import Implicit, make_newmark_family


def tableau() -> Implicit:
    """The method `newmark`."""
    return make_newmark_family("newmark", "Newmark (1959)", beta_n=0.25, gamma_n=0.5)
