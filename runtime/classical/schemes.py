"""Time maps of the classical discrete-time method by their names.

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
    """Numbers of a time map; `theta` above 1 makes longer steps and goes back (Wilson)."""

    alpha_m: float
    alpha_f: float
    beta: float
    gamma: float
    theta: float = 1.0


def newmark(gamma: float) -> Scheme:
    """Newmark, J. Eng. Mech. Div. 85 (1959); gamma = 1/2 is the trapezoidal rule."""
    return Scheme(0.0, 0.0, (gamma + 0.5) ** 2 / 4, gamma)


def hht(alpha: float) -> Scheme:
    """Hilber, Hughes, Taylor, Earthq. Eng. Struct. Dyn. 5 (1977); alpha from 0 to 1/3 damps."""
    return Scheme(0.0, alpha, (1 + alpha) ** 2 / 4, 0.5 + alpha)


def generalised_alpha(radius: float) -> Scheme:
    """Chung, Hulbert, J. Appl. Mech. 60 (1993); `radius` is that of unresolved vibrations, 0 to
    1."""
    alpha_m, alpha_f = (2 * radius - 1) / (radius + 1), radius / (radius + 1)
    gamma = 0.5 + alpha_f - alpha_m
    return Scheme(alpha_m, alpha_f, (gamma + 0.5) ** 2 / 4, gamma)


def wilson(theta: float) -> Scheme:
    """Wilson, Farhoomand, Bathe, Earthq. Eng. Struct. Dyn. 1 (1973): linear acceleration."""
    return Scheme(0.0, 0.0, 1 / 6, 0.5, theta)


#: Name -> maker, its number where none is given, the numbers it takes and what they are called.
SCHEMES: dict[str, tuple[Callable[[float], Scheme], float, tuple[float, float], str]] = {
    "generalised-alpha": (generalised_alpha, 0.8, (0.0, 1.0), "radius"),
    "hht": (hht, 0.05, (0.0, 1 / 3), "alpha"),
    "newmark": (newmark, 0.5, (0.5, 1.0), "gamma"),
    "wilson": (wilson, 1.4, (1.0, 2.0), "theta"),
}

DEFAULT = "generalised-alpha"


def scheme_of(text: str) -> Scheme:
    """The scheme of "name" or "name:number", such as "hht:0.3".

    Raises SceneError naming those that exist, or the numbers that one takes.
    """
    name, colon, given = (text or DEFAULT).partition(":")
    if name not in SCHEMES:
        known = ", ".join(SCHEMES)
        raise SceneError(f'scheme "{text}" does not exist; known are {known}, as in hht:0.3')
    make, usual, (least, most), called = SCHEMES[name]
    try:
        number = float(given) if colon else usual
    except ValueError:
        number = float("nan")
    if not least <= number <= most:
        raise SceneError(
            f'scheme "{text}": expected {called} from {least:g} to {most:g}, such as '
            f"{name}:{usual:g}"
        )
    return make(number)
