"""Spinning rotors in the fixed frame, against equations of motion written in it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.linalg import eig

import mstmm
from mstmm.array_validation import Array
from mstmm.errors import SceneError
from tests.support.scenes.linear import UNIT

#: Shaft of a disc at its tip: E I, length, mass, moments of inertia along and across the axis.
EI, LENGTH, MASS, POLAR, ACROSS = 2000.0, 0.5, 8.0, 0.3, 0.2
#: Stiffness of the tip of a cantilever, for displacement and slope w'.
TIP = EI * np.array([[12, -6 * LENGTH], [-6 * LENGTH, 4 * LENGTH**2]]) / LENGTH**3
#: Fixed axes: y' and the slopes of the shaft in both planes.
SPINS = [0.0, 30.0, 80.0, 200.0]


def overhung(bending: tuple[float, float] = (EI, EI), **more: Any) -> mstmm.Model:
    """A disc on a shaft without mass that is clamped to a driven pin."""
    bearing = {"name": "bearing", "type": "pin", "axis": [1, 0, 0], "outboard": "shaft",
               "inboard": more.pop("support", "ground"), "drive": "spin*t"}  # fmt: skip
    scene = mstmm.Scene(
        gravity=more.pop("gravity", [0, 0, 0]), constants={"spin": 0.0},
        body=[{"name": "disc", "mass": MASS, "inertia": [POLAR, ACROSS, ACROSS]},
              *more.pop("body", [])],
        beam=[{"name": "shaft", "length": LENGTH, "mass_per_length": 1e-7,
               "bending_stiffness": list(bending), "modes": {"y": 2, "z": 2},
               "basis": "static+fixed-interface", "polar_inertia_per_length": 1e-12}],
        hinge=[*more.pop("hinge", []), bearing,
               {"name": "hub", "type": "fixed", "inboard": "shaft.tip", "outboard": "disc"}],
        **more,
    )  # fmt: skip
    return mstmm.compile(scene, engine="looped")


def whirling(mass: Array, gyroscopic: Array, stiffness: Array) -> Array:
    """Angular frequencies in the fixed frame, rising; matrices of both planes."""
    n, zero = len(mass), np.zeros_like(mass)
    a = np.block([[zero, np.eye(n)], [-stiffness, -gyroscopic]])
    values = eig(a, np.block([[np.eye(n), zero], [zero, mass]]), right=False)
    return np.sort(values.imag[values.imag > 0])


def of_disc(spin: float) -> tuple[Array, Array, Array]:
    """M, G, K of (v, v', w, w') of the tip; the angular momentum POLAR * spin turns along."""
    mass, stiffness = np.diag([MASS, ACROSS, MASS, ACROSS]), np.zeros((4, 4))
    stiffness[:2, :2] = stiffness[2:, 2:] = TIP
    gyroscopic = np.zeros((4, 4))
    gyroscopic[1, 3], gyroscopic[3, 1] = POLAR * spin, -POLAR * spin
    return mass, gyroscopic, stiffness


def test_a_campbell_diagram_is_in_the_fixed_frame() -> None:
    locus = overhung().root_locus("constants.spin", SPINS)
    assert locus.frame == "fixed" and not locus.risks
    for found, spin in zip(2 * np.pi * locus.frequency, SPINS, strict=True):
        np.testing.assert_allclose(np.sort(found), whirling(*of_disc(spin)), rtol=1e-6)
    assert sorted(locus.whirl[-1].round(6)) == [-1, -1, 1, 1]
    forward = locus.whirl[-1] > 0
    assert (locus.frequency[-1] > locus.frequency[0])[forward].all()


def test_coordinates_that_turn_along_see_other_frequencies() -> None:
    """A motion at f is one at |f - spin| to the rotor, or at f + spin where it whirls backward."""
    model = overhung()
    spin = 80.0
    linear = model.with_parameters({"constants.spin": spin}).linearize()
    modes, fixed = linear.modes(), linear.to_fixed_frame().modes()
    assert (modes.frame, fixed.frame) == ("rotating", "fixed")
    np.testing.assert_allclose(
        np.sort(modes.omega), np.sort(np.abs(fixed.omega - spin * fixed.whirl)), rtol=1e-6
    )
    turned = model.root_locus("constants.spin", [spin], frame="rotating")
    assert turned.frame == "rotating" and not turned.risks
    np.testing.assert_allclose(np.sort(turned.frequency[0]), np.sort(modes.frequency), rtol=1e-9)


def rotor_on_carriage(across: float) -> mstmm.Model:
    """The same rotor on a carriage with a spring along y and another along z."""
    hinges = [
        {"name": "along", "type": "prismatic", "axis": [0, 1, 0], "inboard": "ground",
         "outboard": "slide", "law": {"stiffness": 3e4}},
        {"name": "up", "type": "prismatic", "axis": [0, 0, 1], "inboard": "slide",
         "outboard": "carriage", "law": {"stiffness": across}},
    ]  # fmt: skip
    bodies = [{"name": name, "mass": mass, "inertia": [1, 1, 1]}
              for name, mass in (("slide", 0.5), ("carriage", 2.0))]  # fmt: skip
    return overhung(support="carriage", hinge=hinges, body=bodies)


@pytest.mark.parametrize("across", [3e4, 9e4])
def test_a_rotor_on_a_mount_that_does_not_turn(across: float) -> None:
    """The mount may be stiffer along one axis: coefficients are constant in the fixed frame."""
    model, spin = rotor_on_carriage(across), 120.0
    linear = model.with_parameters({"constants.spin": spin}).linearize()
    found = linear.to_fixed_frame().modes()
    mass, gyroscopic, stiffness = (np.zeros((6, 6)) for _ in range(3))
    mass[:4, :4], gyroscopic[:4, :4], stiffness[:4, :4] = of_disc(spin)
    for own, moved, k in ((4, (0, 1), 3e4), (5, (2, 3), across)):
        rows = np.ix_(moved, moved)
        stiffness[own, list(moved)] = -stiffness[rows][0]
        stiffness[list(moved), own] = -stiffness[rows][:, 0]
        stiffness[own, own] = k + stiffness[rows][0, 0]
    mass[4, 4], mass[5, 5] = 2.5, 2.0
    np.testing.assert_allclose(
        np.sort(found.omega), whirling(mass, gyroscopic, stiffness), rtol=1e-6
    )


def test_a_force_that_stands_still_and_what_it_moves() -> None:
    """Displacement of the disc in inertial axes under a force in these, at one frequency."""
    spin, omega = 60.0, np.array([20.0, 50.0, 95.0])
    linear = overhung().with_parameters({"constants.spin": spin}).linearize().to_fixed_frame()
    found = linear.frequency_response(omega, ["disc.fy"], ["disc.position.y", "disc.position.z"])
    mass, gyroscopic, stiffness = of_disc(spin)
    for w, values in zip(omega, found.response[:, :, 0], strict=True):
        moved = np.linalg.inv(stiffness + 1j * w * gyroscopic - w**2 * mass)[[0, 2], 0]
        np.testing.assert_allclose(values, moved, rtol=1e-5)


def test_coordinates_that_do_not_turn_stay_as_they_are() -> None:
    """A disc on a pin whose tilting mount stands on the ground: J a'' -+ i C spin a' + k a = 0."""
    scene = mstmm.Scene(
        gravity=[0, 0, 0], constants={"spin": 0.0},
        body=[{"name": "cross", "mass": 0.1, "inertia": [1e-9, 1e-9, 1e-9]},
              {"name": "frame", "mass": 0.1, "inertia": [1e-9, 1e-9, 1e-9]},
              {"name": "disc", "mass": 1.0, "inertia": [0.5, 0.3, 0.3]}],
        hinge=[{"name": "yaw", "type": "pin", "axis": [0, 1, 0], "inboard": "ground",
                "outboard": "cross", "law": {"stiffness": 40.0}},
               {"name": "pitch", "type": "pin", "axis": [0, 0, 1], "inboard": "cross",
                "outboard": "frame", "law": {"stiffness": 40.0}},
               {"name": "shaft", "type": "pin", "axis": [1, 0, 0], "inboard": "frame",
                "outboard": "disc", "drive": "spin*t"}],
    )  # fmt: skip
    model, spin = mstmm.compile(scene, engine="looped"), 25.0
    locus = model.root_locus("constants.spin", [0.0, spin])
    assert locus.frame == "fixed" and not locus.risks
    gyroscopic = 0.5 * spin / 0.3
    known = np.sqrt(40 / 0.3 + gyroscopic**2 / 4) + np.array([-1, 1]) * gyroscopic / 2
    np.testing.assert_allclose(np.sort(2 * np.pi * locus.frequency[1]), known, rtol=1e-6)
    assert model.with_parameters({"constants.spin": spin}).modes().frame == "fixed"


