"""A shaft that turns about its own axis, in axes that turn along: closed forms of every motion.

With natural frequencies a and b of the same shape in its two planes, and spin W, the amplitudes
y and z of an undamped shaft follow

    y'' - 2 W z' + (a^2 - W^2) y = 0,    z'' + 2 W y' + (b^2 - W^2) z = 0.

Round (a = b) it whirls at a + W and |a - W|, as in fixed axes at a forward and backward; between a
and b a shaft that is not round is unstable.
"""

from __future__ import annotations

import numpy as np
import pytest

import mstmm
from tests.support.scenes.linear import UNIT

#: beta^2 of a cantilever.
FREE = np.array([1.8751040687119611, 4.694091132974175]) ** 2


def shaft(across: tuple[float, float]) -> mstmm.Model:
    """A cantilever on a drive about its own axis, E I about y and z; polar inertia next to none."""
    beam = UNIT | {"name": "shaft", "bending_stiffness": list(across), "basis": "clamped-free",
                   "modes": {"y": 2, "z": 2}, "polar_inertia_per_length": 1e-12}  # fmt: skip
    hinge = {"name": "bearing", "type": "pin", "axis": [1, 0, 0], "inboard": "ground",
             "outboard": "shaft", "drive": "spin*t"}  # fmt: skip
    scene = mstmm.Scene(gravity=(0, 0, 0), constants={"spin": 1.0}, beam=[beam], hinge=[hinge])
    return mstmm.compile(scene, engine="looped")


def closed_form_roots(spin: float, a: float, b: float) -> np.ndarray:
    """s^4 + (a^2 + b^2 + 2 W^2) s^2 + (a^2 - W^2)(b^2 - W^2) = 0."""
    squares = np.roots([1, a**2 + b**2 + 2 * spin**2, (a**2 - spin**2) * (b**2 - spin**2)])
    return np.sqrt(squares.astype(complex))


@pytest.mark.parametrize("spin", [0.5, 2.0, 10.0, 40.0])
def test_a_round_shaft_whirls_forward_and_backward(spin: float) -> None:
    modes = shaft((1.0, 1.0)).with_parameters({"constants.spin": spin}).modes()
    expected = np.sort(np.concatenate([FREE + spin, np.abs(FREE - spin)]))
    np.testing.assert_allclose(np.sort(modes.omega), expected, rtol=1e-7)
    assert not modes.unstable.any()


@pytest.mark.parametrize("spin", [1.0, 3.2, 3.9, 4.5, 20.5])
def test_a_shaft_that_is_not_round(spin: float) -> None:
    """Between its two first, and its two second, bending frequencies one motion grows."""
    about_y, about_z = 1.44, 0.81
    modes = shaft((about_y, about_z)).with_parameters({"constants.spin": spin}).modes()
    expected = np.concatenate(
        [closed_form_roots(spin, f * np.sqrt(about_z), f * np.sqrt(about_y)) for f in FREE]
    )
    for one in expected:
        assert np.abs(np.abs(modes.eigenvalues) - np.abs(one)).min() < 1e-6 * abs(one)
    grown = max(expected.real)
    assert modes.eigenvalues.real.max() == pytest.approx(grown, rel=1e-6, abs=1e-6)
    inside = any(f * 0.9 < spin < f * 1.2 for f in FREE)
    assert (grown > 1e-3) == inside == bool(modes.unstable.any())


def test_the_onset_along_the_spin() -> None:
    """Found where the softer plane's frequency is met, and left where the stiffer one's is."""
    model = shaft((1.44, 0.81))
    for stable, unstable, place in ((2.0, 3.5, 0.9), (4.4, 3.5, 1.2)):
        found = model.stability_limit("constants.spin", stable, unstable)
        assert found.value == pytest.approx(place * FREE[0], rel=1e-6)
    locus = model.root_locus("constants.spin", np.linspace(0.1, 2.0, 5), 2)
    assert locus.eigenvalues.shape == (5, 2)
