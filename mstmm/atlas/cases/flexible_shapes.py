"""Cases of shape functions and elements of flexible bodies."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import mpmath
import numpy as np
import sympy as sp

from ...array_validation import Array
from ...derive.classical.harmonic_stiffness import beam_stiffness
from ...runtime.flexible.beam.gauss_quadrature import gauss_points
from ...runtime.flexible.beam.shape_functions import Eigenfunction, wave_number
from ..case_definition import COUNT_SCALE, LOG_SCALE, CaseDefinition, MethodDefinition
from ..error_measures import bending_error, root_inertia, simulate_to_end
from ..shared_scenes import beam_on_ground, uniform_beam

# --- end-moment -----------------------------------------------------------------------------------

MOMENT = 0.05


@cache
def _tip_deflection(basis: str, shapes: int) -> float:
    """Static tip deflection (m) of a clamped beam of 1 m and 1 N m2 under a moment at its tip."""
    beam = uniform_beam(1.0, shapes, basis=basis, frame="tangent", stiffening=False)
    load = {"on": "beam.tip", "moment": [0, 0, MOMENT]}
    beam_model = beam_on_ground(beam, {"type": "fixed"}, load=[load])
    rest = beam_model.equilibrium(), np.zeros(beam_model.nu)
    run = simulate_to_end(beam_model, 1e-9, initial=rest, output_times=[0.0, 1e-9])
    return float(run.deflection("beam", "tip")[0, 1])


def _moment_error(shapes: float, basis: str) -> float:
    exact = _tip_deflection("static+fixed-interface", 6)
    return abs(_tip_deflection(basis, int(shapes)) / exact - 1)


END_MOMENT = CaseDefinition(
    name="end-moment",
    title="Shapes of a free end under an end moment",
    cause="The eigenfunctions of a beam with a free end have no curvature there. A moment at that "
    "end, or a body welded to it, requires one, and their sum converges to it slowly. Two static "
    "shapes of the end loads represent it at once; the basis `auto` uses them where hinges need "
    "them.",
    parameter="number of shapes", unit="", low=2, high=40, scale=COUNT_SCALE,
    measured="error of the deflection, relative", limit=1e-3,
    method=MethodDefinition("clamped-free", lambda n: _moment_error(n, "clamped-free")),
    remedy=MethodDefinition(
        "static+fixed-interface", lambda n: _moment_error(n, "static+fixed-interface")
    ),
    reach=2,
    source="Craig, Bampton, AIAA Journal 6, 1968; Shabana, Dynamics of Multibody Systems, 2020, "
    "ch. 5",
)  # fmt: skip


# --- textbook shapes ------------------------------------------------------------------------------
#
# Bending shapes of a clamped-free beam by hyperbolic functions, in the usual printed form.


def clamped_free_shape(number: int, xi: Array) -> Array:
    """Shape `number` at positions `xi`, relative to the length, with int phi^2 dxi = 1.

    Rao, Vibration of Continuous Systems, ch. 11; beta from the common root of all shapes.
    """
    b = wave_number("clamped-free", number)
    with np.errstate(over="ignore", invalid="ignore"):
        sigma = (np.cosh(b) + np.cos(b)) / (np.sinh(b) + np.sin(b))
        hyperbolic = np.cosh(b * xi) - sigma * np.sinh(b * xi)
    return np.asarray(hyperbolic - np.cos(b * xi) + sigma * np.sin(b * xi))


# --- mode-shapes ----------------------------------------------------------------------------------


def _stable_shape(number: int, xi: Array) -> Array:
    return Eigenfunction("clamped-free", number, 0.0, 1.0)(xi)


def _shape_error(number: float, shape: Callable[[int, Array], Array]) -> float:
    """Error of the integral of the squared shape over the length, which is scaled to 1."""
    xi, weights = gauss_points((0.0, 1.0), lambda a, b: number + 1.0)
    with np.errstate(over="ignore", invalid="ignore"):
        return abs(float(weights @ shape(int(number), xi) ** 2) - 1)


MODE_SHAPES = CaseDefinition(
    name="mode-shapes",
    title="Mode shapes by hyperbolic functions: their number",
    cause="In the printed form with cosh and sinh a shape is the difference of two numbers that "
    "grow by a factor of 23 per half-wave. At the end of about the eleventh shape no digit of it "
    "is left. The same shape written with exponentials that decay from both ends keeps all digits.",
    parameter="number of the shape", unit="", low=1, high=60, scale=COUNT_SCALE,
    measured="error of the shape's square over the length", limit=1e-4,
    method=MethodDefinition("cosh and sinh", lambda n: _shape_error(n, clamped_free_shape)),
    remedy=MethodDefinition("decaying exponentials", lambda n: _shape_error(n, _stable_shape)),
    reach=1000,
    source="Rao, Vibration of Continuous Systems, 2019, ch. 11; high numbers: Goncalves, "
    "Brennan, Elliott, Journal of Sound and Vibration 301, 2007",
)  # fmt: skip


# --- finite difference mass -----------------------------------------------------------------------
#
# Inertia of a vibrating beam from the quotients of its dynamic stiffness.

#: Digits of exact values, and a wave number at which they give only the static stiffness.
_DIGITS, _STATIC_WAVENUMBER = 120, mpmath.mpf(10) ** -12


@cache
def _root_stiffness(numbers: str) -> Callable[[Any], Any]:
    """Load on the root per unit of its displacement as a function of z, for unit beams.

    Length and stiffness of the beam are 1.
    """
    numerator, divisor = beam_stiffness()
    (z,) = divisor.free_symbols
    function: Callable[[Any], Any] = sp.lambdify(z, numerator[0, 0] / divisor, numbers)
    return function


def quotient_inertia(z: float) -> float:
    """Inertia, (static - dynamic stiffness) / z^4, in doubles; NaN after an overflow."""
    with mpmath.workdps(_DIGITS):
        static = float(_root_stiffness("mpmath")(_STATIC_WAVENUMBER))
    with np.errstate(over="ignore", invalid="ignore"):
        return float((static - _root_stiffness("numpy")(z)) / z**4)


def exact_inertia(z: float) -> float:
    """Inertia as in `quotient_inertia`, with enough digits to avoid cancellation."""
    with mpmath.workdps(_DIGITS):
        stiffness = _root_stiffness("mpmath")
        return float(
            (stiffness(_STATIC_WAVENUMBER) - stiffness(mpmath.mpf(z))) / mpmath.mpf(z) ** 4
        )


# --- long-parts -----------------------------------------------------------------------------------


def _inertia_error(z: float, inertia: float) -> float:
    return abs(inertia / exact_inertia(z) - 1)


LONG_PARTS = CaseDefinition(
    name="long-parts",
    title="Exact beams: dynamic stiffness of long elements",
    cause="Hyperbolic functions in the quotients of the dynamic stiffness grow with exp(beta L) "
    "and cancel only in the quotient. The quotients stay accurate longer than transfer matrices, "
    "which have lost all digits at the twelfth mode. At last numerator and divisor both overflow, "
    "and the quotient is undefined. Divided by the growing terms, only decaying exponentials "
    "remain.",
    parameter="beta L of an element", unit="", low=1.0, high=1e4, scale=LOG_SCALE,
    measured="error of the element's inertia, relative", limit=1e-6,
    method=MethodDefinition("quotients of sines", lambda z: _inertia_error(z, quotient_inertia(z))),
    remedy=MethodDefinition("decaying exponentials", lambda z: _inertia_error(z, root_inertia(z))),
    reach=1e6,
    source="Wittrick and Williams, Q. J. Mech. Appl. Math. 24, 1971 (dynamic stiffness); "
    "Goncalves, Brennan, Elliott, Journal of Sound and Vibration 301, 2007 (high numbers)",
)  # fmt: skip


# --- short-parts ----------------------------------------------------------------------------------


SHORT_PARTS = CaseDefinition(
    name="short-parts",
    title="Exact beams: dynamic stiffness of short elements",
    cause="Entries of the dynamic stiffness are quotients of circular and hyperbolic functions. "
    "For short elements numerator and divisor vanish together, and their quotient is the static "
    "stiffness, next to which inertia is of the size of (beta L)^4. A beam divided into many "
    "elements loses its mass in rounding. The remedy computes the terms beyond the static "
    "stiffness as a power series.",
    parameter="beta L of an element", unit="", low=1e-3, high=3.0, scale=LOG_SCALE,
    measured="error of the element's inertia, relative", limit=1e-6,
    method=MethodDefinition("quotients of sines", lambda z: _inertia_error(z, quotient_inertia(z))),
    remedy=MethodDefinition(
        "power series beyond the static part", lambda z: _inertia_error(z, root_inertia(z))
    ),
    reach=1e-6,
    source="Wittrick and Williams, Q. J. Mech. Appl. Math. 24, 1971 (dynamic stiffness); "
    "Przemieniecki, Theory of Matrix Structural Analysis, 1968, ch. 12 (its power series)",
)  # fmt: skip


# --- linear-elements ------------------------------------------------------------------------------

#: Number of hexahedra along the bar and across it.
DIVISIONS = (20, 1, 1)

LINEAR_ELEMENTS = CaseDefinition(
    name="linear-elements",
    title="Solid elements of degree 1: slenderness of a bar in bending",
    cause="An element with linear displacements cannot bend: its edges stay straight, and it shows "
    "shear instead of curvature. The energy of that shear grows with the square of its length over "
    "its thickness. The bar locks, and all its bending frequencies are too high. (Poisson's ratio "
    "is 0 here, so that no other locking occurs.) Elements of degree 2 can be curved. Their "
    "difference at the thick end is the shear of the bar, which the frequency of a slender beam "
    "neglects.",
    parameter="length of a bar of 20 hexahedra over its thickness", unit="",
    low=5.0, high=300.0, scale=LOG_SCALE,
    measured="error of the first frequency, relative", limit=0.1,
    method=MethodDefinition("hexahedra of degree 1", lambda x: bending_error(x, DIVISIONS, 1, 0.0)),
    remedy=MethodDefinition("hexahedra of degree 2", lambda x: bending_error(x, DIVISIONS, 2, 0.0)),
    reach=1000.0,
    source="Cook, Malkus, Plesha, Witt, Concepts and Applications of Finite Element Analysis, "
    "4th ed., 2002, ch. 3 and 6 (parasitic shear)", extra="fem",
)  # fmt: skip


# --- no-compression -------------------------------------------------------------------------------

SLENDERNESS = 10.0
#: Number of hexahedra along the bar and across it; finer than for degree 2, and still it locks.
LINEAR_MESH = (30, 3, 3)


NO_COMPRESSION = CaseDefinition(
    name="no-compression",
    title="Solid elements of degree 1: nearly incompressible material",
    cause="Near a Poisson's ratio of 1/2 every integration point constrains the volume around it. "
    "A mesh of degree 1 has fewer displacements than such constraints: rubber locks in every "
    "direction, whatever the shape of its elements. A mesh of degree 2 has enough displacements to "
    "bend; its error of 3 % at the incompressible end halves with the element size.",
    parameter="distance of Poisson's ratio from 1/2", unit="", low=1e-8, high=0.4, scale=LOG_SCALE,
    measured="error of the first frequency, relative", limit=0.1,
    method=MethodDefinition(
        "degree 1, 30 x 3 x 3 hexahedra",
        lambda d: bending_error(SLENDERNESS, LINEAR_MESH, 1, 0.5 - d),
    ),
    remedy=MethodDefinition(
        "degree 2, 20 x 1 x 1 hexahedra",
        lambda d: bending_error(SLENDERNESS, DIVISIONS, 2, 0.5 - d),
    ),
    reach=1e-10,
    source="Hughes, The Finite Element Method, 1987, ch. 4 (volumetric locking, counts of "
    "constraints)", extra="fem",
)  # fmt: skip


CASES = (END_MOMENT, MODE_SHAPES, LONG_PARTS, SHORT_PARTS, LINEAR_ELEMENTS, NO_COMPRESSION)
