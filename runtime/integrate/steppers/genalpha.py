"""Generalised alpha: second order, with damping of motion that the step does not resolve.

J. Chung, G. M. Hulbert, A time integration algorithm for structural dynamics with improved
numerical dissipation: the generalized-alpha method, Journal of Applied Mechanics 60 (1993) 371-375.
"""

from __future__ import annotations

from typing import Any

from .implicit_methods import Implicit, make_newmark_family

DEFAULT_RADIUS = 0.8  # default spectral radius at infinity


def constants(radius: float) -> dict[str, float]:
    """Constants of the method for a spectral radius at infinity from 0 to 1."""
    alpha_m, alpha_f = (2.0 * radius - 1.0) / (radius + 1.0), radius / (radius + 1.0)
    gamma = 0.5 + alpha_f - alpha_m
    return {
        "alpha_m": alpha_m, "alpha_f": alpha_f, "gamma_n": gamma,
        "beta_n": 0.25 * (gamma + 0.5) ** 2,
    }  # fmt: skip


def tableau(radius: float = DEFAULT_RADIUS) -> Implicit:
    """The method `genalpha`."""
    method_constants: dict[str, Any] = dict(constants(radius))
    return make_newmark_family("genalpha", "Chung and Hulbert (1993)", **method_constants)
