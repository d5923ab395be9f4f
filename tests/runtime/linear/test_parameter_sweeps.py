"""Unbalance response against Jeffcott's closed form and dense equations in the fixed frame."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.array_validation import Array
from mstmm.errors import SceneError

MASS, UNBALANCE = 8.0, 3e-4
SPINS = np.array([0.0, 20.0, 60.0, 69.0, 120.0, 400.0])


def jeffcott(stiffness: list[list[float]], damping: list[list[float]], **more: Any) -> mstmm.Model:
    """A disc on a pin in a carriage without mass, which a bearing holds across the axis x."""
    light = {"mass": 1e-9, "inertia": [1e-9] * 3}
    scene = mstmm.Scene(
        gravity=[0, 0, 0], constants={"spin": 0.0},
        body=[{"name": "slide", **light}, {"name": "housing", **light},
              {"name": "disc", "mass": MASS, "inertia": [0.1, 0.05, 0.05]}],
        hinge=[{"name": "y", "type": "prismatic", "axis": [0, 1, 0], "inboard": "ground",
                "outboard": "slide"},
               {"name": "z", "type": "prismatic", "axis": [0, 0, 1], "inboard": "slide",
                "outboard": "housing"},
               {"name": "pin", "type": "pin", "axis": [1, 0, 0], "inboard": "housing",
                "outboard": "disc", "drive": "spin*t"}],
        bushing=[{"name": "film", "from": "ground", "to": "housing", "conservative": False,
                  "stiffness": stiffness, "damping": damping}],
        **more,
    )  # fmt: skip
    return mstmm.compile(scene, engine="looped")


def test_jeffcott_rotor(tmp_path: Path) -> None:
    """Amplitude (m e / M) r^2 / sqrt((1 - r^2)^2 + (2 zeta r)^2), r = spin / omega."""
    k, c = 38400.0, 60.0
    found = jeffcott([[k, 0], [0, k]], [[c, 0], [0, c]]).unbalance_response(
        "constants.spin", SPINS, "disc", UNBALANCE
    )
    omega = np.sqrt(k / MASS)
    r, zeta = SPINS / omega, c / (2 * MASS * omega)
    known = UNBALANCE / MASS * r**2 / np.sqrt((1 - r**2) ** 2 + (2 * zeta * r) ** 2)
    np.testing.assert_allclose(found.spin, SPINS)
    np.testing.assert_allclose(found.amplitude[:, 0], known, rtol=1e-6)
    np.testing.assert_allclose(found.minor_axis[:, 0], known, rtol=1e-6)
    lag = np.arctan2(2 * zeta * r, 1 - r**2)[1:]
    first = found.displacements[1:, 0] @ found.directions[0]
    np.testing.assert_allclose(np.angle(first), -lag, atol=1e-6)
    rows = list(csv.reader(found.save(tmp_path / "whirl.csv").read_text().splitlines()))
    assert rows[0] == [
        "constants.spin",
        "spin [rad/s]",
        "disc amplitude [m]",
        "disc minor axis [m]",
    ]
    np.testing.assert_array_equal(np.array(rows[1:], float)[:, 2], found.amplitude[:, 0])
    found.plot(tmp_path / "whirl.png")
    assert (tmp_path / "whirl.png").stat().st_size > 5000


def test_cross_coupled_bearing_makes_ellipses() -> None:
    """Between the critical speeds of an orthotropic bearing the whirl is backward."""
    stiffness: Array = np.array([[20000.0, 3000.0], [-1000.0, 90000.0]])
    damping: Array = np.array([[20.0, 5.0], [-8.0, 30.0]])
    found = jeffcott(stiffness.tolist(), damping.tolist()).unbalance_response(
        "constants.spin", SPINS[1:], "disc", UNBALANCE
    )
    for spin, moved in zip(SPINS[1:], found.displacements[:, 0], strict=True):
        dynamic = stiffness + 1j * spin * damping - spin**2 * MASS * np.eye(2)
        known = np.linalg.solve(dynamic, UNBALANCE * spin**2 * np.array([1, -1j]))
        phase = found.directions[0, 1] - 1j * found.directions[1, 1]
        np.testing.assert_allclose(moved[1:], known * phase, rtol=1e-6, atol=1e-12)
    assert (found.minor_axis[:, 0] < 0).tolist() == [False, True, True, False, False]


def test_of_a_shaft_in_its_own_axes() -> None:
    """A massless shaft with a disc: coordinates turn along, the whirl is that of fixed axes."""
    ei, length = 2000.0, 0.5
    scene = mstmm.Scene(
        gravity=[0, 0, 0], constants={"spin": 0.0},
        body=[{"name": "disc", "mass": MASS, "inertia": [0.3, 0.2, 0.2]}],
        beam=[{"name": "shaft", "length": length, "mass_per_length": 1e-7,
               "bending_stiffness": [ei, ei], "modes": {"y": 2, "z": 2},
               "basis": "static+fixed-interface", "polar_inertia_per_length": 1e-12}],
        hinge=[{"name": "bearing", "type": "pin", "axis": [1, 0, 0], "inboard": "ground",
                "outboard": "shaft", "drive": "spin*t"},
               {"name": "hub", "type": "fixed", "inboard": "shaft.tip", "outboard": "disc"}],
    )  # fmt: skip
    model = mstmm.compile(scene, engine="looped")
    found = model.unbalance_response("constants.spin", SPINS, "disc", UNBALANCE, ["shaft.tip"])
    tip = ei * np.array([[12, -6 * length], [-6 * length, 4 * length**2]]) / length**3
    for spin, amplitude in zip(SPINS, found.amplitude[:, 0], strict=True):
        dynamic = tip - spin**2 * np.diag([MASS, 0.2 - 0.3])  # circular whirl forward
        known = np.linalg.solve(dynamic, [UNBALANCE * spin**2, 0])[0]
        assert amplitude == pytest.approx(abs(known), rel=1e-5)


def test_refused() -> None:
    model = jeffcott([[32000.0, 0], [0, 32000.0]], [[0.0, 0], [0, 0]])
    with pytest.raises(SceneError, match="does not spin"):
        model.unbalance_response("constants.spin", [50.0], "housing", UNBALANCE)
    with pytest.raises(SceneError, match="expected a body or an end"):
        model.unbalance_response("constants.spin", [50.0], "disk", UNBALANCE)


def test_inputs_of_the_scene_do_not_speak_against_the_whirl() -> None:
    """A force in axes that do not turn along with the disc changes its effect there, but the
    imbalance is no such input."""
    held, damped = [[38400.0, 0], [0, 38400.0]], [[60.0, 0], [0, 60.0]]
    push = {"on": "disc", "axes": "disc", "force": [0, "kick", 0]}
    model = jeffcott(held, damped, input=[{"name": "kick"}], load=[push])
    spun = model.with_parameters({"constants.spin": 20.0}).linearize()
    assert any(risk.name == "changing-input" for risk in spun.risks)
    found = model.unbalance_response("constants.spin", [20.0], "disc", UNBALANCE)
    alone = jeffcott(held, damped).unbalance_response("constants.spin", [20.0], "disc", UNBALANCE)
    np.testing.assert_allclose(found.amplitude, alone.amplitude, rtol=1e-9)
    assert found.trusted and found.warnings == alone.warnings
