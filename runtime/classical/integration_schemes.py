"""Integration schemes of the classical discrete-time method, by name.

With auxiliary accelerations a (Arnold, Bruls, Multibody Syst. Dyn. 18 (2007) 185-202):

    (1 - alpha_m) a' + alpha_m a = (1 - alpha_f) ydd' + alpha_f ydd
    y' = y + h yd + h^2 ((1/2 - beta) a + beta a'),   yd' = yd + h ((1 - gamma) a + gamma a')
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from mstmm.errors import SceneError


@dataclass(frozen=True)
class Scheme:
    """Parameters of a scheme; with `theta` > 1 a longer step is interpolated back (Wilson)."""

    alpha_m: float
    alpha_f: float
    beta: float
    gamma: float
    theta: float = 1.0


def newmark(gamma: float) -> Scheme:
    """Newmark scheme: J. Eng. Mech. Div. 85 (1959); gamma = 1/2 is the trapezoidal rule."""
    return Scheme(0.0, 0.0, (gamma + 0.5) ** 2 / 4, gamma)


def hht(alpha: float) -> Scheme:
    """HHT scheme: Hilber, Hughes, Taylor, Earthq. Eng. Struct. Dyn. 5 (1977).

    alpha from 0 to 1/3 adds damping.
    """
    return Scheme(0.0, alpha, (1 + alpha) ** 2 / 4, 0.5 + alpha)


def generalised_alpha(radius: float) -> Scheme:
    """Generalised-alpha scheme: Chung, Hulbert, J. Appl. Mech. 60 (1993).

    `radius`, 0 to 1, is the spectral radius at infinity (unresolved vibrations).
    """
    alpha_m, alpha_f = (2 * radius - 1) / (radius + 1), radius / (radius + 1)
    gamma = 0.5 + alpha_f - alpha_m
    return Scheme(alpha_m, alpha_f, (gamma + 0.5) ** 2 / 4, gamma)


def wilson(theta: float) -> Scheme:
    """Wilson-theta scheme: linear acceleration.

    Wilson, Farhoomand, Bathe, Earthq. Eng. Struct. Dyn. 1 (1973).
    """
    return Scheme(0.0, 0.0, 1 / 6, 0.5, theta)


#: Name -> constructor, default, range and name of its parameter.
SCHEMES: dict[str, tuple[Callable[[float], Scheme], float, tuple[float, float], str]] = {
    "generalised-alpha": (generalised_alpha, 0.8, (0.0, 1.0), "radius"),
    "hht": (hht, 0.05, (0.0, 1 / 3), "alpha"),
    "newmark": (newmark, 0.5, (0.5, 1.0), "gamma"),
    "wilson": (wilson, 1.4, (1.0, 2.0), "theta"),
}

DEFAULT_SCHEME = "generalised-alpha"


def parse_scheme(text: str) -> Scheme:
    """Scheme of a text "name" or "name:number", such as "hht:0.3".

    Raises SceneError that lists the existing schemes, or the range of the parameter.
    """
    name, colon, number_text = (text or DEFAULT_SCHEME).partition(":")
    if name not in SCHEMES:
        known = ", ".join(SCHEMES)
        raise SceneError(f'scheme "{text}" does not exist; use one of {known}, as in hht:0.3')
    constructor, default, (lower, upper), parameter_name = SCHEMES[name]
    try:
        number = float(number_text) if colon else default
    except ValueError:
        number = float("nan")
    if not lower <= number <= upper:
        raise SceneError(
            f'scheme "{text}": expected {parameter_name} from {lower:g} to {upper:g}, such as '
            f"{name}:{default:g}"
        )
    return constructor(number)
