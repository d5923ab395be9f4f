"""Implicit methods on closed loops: their orders, stiff mechanisms, the choice among methods."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.runtime.engine.loops.loop_calls import LoopCalls
from mstmm.runtime.run.spectral_radius import FastestMode
from tests.support.scenes.linkages import four_bar, legs, rod
from tests.support.scenes.published_mechanisms import andrews

from .test_four_bar import linkage

#: Method -> order, and equal steps of the coarser of two runs.
ORDERS = {
    "rodas4": (4, 40), "rodas4p2": (4, 40), "rodas5p": (5, 40), "ros34pw2": (3, 40),
    "rodas4pw": (4, 40), "esdirk436": (4, 20), "kvaerno5": (5, 20), "genalpha": (2, 80),
    "hht": (2, 80), "newmark": (2, 80), "wilson": (2, 80), "houbolt": (2, 160),
}  # fmt: skip


def bushed_four_bar(stiffness: float) -> dict[str, Any]:
    """A four-bar whose rocker stands on stiff springs and dampers along and across."""
    angle = four_bar()["hinge"][3]["initial"]["q"]
    damping = 0.1 * math.sqrt(stiffness)
    law = {"stiffness": [stiffness] * 2 + [0.0], "damping": [damping] * 2 + [0.0]}
    return four_bar(end={"type": "planar", "law": law, "initial": {"q": [0.0, 0.0, angle]}})


def slider(stiffness: float) -> dict[str, Any]:
    """A crank that a rod ties to a slider, which stands on a stiff spring and damper; the crank is
    driven through a shaft, a spring that is as stiff."""
    crank, reach = 0.6, 0.3
    lean = -math.asin(reach * math.sin(crank) / 1.0)
    place = reach * math.cos(crank) + math.cos(lean)
    law = {"stiffness": stiffness, "damping": 0.1 * math.sqrt(stiffness), "rest": 0.1}
    shaft = {"stiffness": 0.1 * stiffness, "damping": 0.02 * math.sqrt(stiffness)}
    return {
        "gravity": [0, -9.81, 0],
        "body": [rod("flywheel", 0.2, 2.0), rod("crank", reach, 0.7), rod("rod", 1.0, 1.1),
                 rod("slider", 0.1, 0.8)],
        "hinge": [
            {"name": "motor", "type": "pin", "inboard": "ground", "outboard": "flywheel",
             "drive": f"{crank!r} + 0.3*sin(4*t)"},
            {"name": "shaft", "type": "pin", "inboard": "flywheel", "outboard": "crank",
             "law": shaft},
            {"name": "knee", "type": "pin", "inboard": "crank.tip", "outboard": "rod",
             "initial": {"q": lean - crank}},
            {"name": "guide", "type": "prismatic", "inboard": "ground", "outboard": "slider",
             "axis": [1, 0, 0], "position": [place, 0, 0], "law": law},
            {"name": "wrist", "type": "pin", "inboard": "rod.tip", "outboard": "slider",
             "initial": {"q": -lean}, "cut": True},
        ],
    }  # fmt: skip


def scene_of_laws() -> dict[str, Any]:
    """A four-bar with springs, dampers, an effort of time and rotors, without friction."""
    scene = linkage("closing_pin")
    del scene["hinge"][2]["law"]["friction"]
    return scene


@pytest.fixture(scope="module")
def smooth() -> tuple[mstmm.Model, np.ndarray[Any, Any]]:
    model = mstmm.compile(mstmm.Scene(**scene_of_laws()))
    reference = model.simulate(0.8, "dop853", rtol=1e-12, atol=1e-13, output_times=[0.0, 0.8])
    return model, reference.q[-1]


@pytest.mark.parametrize("method", ORDERS)
def test_orders(method: str, smooth: tuple[mstmm.Model, np.ndarray[Any, Any]]) -> None:
    (model, wanted), (order, steps) = smooth, ORDERS[method]
    errors = []
    for n in (steps, 2 * steps):
        result = model.simulate(0.8, method, step=0.8 / n, output_times=[0.0, 0.8])
        assert result.success, result.message
        errors.append(float(np.abs(result.q[-1] - wanted).max()))
    print(method, errors, np.log2(errors[0] / errors[1]))
    assert errors[0] < 1e-2
    assert np.log2(errors[0] / errors[1]) > order - 0.35


def test_loops_in_one_point() -> None:
    """Andrews' squeezer, whose rows say little beside its small masses."""
    model = mstmm.compile(mstmm.Scene(**andrews()))
    wanted = model.simulate(0.005, rtol=1e-12, atol=1e-13, output_times=[0.0, 0.005])
    results = [
        model.simulate(0.005, "rodas5p", step=0.005 / n, output_times=[0.0, 0.005])
        for n in (20, 40)
    ]
    errors = [float(np.abs(r.q[-1] - wanted.q[-1]).max()) for r in results]
    assert errors[1] < 1e-8
    assert np.log2(errors[0] / errors[1]) > 4.5


def test_loops_in_space() -> None:
    """Six legs on springs: universal and ball hinges in six loops."""
    model = mstmm.compile(mstmm.Scene(**legs(law=1000.0)))
    wanted = model.simulate(0.2, rtol=1e-12, atol=1e-13, output_times=[0.0, 0.2])
    result = model.simulate(0.2, "rodas5p", rtol=1e-8, output_times=[0.0, 0.2])
    assert np.abs(result.q[-1] - wanted.q[-1]).max() < 1e-6


