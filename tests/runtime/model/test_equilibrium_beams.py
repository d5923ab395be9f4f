"""Equilibria and static starts of beams, bent far and stiff in one direction beside another."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import mstmm

Array = NDArray[np.float64]


def welded_beam_model(parts: int, force: float, axes: str = "inertial", **beam: Any) -> mstmm.Model:
    """A clamped beam of length 1, mass 1 and EI 1 in welded parts, a force across at its end."""
    table = {
        "length": 1 / parts, "mass_per_length": 1.0, "bending_stiffness": 1.0, "modes": {"y": 3},
        "frame": "mean", **beam,
    }  # fmt: skip
    beams = [{"name": f"p{i}", **table} for i in range(parts)]
    inboard = ["ground", *(f"p{i}.tip" for i in range(parts - 1))]
    hinges = [
        {"name": f"w{i}", "type": "fixed", "inboard": inboard[i], "outboard": f"p{i}"}
        for i in range(parts)
    ]
    load = {"name": "push", "on": f"p{parts - 1}.tip", "force": [0, force, 0], "axes": axes}
    return mstmm.compile(mstmm.Scene(gravity=[0, 0, 0], beam=beams, hinge=hinges, load=[load]))


def tip(model: mstmm.Model, q: Array, end: str) -> Array:
    run = model.simulate(0.0, initial=(q, np.zeros(model.nu)))
    return np.asarray(run.position(end)[0, :2])


def elastica(force: float) -> Array:
    """Tip of the exact beam of length 1 and EI 1, clamped along x, by shooting from its end: the
    angle to the force has delta'' = P sin delta, delta' = 0 at the end and delta = pi/2 at 0."""

    def shot(angle: float) -> Array:
        return np.asarray(
            solve_ivp(
                lambda _, y: [y[1], force * np.sin(y[0]), np.sin(y[0]), np.cos(y[0])],
                (0.0, 1.0), [angle, 0.0, 0.0, 0.0], rtol=1e-10, atol=1e-12,
            ).y[:, -1]
        )  # fmt: skip

    small = 1e-6
    while shot(2 * small)[0] < np.pi / 2:
        small *= 2
    return shot(brentq(lambda angle: shot(angle)[0] - np.pi / 2, small, 2 * small))[2:]


def follower_force_tip(force: float) -> Array:
    """Tip of the same beam under a force that stays across its end: from there, phi = theta_tip -
    theta has phi'' = P cos phi without a condition at the other end."""
    end = solve_ivp(
        lambda _, y: [y[1], force * np.cos(y[0]), np.cos(y[0]), np.sin(y[0])],
        (0.0, 1.0), [0.0, 0.0, 0.0, 0.0], rtol=1e-10, atol=1e-12,
    ).y[:, -1]  # fmt: skip
    turned, along, across = end[0], end[2], end[3]
    c, s = np.cos(turned), np.sin(turned)
    return np.array([c * along + s * across, s * along - c * across])


@pytest.mark.parametrize("force", [2.0, 10.0])
def test_far_bending_is_the_elastica(force: float) -> None:
    model = welded_beam_model(8, force)
    assert np.abs(tip(model, model.equilibrium(), "p7.tip") - elastica(force)).max() < 2e-4


def test_far_bending_under_a_force_that_follows_the_end() -> None:
    model = welded_beam_model(10, 20.0, "body")
    assert np.abs(tip(model, model.equilibrium(), "p9.tip") - follower_force_tip(20.0)).max() < 2e-2


def test_a_stiff_direction_does_not_end_the_search_in_a_soft_one() -> None:
    """Axial shapes are ten million times stiffer than bending."""
    model = welded_beam_model(4, 2.0, axial_stiffness=1e7, modes={"y": 3, "axial": 2})
    q = model.equilibrium()
    assert np.abs(model.accelerations(q, np.zeros(model.nu))).max() < 1e-6
    assert np.abs(tip(model, q, "p3.tip") - elastica(2.0)).max() < 2e-3


def test_a_soft_twist_beside_stiff_tension_is_determined() -> None:
    model = welded_beam_model(
        1, 0.1, modes={"y": 2, "twist": 2, "axial": 2}, frame="tangent", axial_stiffness=1e10,
        torsional_stiffness=1.0, polar_inertia_per_length=0.01,
    )  # fmt: skip
    q = model.equilibrium()
    assert tip(model, q, "p0.tip")[1] == pytest.approx(0.1 / 3, rel=1e-2)


def test_a_first_step_out_of_the_model_is_made_shorter() -> None:
    """Linear bending would turn the end by 20 rad."""
    model = welded_beam_model(10, 30.0)
    assert np.abs(tip(model, model.equilibrium(), "p9.tip") - elastica(30.0)).max() < 1e-3


def test_a_static_start_is_found_where_the_equilibrium_is() -> None:
    model = welded_beam_model(10, 10.0, initial="static")
    q, _ = model.initial_state()
    assert np.abs(q - model.equilibrium(np.zeros(model.nq))).max() < 1e-9
    assert np.abs(tip(model, q, "p9.tip") - elastica(10.0)).max() < 1e-4


def test_residuals_have_the_names_of_the_coordinates() -> None:
    model = welded_beam_model(4, 2.0)
    found = model.equilibrium()
    assert list(found.residuals) == model.coordinate_layout.u_names
    still = np.zeros(model.nu)
    left = model.inverse_dynamics(found, still, still)
    assert list(found.residuals.values()) == left.tolist()
    assert np.abs(left).max() < 1e-12


def test_no_equilibrium_says_what_is_left_and_where() -> None:
    free = {"name": "slide", "type": "prismatic", "inboard": "ground", "outboard": "b"}
    body = {"name": "b", "mass": 2.0, "inertia": [1.0, 1.0, 1.0]}
    model = mstmm.compile(mstmm.Scene(gravity=[0, 0, -10], body=[body], hinge=[free]))
    with pytest.raises(mstmm.NumericalFailure, match=r"unbalanced load of -20 along slide"):
        model.equilibrium()


@pytest.mark.parametrize("force", [0.0, 1e16])
def test_a_static_start_far_beyond_the_beam_is_refused(force: float) -> None:
    """Under a weight of 1e31 N, alone or beside a load."""
    beam = {"name": "b", "length": 1.0, "mass_per_length": 1e30, "bending_stiffness": 1.0}
    beam |= {"initial": "static", "modes": {"y": 2}}
    hinge = {"name": "h", "type": "fixed", "inboard": "ground", "outboard": "b"}
    load = {"on": "b.tip", "force": [0, force, 0]}
    scene = mstmm.Scene(gravity=[0, -9.81, 0], beam=[beam], hinge=[hinge], load=[load])
    with pytest.raises(mstmm.NumericalFailure, match="static deformation"):
        mstmm.compile(scene).initial_state()