def test_two_rotors_that_turn_against_each_other() -> None:
    """Each shaft keeps the frequency of a cantilever in the fixed frame."""
    beams = [UNIT | {"name": name, "bending_stiffness": [1.0, 1.0], "basis": "clamped-free",
                     "modes": {"y": 2, "z": 2}, "polar_inertia_per_length": 1e-12}
             for name in ("one", "two")]  # fmt: skip
    hinges = [{"name": f"pin_{name}", "type": "pin", "axis": [1, 0, 0], "inboard": "ground",
               "outboard": name, "drive": drive}
              for name, drive in (("one", "spin*t"), ("two", "0 - 3*spin*t"))]  # fmt: skip
    scene = mstmm.Scene(gravity=[0, 0, 0], constants={"spin": 0.0}, beam=beams, hinge=hinges)
    model = mstmm.compile(scene, engine="looped")
    locus = model.root_locus("constants.spin", [0.0, 1.0, 5.0])
    known = np.repeat(np.array([1.8751040687119611, 4.694091132974175]) ** 2, 4)
    np.testing.assert_allclose(np.sort(2 * np.pi * locus.frequency, axis=1), [known] * 3, rtol=1e-7)


def test_a_rotor_that_is_not_axisymmetric_is_told() -> None:
    model = overhung((EI, 1.2 * EI))
    locus = model.root_locus("constants.spin", SPINS)
    assert locus.frame == "rotating"
    (risk,) = (one for one in locus.risks if one.name == "rotating-frame")
    assert risk.invalidates and not locus.trusted
    assert "stiffness of shaft.y1" in risk.description
    with pytest.raises(SceneError, match="not axisymmetric"):
        model.root_locus("constants.spin", SPINS, frame="fixed")
    with pytest.raises(SceneError, match='expected "auto", "fixed" or "rotating"'):
        model.root_locus("constants.spin", SPINS, frame="inertial")
    asked = model.root_locus("constants.spin", SPINS, frame="rotating")
    assert not [one for one in asked.risks if one.name == "rotating-frame"]
    np.testing.assert_array_equal(asked.frequency, locus.frequency)


def test_a_free_body_that_spins_about_its_axis() -> None:
    """A free top nutates at C spin / A in the fixed frame."""
    scene = mstmm.Scene(
        gravity=[0, 0, 0],
        body=[{"name": "top", "mass": 1.0, "inertia": [0.5, 0.3, 0.3]}],
        hinge=[{"name": "free", "type": "ball", "inboard": "ground", "outboard": "top"}],
    )
    model = mstmm.compile(scene, engine="looped")
    linear = model.linearize(q=[1.0, 0, 0, 0], u=[12.0, 0, 0])
    found = linear.to_fixed_frame().modes()
    assert linear.frame == "rotating"
    assert found.omega.max() == pytest.approx(0.5 * 12 / 0.3, rel=1e-6)
