"""Implicit runs of scenes that cannot go on: the message names the hinge and the time."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.errors import SceneError
from mstmm.runtime.integrate.c_loop import Status
from mstmm.runtime.integrate.steppers import IMPLICIT, get
from mstmm.runtime.integrate.steppers.alpha_family import NewmarkFamily
from mstmm.runtime.integrate.steppers.exprb32 import Exponential
from mstmm.runtime.integrate.steppers.implicit_methods import Implicit
from tests.runtime.run.test_run_messages_stops import check_remains, singular
from tests.support.implicit_methods import motions
from tests.support.scenes.results import pins

#: Those whose stages solve equations, which a motion that leaves by itself can make indefinite.
SOLVING = [
    method for method in IMPLICIT
    if get(method).adaptive and not isinstance(get(method), Exponential)
]  # fmt: skip


def steps(method: str, step: float = 0.01) -> dict[str, Any]:
    """`step` where the method takes no others."""
    return {} if get(method).adaptive else {"step": step}


@pytest.mark.parametrize("method", IMPLICIT)
def test_a_start_in_which_a_motion_is_undetermined(method: str) -> None:
    model = mstmm.compile(singular(), engine="looped")
    run = model.simulate(1.0, method, initial=([0.0, 0.0], [0.0, 0.0]), **steps(method))
    assert run.status is Status.RHS_FAILED
    assert 'hinge "roll" at t = 0 s' in run.message and "undetermined" in run.message


@pytest.mark.parametrize("method", IMPLICIT)
def test_a_run_into_a_state_in_which_a_motion_is_undetermined(method: str) -> None:
    """The rod is driven along x at t = 0.5, slowing down towards it: the inertia about x goes to
    zero, and near there a step's equations may be the first that have no solution."""
    data = singular().model_dump(by_alias=True, exclude_unset=True)
    data["hinge"][1].pop("initial")
    data["hinge"][1]["drive"] = ["0.5*max(1 - 2*t, 0)^2"]
    model = mstmm.compile(mstmm.Scene.from_data(data), engine="looped")
    run = model.simulate(1.0, method, **steps(method))
    assert run.status in (Status.RHS_FAILED, Status.TANGENT_FAILED)
    assert re.search(r'hinge "roll" at t = 0\.(5|49\d+) s', run.message)
    assert "inertia (law.inertia)" in run.message
    assert run.last_state[0] == pytest.approx(0.5, abs=0.011)
    check_remains(run)


@pytest.mark.parametrize("effort", ["sqrt(0.05 - t)", "log(0.06 + q)"])
@pytest.mark.parametrize("method", IMPLICIT)
def test_an_expression_that_is_no_number_is_named(method: str, effort: str) -> None:
    model = mstmm.compile(pins(1, [0.0], effort=[effort]), engine="looped")
    run = model.simulate(1.0, method, **steps(method, 1e-3))
    assert not run.success
    assert f'hinge "pin0": law.effort[0] = "{effort}" is nan at t = 0.' in run.message


# --- what topples ---------------------------------------------------------------------------------


def standing(stiffness: float) -> mstmm.Scene:
    """Three rods that stand on one another on pins with torsion springs (N m/rad)."""
    scene = motions.upright_chain(3, 1e-6)
    for hinge in scene["hinge"]:
        hinge["law"] = {"stiffness": stiffness}
    return mstmm.Scene(**scene)


def part_of_a_step(method: Implicit) -> float:
    """c of Z = M + C c' h + K (c h)^2, of the equations that a stage solves."""
    if isinstance(method, NewmarkFamily):
        return float(np.sqrt(method.beta_n * (1 - method.alpha_f) / (1 - method.alpha_m)))
    return method.gamma


