"""Rotors with blades in the fixed frame: ground resonance in closed form and by Floquet."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import mstmm
from mstmm.array_validation import Array
from mstmm.errors import SceneError

Complex = NDArray[np.complex128]

#: Masses of the mount and of a blade; distances of the lag hinge and, from it, the mass centre.
SUPPORT, BLADE, OFFSET, ARM = 25.0, 1.5, 0.3, 0.6
#: Moment of inertia of a blade about its lag hinge; laws of mount and lag hinge.
INERTIA = 0.2 + BLADE * ARM**2
STIFF, DAMP, LAG_STIFF, LAG_DAMP = 3000.0, 5.0, 15.0, 0.3


def helicopter(count: int, stiffness: tuple[float, float] = (STIFF, STIFF), **more: Any) -> Any:
    """A hub that a drive spins on a mount of two sliders, with blades on lag hinges."""
    angles = [2 * np.pi * k / count for k in range(count)]
    ends = {f"grip{k}": {"position": [OFFSET * np.cos(a), OFFSET * np.sin(a), 0],
                         "orientation": [0, 0, a]} for k, a in enumerate(angles)}  # fmt: skip
    masses = more.pop("masses", [BLADE] * count)
    law = [{"stiffness": k, "damping": DAMP} for k in stiffness]
    scene = mstmm.Scene(
        gravity=[0, 0, 0], constants={"speed": 10.0},
        body=[{"name": "slide", "mass": 0.0},
              {"name": "mount", "mass": SUPPORT - 20, "inertia": [1, 1, 1]},
              {"name": "hub", "mass": 20.0, "inertia": [1, 1, 1], "ends": ends},
              *({"name": f"blade{k}", "mass": masses[k], "center_of_mass": [ARM, 0, 0],
                 "inertia": [0.01, 0.2, 0.2]} for k in range(count))],
        hinge=[{"name": "x", "type": "prismatic", "axis": [1, 0, 0], "inboard": "ground",
                "outboard": "slide", "law": law[0]},
               {"name": "y", "type": "prismatic", "axis": [0, 1, 0], "inboard": "slide",
                "outboard": "mount", "law": law[1]},
               {"name": "mast", "type": "pin", "axis": [0, 0, 1], "inboard": "mount",
                "outboard": "hub", "drive": "speed*t"},
               *({"name": f"lag{k}", "type": "pin", "axis": [0, 0, 1], "inboard": f"hub.grip{k}",
                  "outboard": f"blade{k}", "law": {"stiffness": LAG_STIFF, "damping": LAG_DAMP}}
                 for k in range(count))],
        **more,
    )  # fmt: skip
    return mstmm.compile(scene, engine="looped")


def lag(rate: Complex | complex, speed: float) -> Any:
    """Lag equation of one blade in the rotating frame, of exp(rate t)."""
    held = LAG_STIFF + BLADE * OFFSET * ARM * speed**2
    return INERTIA * rate**2 + LAG_DAMP * rate + held


def dynamic_stiffness(rate: Any, count: int, speed: float) -> Any:
    """Of the mount x + i y under exp(rate t), N/m: Coleman and Feingold's equations of isotropic
    supports, blades eliminated; the sum of blades' lag angles turns with the hub."""
    mount = (SUPPORT + count * BLADE) * rate**2 + DAMP * rate + STIFF
    return mount - count / 2 * (BLADE * ARM * rate**2) ** 2 / lag(rate - 1j * speed, speed)


