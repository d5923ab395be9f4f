"""What is known to be bad is reached from the cases of the atlas alone, and is bad as it should."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

import grimp
import numpy as np
import pytest

import mstmm
from mstmm.array_validation import Array
from mstmm.atlas.cases.classical import coordinates_without_predictor
from mstmm.atlas.cases.flexible_shapes import clamped_free_shape
from mstmm.atlas.cases.loops_motion import largest_gap
from mstmm.atlas.cases.loops_rows import accelerations_at_rest
from mstmm.atlas.cases.rotations import (
    attitude_by_rosenbrock,
    attitude_by_rotation_vectors,
    unnormalised_coordinates,
)
from mstmm.atlas.cases.steps_laws import LawTangentSteps
from mstmm.atlas.cases.steps_rosenbrock import BareRosenbrock, ros3p_tableau
from mstmm.atlas.cases.sweeps_axes import accelerations_in_inertial_axes
from mstmm.atlas.shared_scenes import (
    ROD_AXIAL_INERTIA,
    ROD_TRANSVERSE_INERTIA,
    chain,
    compile_looped,
    double_pendulum,
    elbow_with_spring,
    four_bar,
    random_pin_states,
    rod,
    spinning_top,
)
from mstmm.runtime.flexible.beam.shape_functions import Eigenfunction
from mstmm.runtime.model.model import Model


def test_only_cases_reach_the_variants() -> None:
    graph = grimp.build_graph("mstmm")
    users = {
        user
        for case in graph.find_descendants("mstmm.atlas.cases")
        for user in graph.find_modules_that_directly_import(case)
    }
    assert users
    assert all(user.startswith("mstmm.atlas.cases.") for user in users)


# --- rotations and shapes -----------------------------------------------------------------------


def test_a_raw_quaternion_turns_as_the_good_one_does() -> None:
    """It differs in length, not in what it says of the attitude."""
    model = spinning_top("ball", (0.4, 1.6, 1.1))
    raw = unnormalised_coordinates(model, 0.01, 500)
    good = model.simulate(5.0, rtol=1e-12, atol=1e-14, output_times=[5.0]).q[-1]
    assert np.abs(raw / np.linalg.norm(raw) * np.sign(raw @ good) - good).max() < 1e-6


def order(end_of: Callable[[Model, float, int], Array]) -> float:
    """Of the attitude of a body that turns freely."""
    top = spinning_top("ball", (0.4, 1.6, 1.1))
    exact = top.simulate(1.0, rtol=1e-13, atol=1e-15, output_times=[1.0]).q[-1]
    errors = [np.abs(end_of(top, 1 / n, n) - exact).max() for n in (20, 40)]
    assert errors[1] < 1e-3
    return math.log2(errors[0] / errors[1])


@pytest.mark.parametrize(("products", "expected"), [(0, 2), (1, 3), (2, 4)])
def test_charts_are_of_the_order_that_their_products_allow(products: int, expected: int) -> None:
    """By a method of fourth; towards the same attitude."""
    found = order(partial(attitude_by_rotation_vectors, products=products))
    assert found == pytest.approx(expected, abs=0.1)


@pytest.mark.parametrize(("slope", "expected"), [(True, 4), (False, 2)])
def test_rosenbrock_steps_on_charts_need_their_slope(slope: bool, expected: int) -> None:
    found = order(partial(attitude_by_rosenbrock, method="rodas4p2", slope=slope))
    assert found == pytest.approx(expected, abs=0.2)


@pytest.mark.parametrize("number", [1, 2, 5])
def test_low_shapes_are_those_of_the_textbook(number: int) -> None:
    xi = np.linspace(0, 1, 21)
    stable = Eigenfunction("clamped-free", number, 0.0, 1.0)(xi)
    printed = clamped_free_shape(number, xi)
    sign = np.sign(printed[-1] * stable[-1])
    np.testing.assert_allclose(printed * sign, stable, atol=1e-9)


def test_a_run_offers_none_of_them() -> None:
    with pytest.raises(mstmm.SceneError, match="raw-quaternions"):
        spinning_top("ball").simulate(1.0, "raw-quaternions")


# --- the sweep in inertial axes -----------------------------------------------------------------


def test_the_sweep_in_inertial_axes_keeps_its_digits_in_a_plane_along_them() -> None:
    """It is the sweep; what it loses elsewhere is due to the axes alone."""
    count, pin, weight = 800, np.array([0.0, 0.0, 1.0]), np.array([0.0, -9.81, 0.0])
    row = compile_looped(chain(count))
    body = np.array(
        [
            1.0,
            0.5,
            0,
            0,
            ROD_AXIAL_INERTIA,
            0,
            0,
            ROD_TRANSVERSE_INERTIA + 0.25,
            0,
            ROD_TRANSVERSE_INERTIA + 0.25,
        ]
    )
    for q, u in random_pin_states(count):
        angle = np.cumsum(q)
        cos, sin = np.cos(angle), np.sin(angle)
        axes = np.zeros((count, 3, 3))
        axes[:, 0, 0], axes[:, 0, 1], axes[:, 1, 0], axes[:, 1, 1] = cos, -sin, sin, cos
        axes[:, 2, 2] = 1.0
        points = np.cumsum(axes[:, :, 0], axis=0) - axes[:, :, 0]
        found = accelerations_in_inertial_axes(axes, points, pin, body, u, weight)
        own = row.accelerations(q, u)
        assert np.abs(found - own).max() < 1e-12 * np.abs(own).max()


# --- steps --------------------------------------------------------------------------------------


def test_iterated_steps_forget_where_they_were_expanded() -> None:
    """Only the predictor of the steps that stall is another one."""
    rods, h, steps = double_pendulum(), 0.01, 20
    good = rods.simulate(
        steps * h,
        mstmm.methods.ClassicalDiscreteTime("dttmm-classical", scheme="newmark", iterations=20),
        h,
        output_times=[steps * h],
    )
    held = coordinates_without_predictor(rods, h, steps, iterations=20)
    assert np.abs(held - good.q[-1]).max() < 1e-12
    assert np.abs(coordinates_without_predictor(rods, h, steps) - good.q[-1]).max() > 1e-3


def driven_rod() -> mstmm.Model:
    """A rod on a spring that is pulled by a torque of time."""
    law = {"effort": "sin(3*t) - 20*q - 2*u"}
    pin = {"name": "pin", "type": "pin", "inboard": "ground", "outboard": "rod", "law": law}
    return compile_looped({"gravity": [0, -9.81, 0], "body": [rod("rod")], "hinge": [pin]})


@pytest.mark.parametrize("method, order", [("rodas4", 1), ("rodas5p", 2), ("ros34pw2", 3)])
def test_without_the_slope_in_time_the_order_falls(method: str, order: int) -> None:
    """Of the conditions of order that hold for an autonomous system fewer do for this one: those of
    W-methods stay."""
    pulled = driven_rod()
    exact = pulled.simulate(1.0, rtol=1e-12, atol=1e-14, output_times=[1.0]).q[-1]
    errors = [
        np.abs(
            BareRosenbrock(pulled, method, time_slope=False).fixed_step_states(1 / n, n)[-1, 0]
            - exact
        ).max()
        for n in (40, 80)
    ]
    assert math.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.3)


def test_ros3p_is_what_its_authors_say() -> None:
    """Of third order, with an estimate of second; sqrt(3) - 1 of infinitely fast motion stays."""
    pulled, table = driven_rod(), ros3p_tableau()
    exact = pulled.simulate(1.0, rtol=1e-12, atol=1e-14, output_times=[1.0]).q[-1]
    errors = [
        np.abs(BareRosenbrock(pulled, table).fixed_step_states(1 / n, n)[-1, 0] - exact).max()
        for n in (40, 80)
    ]
    assert math.log2(errors[0] / errors[1]) == pytest.approx(3, abs=0.2)
    needed = [
        BareRosenbrock(pulled, table).adaptive_step_count(1.0, rtol, 1e-2 * rtol, 100_000)
        for rtol in (1e-4, 1e-7)
    ]
    assert needed[1] / needed[0] == pytest.approx(10, rel=0.3)  # the cube root of 1000
    assert abs(table.amplification([1e8j])[0]) == pytest.approx(math.sqrt(3) - 1, abs=1e-6)


@pytest.mark.parametrize("method", ["rodas4", "rodas4p2", "rodas5p"])
def test_whole_steps_are_those_of_a_run(method: str) -> None:
    pulled, n = driven_rod(), 80
    run = pulled.simulate(1.0, method, 1 / n, output_times=[1.0])
    assert (
        np.abs(BareRosenbrock(pulled, method).fixed_step_states(1 / n, n)[-1, 0] - run.q[-1]).max()
        < 1e-13
    )


ELBOW_END = 0.5


@pytest.mark.parametrize("method, order", [("rodas4", 1), ("rodas4p2", 2), ("rodas5p", 2)])
def test_by_laws_alone_the_order_falls(method: str, order: int) -> None:
    arm = elbow_with_spring(10.0, 0.2)
    exact = arm.simulate(ELBOW_END, rtol=1e-12, atol=1e-14, output_times=[ELBOW_END]).q[-1]
    errors = [
        np.abs(
            LawTangentSteps(arm, method).fixed_step_states(ELBOW_END / n, n)[-1, 0] - exact
        ).max()
        for n in (128, 256)
    ]
    assert math.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.2)


@pytest.mark.parametrize("method", ["ros34pw2", "rodas4pw"])
def test_steps_by_laws_are_those_of_a_run_where_it_offers_them(method: str) -> None:
    arm, n = elbow_with_spring(1e5, 2e3), 32
    run = arm.simulate(
        ELBOW_END,
        mstmm.methods.Implicit(method, tangent="laws"),
        ELBOW_END / n,
        output_times=[ELBOW_END],
    )
    assert (
        np.abs(
            LawTangentSteps(arm, method).fixed_step_states(ELBOW_END / n, n)[-1, 0] - run.q[-1]
        ).max()
        < 1e-13
    )


class ByWay(BareRosenbrock):
    """Steps in which speeds weigh by what they move, with the tolerances of coordinates."""

    def size(self, h: float, error: Array) -> float:
        return float(max(np.sqrt(np.mean(error[0] ** 2)), h * np.sqrt(np.mean(error[1] ** 2))))


def test_only_the_norm_makes_steps_short() -> None:
    """A spring that swings for nobody to see."""
    arm = elbow_with_spring(1e8)
    assert ByWay(arm, "rodas4p2").adaptive_step_count(0.5, 1e-4, 1e-6, 100) < 20
    with pytest.raises(mstmm.NumericalFailure, match="more than 1000 steps"):
        BareRosenbrock(arm, "rodas4p2").adaptive_step_count(0.5, 1e-4, 1e-6, 1000)


# --- closed loops -------------------------------------------------------------------------------


def test_baumgarte_closes_a_gap_that_is_left_to_itself_otherwise() -> None:
    """By fourth order of the step, until the rate is too high for it."""
    names = ("crank", "coupler", "rocker")
    hinges = [
        {"name": "foot", "type": "pin", "inboard": "ground", "outboard": "crank", "hold": True,
         "initial": {"q": [1.0], "u": [2.0]}},
        {"name": "knee", "type": "pin", "inboard": "crank.tip", "outboard": "coupler",
         "initial": {"q": [-1.0]}},
        {"name": "heel", "type": "pin", "inboard": "ground", "outboard": "rocker",
         "position": [1, 0.2, 0], "initial": {"q": [1.2]}},
        {"name": "top", "type": "pin", "inboard": "coupler.tip", "outboard": "rocker.tip"},
    ]  # fmt: skip
    linkage = compile_looped(
        {"gravity": [0, -9.81, 0], "body": [*map(rod, names)], "hinge": hinges}
    )
    left, held = (largest_gap(linkage, 0.01, 100, rate) for rate in (0.0, 10.0))
    assert held < 0.3 * left < 1e-3
    assert largest_gap(linkage, 0.005, 200, 0.0) == pytest.approx(left / 16, rel=0.5)
    assert math.isnan(largest_gap(linkage, 0.01, 100, 400.0))


def test_all_rows_of_parallel_axes_give_the_motion_of_the_plane() -> None:
    """Three of five rows repeat others to the last digit, and count for nothing; a hair askew they
    hold the linkage where it is."""
    straight, tree = compile_looped(four_bar()), compile_looped(four_bar(closed=False))
    q, u = straight.initial_state()
    found = accelerations_at_rest(straight, tree, q)
    np.testing.assert_allclose(found, straight.accelerations(q, u)[:3], rtol=1e-12)
    askew, tree = (compile_looped(four_bar(askew=1e-5, closed=closed)) for closed in (True, False))
    held = accelerations_at_rest(askew, tree, askew.initial_state()[0])
    assert np.abs(held).max() < 1e-3 * np.abs(found).max()
