"""Where the plain product of transfer matrices fails, and that the Riccati sweep does not.

Relative error of all hinge accelerations; the reference is a sweep of its own in long double.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mstmm
from tests.reference.compare import worst
from tests.support.scenes.rods import ROD, chain, drawn_state, precise_accelerations

#: Family -> type of hinge, angle between neighbouring pins (degrees).
FAMILIES = {
    "planar": ("pin", 0.0),
    "ball": ("ball", 0.0),
    "pins at 30": ("pin", 30.0),
    "pins at 60": ("pin", 60.0),
    "pins at 90": ("pin", 90.0),
}


def rods(family: str, count: int, **options: Any) -> dict[str, Any]:
    kind, skew = FAMILIES[family]
    options.setdefault("gravity", (0.0, -9.81, 0.0))
    return chain([kind] * count, np.deg2rad(skew), **options)


def error(scene: dict[str, Any], rng: np.random.Generator, **options: Any) -> float:
    """Worst of three states; infinite where the product has no answer at all."""
    model, found = mstmm.compile(mstmm.Scene(**scene), **options), 0.0
    for _ in range(3):
        q, u = drawn_state(scene, rng)
        try:
            udot = model.accelerations(q, u)
        except mstmm.NumericalFailure:
            assert options.get("sweep") == "product"
            return np.inf
        found = max(found, worst(udot, precise_accelerations(scene, q, u)))
    return found


def of_rounding(count: int) -> float:
    """Error that a sweep along so many bodies may gather, ten roundings a body and more: some
    states of 30 bodies lose five a body where their accelerations cancel, one in 1e4 of them."""
    return 1e-14 + 16 * count * 2.0**-53


@pytest.mark.parametrize("count", [1, 3, 30, 1000])
@pytest.mark.parametrize("family", FAMILIES)
def test_riccati_keeps_its_digits(family: str, count: int, rng: np.random.Generator) -> None:
    scene = rods(family, count)
    model = mstmm.compile(mstmm.Scene(**scene))
    q, u = drawn_state(scene, rng)
    assert worst(model.accelerations(q, u), precise_accelerations(scene, q, u)) < of_rounding(count)


def test_oblique_planar_chain_keeps_its_digits(rng: np.random.Generator) -> None:
    """A plane oblique to the inertial axes: harmless, because the sweep runs in hinge axes."""
    scene = rods("planar", 800, start=(0.7, -0.4, 1.1), gravity=(3.0, -7.0, 5.0))
    model = mstmm.compile(mstmm.Scene(**scene))
    q, u = drawn_state(scene, rng)
    assert worst(model.accelerations(q, u), precise_accelerations(scene, q, u)) < of_rounding(800)


#: Family -> bodies, smallest and largest error of the product expected there.
GROWTH = {
    "planar": [(3, 0.0, 1e-12), (10, 1e-13, 1e-7), (20, 1e-8, 1e-1), (40, 1.0, np.inf)],
    "ball": [(3, 0.0, 1e-12), (10, 1e-13, 1e-6), (20, 1e-8, 1e1), (40, 1.0, np.inf)],
    "pins at 30": [(3, 0.0, 1e-11), (10, 1e-12, 1e-3), (30, 1.0, np.inf)],
    "pins at 60": [(3, 0.0, 1e-10), (10, 1e-11, np.inf), (30, 1.0, np.inf)],
}


@pytest.mark.parametrize("family", GROWTH)
def test_error_of_the_product_grows_geometrically(family: str) -> None:
    """By about 4 per body, 6 for pins at 30 degrees, 15 at 60: useless from N = 30 on."""
    rng = np.random.default_rng(20)
    for count, least, most in GROWTH[family]:
        found = error(rods(family, count), rng, sweep="product", accuracy=np.inf)
        assert least <= found <= most, (count, found)


# --- vanishing pivots -------------------------------------------------------------------------


@pytest.mark.parametrize("moment", [0.20, 0.24, 0.2499, 0.25, 0.26, 0.30])
def test_riccati_at_the_percussion_centre(moment: float, rng: np.random.Generator) -> None:
    scene = rods("planar", 6, inertia=(moment,) * 3)
    assert error(scene, rng) < 1e-14


def test_product_near_the_percussion_centre_loses_its_digits() -> None:
    rng = np.random.default_rng(4)
    errors = [
        error(rods("planar", 6, inertia=(m,) * 3), rng, sweep="product", accuracy=np.inf)
        for m in (ROD, 0.20, 0.24, 0.2499)
    ]
    assert errors[0] < 1e-10
    assert errors[0] < errors[1] < errors[2] < errors[3]
    assert errors[3] > 1e-2


@pytest.mark.parametrize("moment", [0.25, 0.25 * (1 + 1e-10)])
def test_product_at_the_percussion_centre_names_the_hinge(
    moment: float, rng: np.random.Generator
) -> None:
    scene = rods("planar", 3, inertia=(moment,) * 3)
    model = mstmm.compile(mstmm.Scene(**scene), sweep="product")
    with pytest.raises(mstmm.NumericalFailure, match=r'hinge "hinge0".*pivot.*riccati'):
        model.accelerations(*drawn_state(scene, rng))


def test_product_of_perpendicular_pins_names_the_hinge(rng: np.random.Generator) -> None:
    scene = rods("pins at 90", 3)
    model = mstmm.compile(mstmm.Scene(**scene), sweep="product")
    with pytest.raises(mstmm.NumericalFailure, match=r'hinge "hinge0".*pivot.*riccati'):
        model.accelerations(*drawn_state(scene, rng))
    assert error(scene, rng) < 1e-14


def test_a_failing_product_ends_a_run_with_its_reason() -> None:
    model = mstmm.compile(mstmm.Scene(**rods("pins at 90", 3)), sweep="product")
    result = model.simulate(0.1)
    assert not result.success
    assert "pivot" in result.message
    assert "hinge0" in result.message


def test_a_long_planar_chain_is_determined() -> None:
    """Across its plane a chain grows as heavy as the cube of its length; no pivot sees that."""
    rod = {"mass": 1.0, "center_of_mass": [0.5, 0, 0], "inertia": [0.001, 1 / 12, 1 / 12]}
    link = {**rod, "ends": {"tip": [1, 0, 0]}}
    line = {"name": "rope", "count": 120_000, "inboard": "ground", "body": link}
    scene = mstmm.Scene(gravity=[0, -9.81, 0], chain=[{**line, "hinge": {"type": "pin"}}])
    model = mstmm.compile(scene)
    q, u = model.initial_state()
    # Near the root the answer does not feel how far away the tip is.
    short = mstmm.Scene(
        gravity=[0, -9.81, 0], chain=[{**line, "count": 60, "hinge": {"type": "pin"}}]
    )
    few = mstmm.compile(short)
    expected = few.accelerations(*few.initial_state())[:10]
    np.testing.assert_allclose(model.accelerations(q, u)[:10], expected, rtol=1e-12)