def closed_form(count: int, speed: float) -> Complex:
    """All eigenvalues in the fixed frame with positive frequency."""
    poly: Any = np.polynomial.Polynomial
    own = poly([LAG_STIFF + BLADE * OFFSET * ARM * speed**2, LAG_DAMP, INERTIA])
    mount = poly([STIFF, DAMP, SUPPORT + count * BLADE])
    turned = own(poly([-1j * speed, 1]))
    whole = mount * turned - count / 2 * (BLADE * ARM) ** 2 * poly([0, 0, 0, 0, 1])
    found = [*whole.roots(), *np.conj(whole.roots()), *own.roots()]
    if count % 2 == 0:
        found += own.roots().tolist()
    for harmonic in range(2, (count - 1) // 2 + 1):
        found += [root + sign * 1j * harmonic * speed for root in own.roots() for sign in (1, -1)]
    values = np.array(found)
    return rising(values[values.imag > 0])


def rising(values: Complex) -> Complex:
    """In the order of frequencies, then growth."""
    return values[np.lexsort((values.real, values.imag.round(9)))]


@pytest.mark.parametrize(("count", "speed"), [(3, 4.0), (3, 14.0), (4, 10.0), (5, 22.0)])
def test_ground_resonance_has_the_eigenvalues_of_the_closed_form(count: int, speed: float) -> None:
    model = helicopter(count).with_parameters({"constants.speed": speed})
    linear = model.linearize()
    (risk,) = linear.risks
    assert risk.name == "changing-coefficients" and "to_fixed_frame" in risk.remedy
    fixed = linear.to_fixed_frame()
    found = fixed.modes()
    assert fixed.frame == "fixed" and "changing-coefficients" not in {x.name for x in fixed.risks}
    np.testing.assert_allclose(rising(found.eigenvalues), closed_form(count, speed), rtol=1e-9)


def test_growth_over_the_speed_in_the_fixed_frame() -> None:
    speeds = np.linspace(0, 30, 16)
    locus = helicopter(4).root_locus("constants.speed", speeds)
    assert locus.frame == "fixed" and "rotating-frame" not in {x.name for x in locus.risks}
    known = np.array([closed_form(4, speed).real.max() for speed in speeds])
    assert known.max() > 0.1 and known.min() < 0
    np.testing.assert_allclose(locus.growth_rate.max(axis=1), known, atol=1e-8)


def test_lag_patterns_whirl_with_the_mass_centre_of_the_blades() -> None:
    model = helicopter(4).with_parameters({"constants.speed": 20.0})
    found = model.linearize().to_fixed_frame().modes()
    own = np.sqrt((LAG_STIFF + BLADE * OFFSET * ARM * 400) / INERTIA)
    regressing = np.abs(found.omega - (20 - own)).argmin()
    progressing = found.omega.argmax()
    assert found.whirl[[regressing, progressing]] == pytest.approx([1, 1], abs=0.05)
    alone = np.abs(found.omega - own) < 1e-3
    np.testing.assert_allclose(found.whirl[alone], 0, atol=1e-12)


def test_unsymmetric_supports_against_floquet() -> None:
    """Multipliers of a turn are exp(eigenvalue * period) of the equations in the fixed frame."""
    speed, stiffness = 13.0, (2000.0, 5000.0)
    model = helicopter(3, stiffness).with_parameters({"constants.speed": speed})
    values = model.linearize().to_fixed_frame().modes().eigenvalues
    period = 2 * np.pi / speed
    start = np.eye(10)
    columns = [solve_ivp(periodic(3, speed, stiffness), (0, period), start[k], rtol=1e-11,
                         atol=1e-13).y[:, -1] for k in range(10)]  # fmt: skip
    known = np.linalg.eigvals(np.array(columns).T)
    found = np.exp(np.concatenate([values, np.conj(values)]) * period)
    apart = np.abs(found[:, None] - known)
    assert apart.min(axis=0).max() < 1e-8 and apart.min(axis=1).max() < 1e-8


def periodic(count: int, speed: float, stiffness: tuple[float, float]) -> Callable[..., Array]:
    """Lagrange's equations of (x, y, lag angles) about the spin, written by hand."""
    azimuths = 2 * np.pi * np.arange(count) / count

    def rates(t: float, state: Array) -> Array:
        q, u = np.split(state, 2)
        a = speed * t + azimuths
        toward = np.array([-np.sin(a), np.cos(a)])
        mass = np.diag([SUPPORT + count * BLADE] * 2 + [INERTIA] * count)
        mass[:2, 2:], mass[2:, :2] = BLADE * ARM * toward, BLADE * ARM * toward.T
        turning = np.array([-np.cos(a), -np.sin(a)])
        load = np.zeros(count + 2)
        load[:2] = stiffness * q[:2] + DAMP * u[:2]
        load[:2] += BLADE * ARM * (2 * speed * turning @ u[2:] - speed**2 * toward @ q[2:])
        load[2:] = (LAG_STIFF + BLADE * OFFSET * ARM * speed**2) * q[2:] + LAG_DAMP * u[2:]
        return np.concatenate([u, np.linalg.solve(mass, -load)])

    return rates


def test_a_force_on_the_mount_has_the_response_of_the_closed_form() -> None:
    omega = np.linspace(1.0, 25.0, 9)
    fixed = helicopter(4).linearize(inputs=["mount.force.x"]).to_fixed_frame()
    answer = fixed.frequency_response(omega, ["mount.force.x"], ["x.displacement"])
    forward, backward = (1 / dynamic_stiffness(sign * 1j * omega, 4, 10.0) for sign in (1, -1))
    known = (forward + np.conj(backward)) / 2
    np.testing.assert_allclose(answer.response[:, 0, 0], known, rtol=1e-8)
    assert answer.trusted


def test_an_unbalance_of_the_hub_whirls_as_in_the_closed_form() -> None:
    speeds = np.array([4.0, 10.0, 22.0])
    found = helicopter(4).unbalance_response("constants.speed", speeds, "hub", 1e-2)
    stiffness = [dynamic_stiffness(1j * speed, 4, speed) for speed in speeds]
    known = np.abs(1e-2 * speeds**2 / np.array(stiffness))
    np.testing.assert_allclose(found.amplitude[:, 0], known, rtol=1e-8)


def test_beams_as_blades_are_seen_at_sums_with_the_spin() -> None:
    """On a hub that stays in place each motion is of one harmonic h, at omega + h * speed."""
    count, speed = 3, 12.0
    ends = {f"grip{k}": {"position": [0, 0, 0], "orientation": [0, 0, 2 * np.pi * k / count]}
            for k in range(count)}  # fmt: skip
    beam = {"length": 2.0, "mass_per_length": 0.5, "bending_stiffness": [300.0, 600.0],
            "polar_inertia_per_length": 0.01, "modes": {"y": 1, "z": 1}}  # fmt: skip
    model = mstmm.compile(mstmm.Scene(
        gravity=[0, 0, 0],
        body=[{"name": "hub", "mass": 1.0, "inertia": [1, 1, 1], "ends": ends}],
        beam=[beam | {"name": f"blade{k}"} for k in range(count)],
        hinge=[{"name": "mast", "type": "pin", "axis": [0, 0, 1], "inboard": "ground",
                "outboard": "hub", "drive": f"{speed}*t"},
               *({"name": f"root{k}", "type": "fixed", "inboard": f"hub.grip{k}",
                  "outboard": f"blade{k}"} for k in range(count))],
    ), engine="looped")  # fmt: skip
    linear = model.linearize()
    own = linear.modes().omega
    assert np.ptp(own[:3]) < 1e-6 * own[0] and np.ptp(own[3:]) < 1e-6 * own[3]
    known = [abs(one + h * speed) for one in own[[0, 3]] for h in (-1, 0, 1)]
    found = linear.to_fixed_frame().modes().omega
    np.testing.assert_allclose(np.sort(found), np.sort(known), rtol=1e-9)


def test_two_blades_or_unequal_ones_have_no_fixed_frame() -> None:
    for model in (helicopter(2), helicopter(3, masses=[BLADE, BLADE, 1.2 * BLADE])):
        with pytest.raises(SceneError, match="not axisymmetric"):
            model.linearize().to_fixed_frame()
