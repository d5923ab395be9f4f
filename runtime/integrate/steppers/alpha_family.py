"""Newmark's family: coordinates and speeds are linear in the new acceleration.

The schemes with their parameters serve the methods below and the classical discrete-time method
(`dttmm-classical`).  With auxiliary accelerations a (Arnold, Bruels, Multibody Syst. Dyn. 18 (2007)
185-202):

    (1 - alpha_m) a' + alpha_m a = (1 - alpha_f) ydd' + alpha_f ydd
    y' = y + h yd + h^2 ((1/2 - beta) a + beta a'),   yd' = yd + h ((1 - gamma) a + gamma a')
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mstmm.array_validation import Array
from mstmm.errors import SceneError

from .implicit_methods import ALPHA, Implicit, two_position_arrays
from .tableau import Tableau


@dataclass(frozen=True)
class Scheme:
    """Parameters of a scheme; with `theta` > 1 a longer step is interpolated back (Wilson)."""

    alpha_m: float
    alpha_f: float
    beta: float
    gamma: float
    theta: float = 1.0


def newmark(gamma: float) -> Scheme:
    """Newmark scheme; gamma = 1/2 is constant average acceleration, without numerical damping.

    N. M. Newmark, A method of computation for structural dynamics, Journal of the Engineering
    Mechanics Division 85 (1959) 67-94.
    """
    return Scheme(0.0, 0.0, (gamma + 0.5) ** 2 / 4, gamma)


def hht(alpha: float) -> Scheme:
    """HHT scheme; alpha from 0 to 1/3 adds damping.

    H. M. Hilber, T. J. R. Hughes, R. L. Taylor, Improved numerical dissipation for time integration
    algorithms in structural dynamics, Earthquake Engineering and Structural Dynamics 5 (1977)
    283-292.
    """
    return Scheme(0.0, alpha, (1 + alpha) ** 2 / 4, 0.5 + alpha)


def generalised_alpha(radius: float) -> Scheme:
    """Generalised alpha: damping of motion that the step does not resolve.

    `radius`, 0 to 1, is the spectral radius at infinity.  J. Chung, G. M. Hulbert, A time
    integration algorithm for structural dynamics with improved numerical dissipation: the
    generalized-alpha method, Journal of Applied Mechanics 60 (1993) 371-375.
    """
    alpha_m, alpha_f = (2 * radius - 1) / (radius + 1), radius / (radius + 1)
    gamma = 0.5 + alpha_f - alpha_m
    return Scheme(alpha_m, alpha_f, (gamma + 0.5) ** 2 / 4, gamma)


def wilson(theta: float) -> Scheme:
    """Wilson's scheme: linear acceleration up to `theta` steps ahead, where the equations hold.

    E. L. Wilson, I. Farhoomand, K. J. Bathe, Nonlinear dynamic analysis of complex structures,
    Earthquake Engineering and Structural Dynamics 1 (1973) 241-252.
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


@dataclass(frozen=True, eq=False)
class NewmarkFamily(Implicit):
    """Method of Newmark's family, with q for y and u for yd in the equations of this module.

    Attributes:
        alpha_m, alpha_f, beta_n, gamma_n: its constants; `alpha_m = alpha_f = 0` makes a = u'.
        collocation: number of steps (Wilson: above 1, others: 1) after which the equations of
            motion are satisfied; the acceleration is linear up to there.
        backward: Houbolt's differences over three steps; the constants are used for the first two.
        one_iteration: one linear solution per step, at the predictor u'_1 = u'_0.
        on_positions: constraint rows are satisfied by positions at the end of a step, with their
            multipliers as unknowns (index 3); the error of speeds is of the order of the method.
            Shortened steps satisfy the rows by accelerations.
    """

    kind: ClassVar[int] = ALPHA
    alpha_m: float = 0.0
    alpha_f: float = 0.0
    beta_n: float = 0.25
    gamma_n: float = 0.5
    collocation: float = 1.0
    backward: bool = False
    one_iteration: bool = False
    on_positions: bool = False

    def _check_consistency(self) -> None:
        if not (self.beta_n > 0.0 and self.gamma_n > 0.0 and self.collocation >= 1.0):
            raise ValueError(f"tableau {self.name}: its constants must be positive")

    @property
    def error_constant(self) -> float:
        """Factor of h^2 times the change of acceleration in the local error of coordinates."""
        return self.beta_n + (self.alpha_m - self.alpha_f) / 2.0 - 1.0 / 6.0

    def amplification(self, z: ArrayLike) -> NDArray[np.complex128]:
        """Largest eigenvalue of one step on the oscillation with the eigenvalue z / h."""
        points = np.asarray(z, dtype=np.complex128)
        eigenvalues = [max(np.linalg.eigvals(self._step(x)), key=abs) for x in points.ravel()]
        return np.reshape(np.array(eigenvalues, dtype=np.complex128), points.shape)

    def _step(self, z: complex) -> Array:
        """Step matrix of u' = -c u - k q with h = 1, eigenvalues z and its conjugate."""
        k, c = abs(z) ** 2, -2.0 * z.real
        return _houbolt_step_matrix(k, c) if self.backward else self._newmark_step(k, c)

    def _newmark_step(self, k: float, c: float) -> Array:
        """Step matrix of the Newmark form on (q, u, u', a)."""
        h, q, u, rate, a = self.collocation, *np.eye(4)
        factor = (1.0 - self.alpha_f) / (1.0 - self.alpha_m)
        known_part = (self.alpha_f * rate - self.alpha_m * a) / (1.0 - self.alpha_m)

        def advance(h: float, new: Array) -> tuple[Array, Array]:
            acceleration = known_part + factor * new
            q_new = q + h * u + h * h * ((0.5 - self.beta_n) * a + self.beta_n * acceleration)
            return q_new, u + h * ((1.0 - self.gamma_n) * a + self.gamma_n * acceleration)

        free_motion = advance(h, np.zeros(4))
        divisor = 1.0 + factor * (c * h * self.gamma_n + k * h * h * self.beta_n)
        new = -(c * free_motion[1] + k * free_motion[0]) / divisor
        new = rate + (new - rate) / self.collocation
        return np.array([*advance(1.0, new), new, known_part + factor * new])


