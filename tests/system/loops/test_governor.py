"""Watt's governor: two loops that spin with their shaft, by rods and by stiff springs for rods.

Masses, lengths, start, stiffness and damping are those of problem A05 of the IFToMM library of
multibody benchmarks (F. Gonzalez, M. Gonzalez, J. Cuadrado, 2006).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

import mstmm
from tests.support.scenes.published_mechanisms import Scene

SPIN, ANGLE, HALF = 2 * np.pi, np.pi / 6, 0.5
ROD, BALL, SLIDER, COUPLER = 0.3, 5.0, 3.0, 0.15
TIMES = np.linspace(0.0, 2.0, 41)


def governor(rods: bool) -> Scene:
    """Arms of 1 m on the top of a shaft; from their middles to a slider go rods of 0.5 m, or
    springs as long."""
    bodies: list[Scene] = [
        {"name": "shaft", "mass": ROD, "inertia": [0.025, 0.025, 5e-6]},
        {"name": "slider", "mass": SLIDER, "inertia": [0.005, 0.005, 0.005]},
    ]
    hinges: list[Scene] = [
        {"name": "spin", "type": "pin", "inboard": "ground", "outboard": "shaft",
         "initial": {"u": SPIN}},
        {"name": "slide", "type": "prismatic", "inboard": "shaft", "outboard": "slider",
         "axis": [0, 0, 1], "initial": {"q": -float(np.cos(ANGLE))}},
    ]  # fmt: skip
    springs: list[Scene] = []
    for side, turn in (("right", -1), ("left", 1)):
        axis = [0, turn, 0]
        bodies += [
            {"name": f"arm_{side}", "mass": ROD, "center_of_mass": [0, 0, -0.5],
             "inertia": [ROD / 12, ROD / 12, 0],
             "ends": {"mid": [0, 0, -HALF], "tip": [0, 0, -1]}},
            {"name": f"ball_{side}", "mass": BALL},
        ]  # fmt: skip
        hinges += [
            {"name": f"arm_{side}", "type": "pin", "inboard": "shaft", "outboard": f"arm_{side}",
             "axis": axis, "initial": {"q": ANGLE}},
            {"name": f"ball_{side}", "type": "fixed", "inboard": f"arm_{side}.tip",
             "outboard": f"ball_{side}"},
        ]  # fmt: skip
        if not rods:
            law = {"stiffness": 8e5, "damping": 4e4, "rest": HALF}
            springs.append({"from": f"arm_{side}.mid", "to": "slider", "law": law})
            continue
        moment = COUPLER * HALF**2 / 12
        bodies.append({"name": f"rod_{side}", "mass": COUPLER, "center_of_mass": [0, 0, -HALF / 2],
                       "inertia": [moment, moment, 0], "ends": {"tip": [0, 0, -HALF]}})  # fmt: skip
        hinges += [
            {"name": f"elbow_{side}", "type": "pin", "inboard": f"arm_{side}.mid",
             "outboard": f"rod_{side}", "axis": axis, "initial": {"q": -2 * ANGLE}},
            {"name": f"closing_{side}", "type": "pin", "inboard": f"rod_{side}.tip",
             "outboard": "slider", "axis": axis, "initial": {"q": ANGLE}},
        ]  # fmt: skip
    return {"gravity": [0, 0, -9.81], "body": bodies, "hinge": hinges, "spring": springs}


def arms(coupler: float) -> np.ndarray:
    """Angle of the arms by Lagrange's equations: T = (A spin^2 + B turn^2)/2 with A, B of the
    angle, and the momentum A spin stays."""

    def spinning(s: float) -> float:
        return 5e-6 + 0.005 + 2 * s**2 * (BALL + ROD / 3 + coupler * HALF**2 / 3)

    def rates(_: float, y: Any) -> list[float]:
        c, s = np.cos(y[0]), np.sin(y[0])
        spin_slope = 4 * s * c * (BALL + ROD / 3 + coupler * HALF**2 / 3)
        of_rods = 2 * coupler * HALF**2 / 3
        turning = 2 * (BALL + ROD / 3) + SLIDER * s**2 + of_rods * (c**2 + 7 * s**2)
        turn_slope = 2 * s * c * (SLIDER + 6 * of_rods)
        weight = 9.81 * s * (2 * BALL + ROD + 1.5 * coupler + SLIDER)
        spin = momentum / spinning(s)
        load = spin_slope * spin**2 / 2 - turn_slope * y[1] ** 2 / 2 - weight
        return [y[1], load / turning]

    momentum = SPIN * spinning(np.sin(ANGLE))
    done = solve_ivp(
        rates, (0.0, TIMES[-1]), [ANGLE, 0.0], "DOP853", t_eval=TIMES, rtol=1e-12, atol=1e-12
    )
    return np.asarray(done.y[0])


def test_loops_that_spin_follow_lagrange() -> None:
    model = mstmm.compile(mstmm.Scene(**governor(rods=True)))
    assert (model.loops.rank, model.loops.mobility) == (4, 2)
    result = model.simulate(TIMES[-1], "dop853", rtol=1e-10, atol=1e-12, output_times=TIMES)
    assert result.success, result.message
    wanted = arms(COUPLER)
    for side in ("right", "left"):
        found = result.quantity(f"arm_{side}.angle").values
        assert np.abs(found - wanted).max() < 1e-8
    slid = result.quantity("slide.displacement").values
    assert np.abs(slid + np.cos(wanted)).max() < 1e-8
    momentum = result.angular_momentum()[:, 2]
    assert np.abs(momentum / momentum[0] - 1).max() < 1e-9


def test_springs_of_the_library_stand_for_rods_without_mass() -> None:
    """They yield by what they carry over 8e5 N/m, some 0.1 mm."""
    model = mstmm.compile(mstmm.Scene(**governor(rods=False)), engine="looped")
    result = model.simulate(TIMES[-1], "rodas4p2", rtol=1e-6, output_times=TIMES)
    assert result.success, result.message
    apart = np.abs(result.quantity("arm_left.angle").values - arms(0.0)).max()
    assert 1e-6 < apart < 5e-3


def test_a_rod_without_mass_pushes_along_itself_alone() -> None:
    scene = governor(rods=True)
    for body in scene["body"]:
        if body["name"].startswith("rod"):
            body |= {"mass": 1e-9, "inertia": [1e-12, 1e-12, 0]}
    result = mstmm.compile(mstmm.Scene(**scene)).simulate(0.5, rtol=1e-8)
    for side in ("right", "left"):
        force = result.force(f"closing_{side}")
        along = result.position(f"rod_{side}.tip") - result.position(f"rod_{side}")
        across = np.linalg.norm(np.cross(force, along), axis=1)
        assert across.max() < 1e-5 * np.linalg.norm(force, axis=1).max()