@pytest.mark.parametrize("count", [1, 5, 20])
@pytest.mark.parametrize("method", SOLVING)
def test_a_step_longer_than_the_fall_of_a_chain_is_refused(method: str, count: int) -> None:
    """Z is definite up to c h lambda = 1, lambda the fastest rate at which the chain falls."""
    model = mstmm.compile(mstmm.Scene(**motions.upright_chain(count, 1e-6)), engine="looped")
    tableau = get(method)
    assert isinstance(tableau, Implicit)
    limit = 1 / (part_of_a_step(tableau) * motions.chain_frequencies(count).max())
    longest, too_long = 0.98 * limit, 1.02 * limit
    assert model.simulate(longest, method, longest).success
    run = model.simulate(too_long, method, too_long)
    assert run.status is Status.TANGENT_FAILED
    assert 'hinge "hinge' in run.message and "topples or buckles" in run.message
    assert "use a shorter step" in run.message
    assert run.last_state[0] == 0.0


@pytest.mark.parametrize("method", SOLVING)
def test_adaptive_steps_are_cut_where_a_chain_topples(method: str) -> None:
    """Tolerances that ask for nothing while the motion is small: the steps grow until Z is
    indefinite, and go on shorter."""
    model = mstmm.compile(standing(5.0), engine="looped")
    slopes = np.asarray(model.derivatives(*model.initial_state()).q)
    rate = np.sqrt(np.real(np.linalg.eigvals(slopes)).max())
    tableau = get(method)
    assert isinstance(tableau, Implicit)
    run = model.simulate(2.0, method, rtol=1e-2, atol=1e-2)
    assert run.success, run.message
    assert run.statistics is not None
    assert run.statistics.rejected_steps > 0
    assert run.statistics.largest_step is not None
    assert run.statistics.largest_step < 1.01 / (part_of_a_step(tableau) * rate)
    exact = model.simulate(2.0, rtol=1e-11, atol=1e-13, output_times=[2.0])
    assert 1e-4 < np.abs(exact.q).max() < 1e-3
    assert run.q[-1] == pytest.approx(exact.q[-1], abs=1e-2)


@pytest.mark.parametrize("method", ["rodas4p2", "esdirk436", "genalpha", "newmark"])
def test_springs_that_hold_a_chain_allow_every_step(method: str) -> None:
    model = mstmm.compile(standing(200.0), engine="looped")
    slopes = np.asarray(model.derivatives(*model.initial_state()).q)
    assert np.real(np.linalg.eigvals(slopes)).max() < 0
    for step in (0.1, 1.0, 10.0):
        run = model.simulate(20.0, method, step)
        assert run.success, run.message
        assert np.abs(run.q).max() < 1e-5
    model = mstmm.compile(standing(5.0), engine="looped")
    run = model.simulate(20.0, method, 1.0)
    assert run.status is Status.TANGENT_FAILED
    assert "negative stiffness" in run.message


# --- what is refused ------------------------------------------------------------------------------


def test_a_method_that_does_not_exist_is_refused_with_those_that_do() -> None:
    model = mstmm.compile(standing(200.0), engine="looped")
    with pytest.raises(
        SceneError, match=r'"rodas4p3" is not known; available are: .*rodas4p2.*houbolt'
    ):
        model.simulate(1.0, "rodas4p3")
    start = model.initial_state()
    with pytest.raises(SceneError, match='"rodas4p3" is not known'):
        model.simulate_batch(start, t_end=1.0, method="rodas4p3")


@pytest.mark.parametrize("radius", [-0.1, 1.5, np.nan, np.inf])
def test_a_radius_out_of_range_is_refused(radius: float) -> None:
    model = mstmm.compile(standing(200.0), engine="looped")
    for method in ("genalpha", "dttmm", "newmark"):
        with pytest.raises(SceneError, match="radius"):
            model.simulate(0.1, mstmm.methods.GeneralizedAlpha(method, radius=radius))
        with pytest.raises(SceneError, match="radius"):
            model.simulate_batch(
                model.initial_state(),
                t_end=0.1,
                method=mstmm.methods.GeneralizedAlpha(method, radius=radius),
            )


@pytest.mark.parametrize("method", ["wilson", "houbolt"])
def test_methods_of_fixed_steps_ask_for_one(method: str) -> None:
    model = mstmm.compile(standing(200.0), engine="looped")
    with pytest.raises(
        SceneError, match=f'"{method}" takes fixed steps: give step in s, or use genalpha'
    ):
        model.simulate(0.1, method)
