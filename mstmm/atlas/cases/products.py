"""Cases of products of transfer matrices."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import sympy as sp
from scipy.optimize import brentq

from ...derive.classical.harmonic_stiffness import BETA, LENGTH, field_matrix
from ...runtime.flexible.beam.shape_functions import wave_number
from ..case_definition import COUNT_SCALE, LINEAR_SCALE, LOG_SCALE, CaseDefinition, MethodDefinition
from ..error_measures import refinement_correction, simulate_to_end
from ..shared_scenes import (
    chain,
    compile_looped,
    random_pin_states,
    rod_chain,
    row_hinges,
    uniform_beam,
)


def _product_case(
    scene: Callable[[float], dict[str, Any]], rods: int | None = None, **definition: Any
) -> CaseDefinition:
    """Case of the plain product, and the Riccati sweep, for the scene of a parameter value.

    Without `rods` the parameter is the number of rods.
    """

    def sweep_error(parameter: float, **options: Any) -> float:
        states = random_pin_states(int(parameter) if rods is None else rods)
        return refinement_correction(compile_looped(scene(parameter), **options), states)

    def product_error(parameter: float) -> float:
        return sweep_error(parameter, sweep="product", accuracy=math.inf)

    product = "plain product" if rods is None else f"plain product, {rods} rods"
    return CaseDefinition(
        measured="error of the accelerations, relative",
        limit=1e-6,
        method=MethodDefinition(product, product_error),
        remedy=MethodDefinition("Riccati sweep", sweep_error),
        **definition,
    )


# --- product-length -------------------------------------------------------------------------------


PRODUCT_LENGTH = _product_case(
    lambda n: chain(int(n)),
    name="product-length",
    title="Product of transfer matrices: length of a chain",
    cause="The product eliminates from the root outwards, a shooting method: the rounding error of "
    "one body grows fourfold at the next, though the chain is well conditioned. The Riccati sweep "
    "eliminates from the tips inwards, with positive definite pivots.",
    parameter="rods on parallel pins", unit="", low=2, high=60, scale=COUNT_SCALE,
    reach=100_000,
    source="Rui, Wang, Zhang, Transfer Matrix Method for Multibody Systems, 2019, ch. 5 (5.18, "
    "5.38); Riccati form: Rui et al., Multibody System Dynamics 49, 2020",
)  # fmt: skip


# --- product-angle --------------------------------------------------------------------------------


PRODUCT_ANGLE = _product_case(
    lambda a: chain(6, skew=float(np.deg2rad(a))),
    6,
    name="product-angle",
    title="Product of transfer matrices: angle between neighbouring axes",
    cause="The pivot of a pin's matrix is the inertia of one body that couples its axis with that "
    "of the next pin. It falls with the cosine of the angle and is zero at 90 degrees, usual in "
    "robot arms, while the mass matrix stays regular.",
    parameter="angle between neighbouring pins", unit="degrees", low=0.0, high=90.0,
    scale=LINEAR_SCALE,
    reach=90.0,
    source="Rui, Wang, Zhang, Transfer Matrix Method for Multibody Systems, 2019, ch. 5 (5.61)",
)  # fmt: skip


# --- product-pivot --------------------------------------------------------------------------------

#: Moment of a rod of 1 kg and 1 m about its mass centre whose output end is the centre of
#: percussion of its input end: M r_IC . (r_IO - r_IC).
DUMBBELL_INERTIA = 0.25


PRODUCT_PIVOT = _product_case(
    lambda d: chain(6, inertia=(DUMBBELL_INERTIA * (1 - d),) * 3), 6,
    name="product-pivot",
    title="Product of transfer matrices: a pivot that vanishes",
    cause="The pivot of a planar pin is zero where the output end of its body is the centre of "
    "percussion of the input end, as for a dumbbell. An impact there does not move the inner end. "
    "Digits are lost long before the guard names the hinge.",
    parameter="distance of the moment of inertia from that of a dumbbell", unit="",
    low=1e-10, high=0.5, scale=LOG_SCALE,
    reach=1e-10,
    source="Rui, Wang, Zhang, Transfer Matrix Method for Multibody Systems, 2019, ch. 5 (5.38)",
)  # fmt: skip


# --- product-masses -------------------------------------------------------------------------------


PRODUCT_MASSES = _product_case(
    lambda r: rod_chain([r**i for i in range(8)]), 8,
    name="product-masses",
    title="Product of transfer matrices: light bodies outboard of heavy ones",
    cause="The product passes the loads of the heavy root on to a tip, where they must cancel down "
    "to those of a light body. The mass ratio multiplies their rounding error. The sweep does not "
    "form that difference.",
    parameter="mass of a rod over that of its inboard neighbour", unit="", low=1e-3, high=1.0,
    scale=LOG_SCALE,
    reach=1e-6,
    source="Rui et al., Multibody System Dynamics 49, 2020; product: Rui, Wang, Zhang, Transfer "
    "Matrix Method for Multibody Systems, 2019, ch. 5",
)  # fmt: skip


# --- product-root ---------------------------------------------------------------------------------


PRODUCT_ROOT = _product_case(
    lambda r: rod_chain([r] + [1.0] * 7), 8,
    name="product-root",
    title="Product of transfer matrices: one heavy body at the root",
    cause="All loads of the root pass through all matrices before the condition at the tip cancels "
    "them. One heavy body is enough: its loads are rounded at their size, and that error moves the "
    "light bodies outboard of it. The sweep reaches the heavy body last, and the contribution of "
    "the light bodies may be rounded there without harm.",
    parameter="mass of the first rod over that of the others", unit="", low=1.0, high=1e14,
    scale=LOG_SCALE,
    reach=1e20,
    source="Rui et al., Multibody System Dynamics 49, 2020; product: Rui, Wang, Zhang, Transfer "
    "Matrix Method for Multibody Systems, 2019, ch. 5",
)  # fmt: skip


# --- product-beams --------------------------------------------------------------------------------

STEP, STEPS = 1e-3, 20


def _beam_error(count: float, method: str) -> float:
    names = [f"beam{i}" for i in range(int(count))]
    beams = [uniform_beam(50.0, 3, name, frame="tangent", stiffening=False) for name in names]
    welds = row_hinges(names, "fixed")
    model = compile_looped({"gravity": [0, -9.81, 0], "beam": beams, "hinge": welds})
    expected = simulate_to_end(model, STEPS * STEP, "dttmm", STEP).q[-1]
    computed = simulate_to_end(model, STEPS * STEP, method, STEP).q[-1]
    return float(np.abs(computed - expected).max() / np.abs(expected).max())


PRODUCT_BEAMS = CaseDefinition(
    name="product-beams",
    title="Product of discrete-time matrices: a row of beams",
    cause="Modal rows make the matrices of beams far worse conditioned than those of rigid bodies. "
    "A product of a few of them has no accurate digit, and fewer with shorter steps. The same "
    "matrices eliminated by Riccati from the tip inwards stay accurate.",
    parameter="welded beams of three shapes",
    unit="",
    low=1,
    high=12,
    scale=COUNT_SCALE,
    measured="difference from steps in hinge coordinates",
    limit=1e-4,
    method=MethodDefinition(
        "dttmm-classical-product, h = 1 ms", lambda n: _beam_error(n, "dttmm-classical-product")
    ),
    remedy=MethodDefinition(
        "dttmm-classical, h = 1 ms", lambda n: _beam_error(n, "dttmm-classical")
    ),
    reach=40,
    source="Rui, Wang, Zhang, Transfer Matrix Method for Multibody Systems, 2019, ch. 8",
)


# --- determinant of transfer matrices -------------------------------------------------------------
#
# Frequencies of a clamped-free beam by the signs of a determinant of transfer matrices.

#: Number of values of the determinant in the window of one mode.
_WINDOW_POINTS = 41


@cache
def _field_function() -> Any:
    return sp.lambdify([BETA, LENGTH], field_matrix(), "numpy")


def determinant(beta: float, parts: int) -> float:
    """Determinant of the conditions at the free end, for a beam of length 1 in `parts` elements.

    Rows are moment and shear force there, columns those of the clamped end.
    """
    chain = np.linalg.matrix_power(np.asarray(_field_function()(beta, 1 / parts)), parts)
    return float(chain[2, 2] * chain[3, 3] - chain[2, 3] * chain[3, 2])


def clamped_free_wavenumber(number: int, parts: int) -> float:
    """beta L of a mode; NaN unless the determinant changes its sign once in the window."""
    window = np.linspace((number - 1) * np.pi, number * np.pi, _WINDOW_POINTS) + 0.1
    values = np.array([determinant(float(beta), parts) for beta in window])
    changes = np.flatnonzero(values[:-1] * values[1:] < 0)
    if len(changes) != 1:
        return float("nan")
    first = int(changes[0])
    return float(brentq(determinant, window[first], window[first + 1], args=(parts,), xtol=1e-13))


# --- determinant-search ---------------------------------------------------------------------------

#: Number of elements of the beam in the product, and of shapes of each element in the sweep.
ELEMENT_COUNT, SHAPE_COUNT = 4, 6


def _error_by_signs(number: float) -> float:
    wavenumber = clamped_free_wavenumber(int(number), ELEMENT_COUNT)
    exact = wave_number("clamped-free", int(number))
    return abs(wavenumber / exact - 1) if np.isfinite(wavenumber) else 1.0


def _error_by_pivots(number: float) -> float:
    count = int(number)
    parts = max(ELEMENT_COUNT, count // 2)
    names = [f"part{k}" for k in range(parts)]
    beams = [uniform_beam(1.0, SHAPE_COUNT, name, length=1 / parts) for name in names]
    welds = row_hinges(names, "fixed")
    modes = compile_looped({"gravity": [0, 0, 0], "beam": beams, "hinge": welds}).modes(count)
    if not modes.is_complete:
        return 1.0
    return abs(float(np.sqrt(modes.omega[-1])) / wave_number("clamped-free", count) - 1)


DETERMINANT_SEARCH = CaseDefinition(
    name="determinant-search",
    title="Frequencies as zeros of a determinant: their number",
    cause="The determinant of the conditions at a free end is a difference of products of entries "
    "that grow with exp(beta L). Above about the eleventh mode of a cantilever only rounding is "
    "left of it, with an arbitrary sign; more elements do not help. The pivots of the sweep stay "
    "of the size of the stiffness, and the number of negative ones is the number of modes below a "
    "frequency. Where the determinant does not change its sign exactly once around a mode, the "
    "error counts as 1.",
    parameter="number of the mode", unit="", low=1, high=60, scale=COUNT_SCALE,
    measured="error of beta L, relative", limit=1e-3,
    method=MethodDefinition(
        f"signs of the determinant, {ELEMENT_COUNT} transfer matrices", _error_by_signs
    ),
    remedy=MethodDefinition("pivots of the sweep counted (model.modes)", _error_by_pivots),
    reach=200,
    source="Rui, Wang, Zhang, ch. 2 (transfer matrices of vibrating beams); Wittrick and Williams, "
    "Q. J. Mech. Appl. Math. 24, 1971 (the count)",
)  # fmt: skip


CASES = (
    PRODUCT_LENGTH,
    PRODUCT_ANGLE,
    PRODUCT_PIVOT,
    PRODUCT_MASSES,
    PRODUCT_ROOT,
    PRODUCT_BEAMS,
    DETERMINANT_SEARCH,
)