@pytest.fixture(scope="module", params=[bushed_four_bar, slider], ids=["bushed", "slider"])
def stiff_model(request: pytest.FixtureRequest) -> mstmm.Model:
    return mstmm.compile(mstmm.Scene(**request.param(1e6)))


@pytest.mark.parametrize(
    ("method", "much"), [("rodas4p2", 1e-7), ("kvaerno5", 1e-6), ("genalpha", 1e-3)]
)
def test_stiff_mechanisms(method: str, much: float, stiff_model: mstmm.Model) -> None:
    """By its own steps, against many explicit ones; loops are closed where steps end."""
    times = np.linspace(0.0, 0.3, 7)
    wanted = stiff_model.simulate(0.3, "dop853", rtol=1e-10, atol=1e-12, output_times=times)
    result = stiff_model.simulate(0.3, method, rtol=1e-6, output_times=times)
    assert result.success, result.message
    assert np.abs(result.q[-1] - wanted.q[-1]).max() < much
    calls = LoopCalls(stiff_model.looped, result.q[-1])
    for level in (calls.position_level, calls.velocity_level):
        missing = calls.correction(level, result.q[-1], result.u[-1], t=0.3)[1]
        assert np.abs(missing).max() < 1e-10


def test_steps_do_not_go_by_stiffness() -> None:
    """A motion that is a hundred times as fast would cost an explicit method as many more steps."""
    steps = []
    for stiffness in (1e6, 1e10):
        model = mstmm.compile(mstmm.Scene(**slider(stiffness)))
        result = model.simulate(0.2, "rodas4p2", rtol=1e-5)
        assert result.success, result.message
        assert result.statistics is not None
        steps.append(result.statistics.steps)
    assert steps[1] < 2 * steps[0]


def test_choice() -> None:
    """A stiff mechanism goes on by implicit steps, a slack one by explicit ones."""
    model = mstmm.compile(mstmm.Scene(**slider(1e9)))
    result = model.simulate(0.3, "auto", rtol=1e-5, output_times=[0.0, 0.3])
    assert [one.method for one in result.method_history][:2] == ["dop853", "rodas4p2"]
    wanted = model.simulate(0.3, "rodas5p", rtol=1e-9, output_times=[0.0, 0.3])
    assert np.abs(result.q[-1] - wanted.q[-1]).max() < 1e-6
    slack = mstmm.compile(mstmm.Scene(**four_bar())).simulate(0.3, "auto", rtol=1e-5)
    assert [one.method for one in slack.method_history] == ["dop853"]


def test_error_asked_for() -> None:
    model = mstmm.compile(mstmm.Scene(**bushed_four_bar(1e7)))
    result = model.simulate(0.3, error=1e-6, output_times=[0.0, 0.3])
    wanted = model.simulate(0.3, "rodas5p", rtol=1e-11, atol=1e-13, output_times=[0.0, 0.3])
    assert np.abs(result.q[-1] - wanted.q[-1]).max() < 1e-6


def test_fastest_motion() -> None:
    """What `auto` decides by is an eigenvalue of the accelerations' own derivatives."""
    model = mstmm.compile(mstmm.Scene(**bushed_four_bar(1e8)))
    q, u = model.initial_state()
    found = FastestMode(model.looped, model.looped.start_memory()).rate(0.0, q, u)
    step, n = 1e-6, model.nu
    columns = [
        np.array([
            model.accelerations(*((q + d, u) if kind else (q, u + d)))
            - model.accelerations(*((q - d, u) if kind else (q, u - d)))
            for d in step * np.eye(n)
        ]).T / (2 * step)
        for kind in (1, 0)
    ]  # fmt: skip
    whole = np.block([[np.zeros((n, n)), np.eye(n)], columns])
    assert found == pytest.approx(np.abs(np.linalg.eigvals(whole)).max(), rel=1e-3)


def test_a_drive_that_lets_go_where_the_loop_closes() -> None:
    """Its row has a multiplier before the release, the hinge's speed is unknown behind it."""
    scene = linkage("closing_pin", False)
    closing = scene["hinge"][3]
    closing["drive"] = f"{closing.pop('initial')['q']!r} + 0.3*t"
    del scene["hinge"][0]["initial"]["u"]
    scene["event"] = [{"name": "go", "when": "t > 0.2", "do": "release", "hinge": "closing_pin"}]
    model = mstmm.compile(mstmm.Scene(**scene))
    wanted = model.simulate(0.6, rtol=1e-10, output_times=[0.0, 0.6])
    for method, much in (("rodas5p", 1e-8), ("kvaerno5", 1e-6)):
        result = model.simulate(0.6, method, rtol=1e-8, output_times=[0.0, 0.6])
        assert result.success, result.message
        assert np.abs(result.q[-1] - wanted.q[-1]).max() < much


def test_sessions_and_batches() -> None:
    """Ticks of a session are the fixed steps of one run, a batch has what runs alone have."""
    model = mstmm.compile(mstmm.Scene(**bushed_four_bar(1e6)))
    session = model.session(method="genalpha", step=1e-3)
    for _ in range(4):
        session.advance(0.02)
    alone = model.simulate(0.08, "genalpha", step=1e-3, output_times=[0.0, 0.08])
    assert np.array_equal(session.q, alone.q[-1])
    q, u = model.initial_state()
    starts = np.array([q, q]), np.array([u, u])
    batch = model.simulate_batch(starts, t_end=0.05, method="rodas4p2", rtol=1e-6)
    assert batch.success.all()
    run = model.simulate(0.05, "rodas4p2", rtol=1e-6, initial=(q, u), output_times=[0.0, 0.05])
    assert np.abs(batch.q[0, -1] - run.q[-1]).max() < 1e-12
