"""Where the sweep and the integrators stay accurate, and where they must say that they do not."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from reference import closed_forms as known
from reference import newton_euler as dense
from reference import planar_chain
from reference.algebra import quaternion_matrix
from reference.compare import worst
from reference.jets import Array, as_jet
from reference.random_scenes import random_state

import mstmm


def compiled(scene: dict[str, Any]) -> mstmm.Model:
    return mstmm.compile(mstmm.Scene(**scene))


def planar_error(masses: Array, rng: np.random.Generator, orientation: Any = (0, 0, 0)) -> float:
    """Error of a planar chain of thin rods at a random state, relative, max-norm."""
    n = len(masses)
    q, u = rng.uniform(-1, 1, n), rng.uniform(-1, 1, n)
    model = compiled(planar_chain.scene(masses, masses / 12, orientation))
    expected = planar_chain.accelerations(masses, masses / 12, q, u)
    return worst(model.accelerations(q, u), expected)


@pytest.mark.parametrize("n", [3, 30, 300, 1000])
def test_planar_chains_of_any_length(n: int, rng: np.random.Generator) -> None:
    assert planar_error(np.ones(n), rng) < 2e-13


def test_planar_chain_in_an_oblique_plane(rng: np.random.Generator) -> None:
    assert planar_error(np.ones(800), rng, (0.3, 0.5, 0.7)) < 2e-13


@pytest.mark.parametrize("kind", ["pin", "ball"])
def test_spatial_chain_of_sixty(kind: str) -> None:
    """Perpendicular pins, at which the plain product has no pivot, and balls."""
    scene = planar_chain.scene(np.ones(60), np.full(60, 1 / 12))
    for i, hinge in enumerate(scene["hinge"]):
        hinge |= {"type": kind, "axis": np.eye(3)[i % 3].tolist()}
    q, u = random_state(scene, 3)
    assert worst(compiled(scene).accelerations(q, u), dense.solve(scene, q, u).udot) < 2e-13


@pytest.mark.parametrize("power", [0, 2, 4, 6, 8])
def test_heavy_tip_loses_digits_in_proportion(power: int, rng: np.random.Generator) -> None:
    masses = np.ones(8)
    masses[-1] = 10.0**power
    assert planar_error(masses, rng) < 1e-14 + 4e-15 * 10.0**power


def test_a_very_heavy_tip_is_reported() -> None:
    masses = np.ones(8)
    masses[-1] = 1e12
    result = compiled(planar_chain.scene(masses, masses / 12)).simulate(
        0.01, method="rk4", step=0.005
    )
    assert any("heavy" in warning for warning in result.warnings)


@pytest.mark.parametrize("power", [4, 8])
def test_heavy_root_and_falling_masses_lose_none(power: int, rng: np.random.Generator) -> None:
    masses = np.ones(8)
    masses[0] = 10.0**power
    assert planar_error(masses, rng) < 2e-14
    assert planar_error(10.0 ** -np.arange(12.0), rng) < 2e-14


def test_percussion_centres_are_no_special_place(rng: np.random.Generator) -> None:
    """J_C = M r_IC (r_IO - r_IC): the pivot of the plain product vanishes."""
    masses, q, u = np.ones(6), rng.uniform(-1, 1, 6), rng.uniform(-1, 1, 6)
    model = compiled(planar_chain.scene(masses, masses / 4))
    expected = planar_chain.accelerations(masses, masses / 4, q, u)
    assert worst(model.accelerations(q, u), expected) < 1e-13


def oscillator(rate: float) -> dict[str, Any]:
    scene = known.top_scene(1.0, 0.0, 1.0, 1.0, gravity=0.0)
    scene["hinge"][0] |= {"type": "prismatic", "law": {"stiffness": rate**2}}
    return scene


@pytest.mark.parametrize("share", [0.95, 1.05])
def test_stability_limit_of_runge_kutta_four(share: float) -> None:
    """Undamped: stable for step * rate < 2 sqrt(2)."""
    rate = 200.0
    step = share * 2 * np.sqrt(2) / rate
    model = compiled(oscillator(rate))
    result = model.simulate(1000 * step, method="rk4", step=step, initial=([1.0], [0.0]))
    assert (np.abs(result.q).max() <= 1.0) == (share < 1)
    assert (abs(result.q[-1, 0]) > 1e3) == (share > 1)


@pytest.mark.parametrize("share", [0.95, 1.05])
def test_stability_limit_on_the_real_axis(share: float) -> None:
    """Strong damping: stable for step * |lambda| < 2.785."""
    damping = 400.0
    scene = oscillator(1.0)
    scene["hinge"][0]["law"]["damping"] = damping
    fastest = (damping + np.sqrt(damping**2 - 4)) / 2
    step = share * 2.785 / fastest
    result = compiled(scene).simulate(2000 * step, method="rk4", step=step, initial=([1.0], [0.0]))
    assert (np.abs(result.q).max() <= 1.0 + 1e-12) == (share < 1)


def passage(kind: str, miss: float) -> mstmm.Result:
    """Spherical body that turns past pitch 90 degrees at the angle `miss` from it."""
    scene = known.top_scene(1.0, 0.0, 0.4, 0.4, gravity=0.0)
    scene["hinge"][0]["type"] = kind
    start = [1.0, 0.0, 0.0, 0.0] if kind == "ball" else [0.0, 0.0, 0.0]
    return compiled(scene).simulate(
        2.0, method="rk4", step=1e-3, initial=(start, [miss, np.sqrt(1 - miss**2), 0.0])
    )


@pytest.mark.parametrize("miss", [0.1, 1e-2, 1e-5])
def test_balls_pass_where_three_angles_fail(miss: float) -> None:
    omega = np.array([miss, np.sqrt(1 - miss**2), 0.0])
    expected = known.free_top_attitude(2.0, 0.4, 0.4, np.eye(3), omega)
    ball, gimbal = passage("ball", miss), passage("gimbal", miss)
    found = quaternion_matrix(as_jet(ball.orientation("top")[-1])).x
    assert np.abs(found - expected).max() < 1e-12
    assert ball.certificate.singular is None
    assert any("use a ball" in warning for warning in gimbal.warnings) == (miss < 1e-3)


def test_quaternions_stay_normalised() -> None:
    scene = known.top_scene(1.0, 0.2, 0.4, 0.3)
    result = compiled(scene).simulate(
        100.0, method="rk4", step=1e-3, initial=([1, 0, 0, 0], [0.5, 1.0, 2.0])
    )
    assert np.abs(np.linalg.norm(result.q, axis=1) - 1).max() < 1e-14


def test_order_of_runge_kutta_four_in_the_energy_of_a_double_pendulum() -> None:
    scene = planar_chain.scene(np.ones(2), np.full(2, 1 / 12))
    start = ([0.3, 0.9], [0.0, 0.0])
    drifts = []
    for step in (4e-3, 2e-3, 1e-3):
        energy = compiled(scene).simulate(4.0, method="rk4", step=step, initial=start).energy()
        drifts.append(abs(energy[-1] - energy[0]))
    ratios = np.array(drifts[:-1]) / np.array(drifts[1:])
    assert np.all((np.log2(ratios) > 4.4) & (np.log2(ratios) < 5.6))


@pytest.mark.parametrize("inertia", [[0, 0, 0], [0, 0.1, 0.1]])
def test_motion_without_inertia_is_named(inertia: list[float]) -> None:
    scene = known.pendulum_scene()
    scene["body"][0]["inertia"] = inertia
    scene["hinge"][0] |= {"type": "ball"}
    scene["hinge"][0].pop("initial")
    with pytest.raises(mstmm.MstmmError, match="pivot"):
        compiled(scene).accelerations([1, 0, 0, 0], [0, 0, 0])