def _houbolt_step_matrix(k: float, c: float) -> Array:
    """Step matrix of Houbolt's method on the last three coordinates."""
    q0, q1, q2 = np.eye(3)  # the most recent first
    rest_a, rest_u = -5.0 * q0 + 4.0 * q1 - q2, (-18.0 * q0 + 9.0 * q1 - 2.0 * q2) / 6.0
    q_new = -(rest_a + c * rest_u) / (2.0 + c * 11.0 / 6.0 + k)
    return np.array([q_new, q0, q1])


#: Name -> source, scheme with the default parameter, further attributes.  Houbolt's differences
#: (A recurrence matrix solution for the dynamic response of elastic aircraft, Journal of the
#: Aeronautical Sciences 17 (1950) 540-550) follow two steps of Newmark's method; they and Wilson's
#: method have fixed steps and serve for comparison.
#:
#: `dttmm`, the discrete-time transfer matrix method, linearises the equations at a predictor of
#: second order and solves them once, in the coordinates of the hinges.  For smooth motion it is as
#: accurate as the iterated method, for less than half its cost; errors of fast motion that the step
#: does not resolve remain.  B. Rong, X. Rui, L. Tao, G. Wang, Discrete time transfer matrix method
#: for launch dynamics modeling and cosimulation of self-propelled artillery system, Journal of
#: Applied Mechanics 80 (2013) 011008.
_METHODS: dict[str, tuple[str, str, dict[str, Any]]] = {
    "genalpha": ("Chung and Hulbert (1993)", "generalised-alpha", {}),
    "dttmm": ("one linearisation per step of Chung and Hulbert (1993)", "generalised-alpha",
              {"one_iteration": True}),
    "hht": ("Hilber, Hughes and Taylor (1977)", "hht", {}),
    "newmark": ("Newmark (1959)", "newmark", {}),
    "wilson": ("Wilson, Farhoomand and Bathe (1973)", "wilson", {"E": None, "error_order": 0}),
    "houbolt": ("Houbolt (1950)", "newmark", {"E": None, "error_order": 0, "backward": True}),
}  # fmt: skip

#: Names of the methods of the family.
ALPHA_METHODS = frozenset(_METHODS)


def alpha_method(name: str, radius: float | None = None) -> NewmarkFamily:
    """Method of the family by its name; `radius` for those of generalised alpha."""
    source, scheme_name, attributes = _METHODS[name]
    constructor, default, _, _ = SCHEMES[scheme_name]
    scheme = constructor(default if radius is None else radius)
    constants = {
        "alpha_m": scheme.alpha_m, "alpha_f": scheme.alpha_f, "beta_n": scheme.beta,
        "gamma_n": scheme.gamma, "collocation": scheme.theta,
    }  # fmt: skip
    return NewmarkFamily(
        name=name, source=source, **{**two_position_arrays(order=2), **constants, **attributes}
    )


def with_position_constraints(tableau: Tableau, name: str) -> NewmarkFamily:
    """Variant of a method that satisfies constraints by positions (index 3), with a new name."""
    assert isinstance(tableau, NewmarkFamily)
    source = f"{tableau.source}, on index 3 after Arnold and Brüls (2007)"
    return replace(tableau, name=name, source=source, on_positions=True)
