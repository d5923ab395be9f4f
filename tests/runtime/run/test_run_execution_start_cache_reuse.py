"""A run that begins where the last one of its model has left its integrator says what a first one
would."""

from __future__ import annotations

import gc
import threading
import weakref
from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.runtime.run import run_execution
from tests.support.paths import ROOT
from tests.support.scenes.results import rod


def scene() -> mstmm.Scene:
    """A damped pendulum that counts its blows against the floor, and is driven by an input."""
    return mstmm.Scene(
        gravity=[0, -9.81, 0], body=[rod("a"), rod("b")],
        input=[{"name": "push", "unit": "N*m", "value": 1.0}],
        hinge=[
            {"name": "h", "type": "pin", "inboard": "ground", "outboard": "a",
             "law": {"damping": 0.1, "effort": "push"}},
            {"name": "k", "type": "ball", "inboard": "a.tip", "outboard": "b"},
        ],
        event=[{"name": "floor", "when": "h.q < -1.7", "do": "bounce", "restitution": 0.5}],
    )  # fmt: skip


STARTS = ([0.3, 0.6, 0.0, 0.8, 0.0], [-1.0, 1.0, 0.0, 0.0, 0.0], [0.3, 0.6, 0.0, 0.8, 0.0])
TIMES = np.linspace(0.0, 1.0, 9)


def run(model: mstmm.Model, q: Any, method: str = "dop853", **more: Any) -> mstmm.Result:
    return model.simulate(1.0, method, output_times=TIMES, initial=(q, [0.0] * 4), **more)


def are_same_runs(one: mstmm.Result, other: mstmm.Result) -> bool:
    a, b = one.trajectory, other.trajectory
    arrays = ("t", "q", "u", "memory", "work", "event")
    return a.message == b.message and all(
        np.array_equal(getattr(a, name), getattr(b, name)) for name in arrays
    )


@pytest.mark.parametrize("engine", ["looped", "fused"])
def test_every_run_is_as_a_first_one(engine: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Other states, methods, tolerances and steps, to the last bit; one is waiting each time."""
    how: tuple[dict[str, Any], ...] = (
        {}, {"rtol": 1e-5}, {"method": "rk4", "step": 1e-3}, {"method": "rodas4"}, {},
    )  # fmt: skip
    asked = [(q, each) for q in STARTS for each in how]
    model = mstmm.compile(scene(), engine=engine)
    later = [run(model, q, **each) for q, each in asked]
    assert model in run_execution._last_caches
    monkeypatch.setattr(run_execution, "_MAX_STATES", 0)
    for (q, each), found in zip(asked, later, strict=True):
        first = mstmm.compile(scene(), engine=engine)
        assert are_same_runs(run(first, q, **each), found)
        assert first not in run_execution._last_caches


def test_among_closed_loops(monkeypatch: pytest.MonkeyPatch) -> None:
    """Methods that ask for positions, and others behind them."""
    four_bar = mstmm.load_scene(ROOT / "examples" / "four_bar" / "scene.toml")
    how = ("dop853", "genalpha-index3", "genalpha", "genalpha-index3", "rk4")
    model = mstmm.compile(four_bar, engine="looped")
    later = [model.simulate(0.2, one, step=2e-3, output_times=[0.2]) for one in how]
    monkeypatch.setattr(run_execution, "_MAX_STATES", 0)
    for one, found in zip(how, later, strict=True):
        first = mstmm.compile(four_bar, engine="looped")
        assert are_same_runs(first.simulate(0.2, one, step=2e-3, output_times=[0.2]), found), one


def test_other_times_and_other_models_begin_anew() -> None:
    model = mstmm.compile(scene(), engine="looped")
    expected = [model.simulate(t, initial=(STARTS[0], [0.0] * 4)) for t in (0.4, 0.9, 0.4)]
    assert are_same_runs(expected[0], expected[2]) and not are_same_runs(expected[0], expected[1])
    pushed = model.with_inputs({"push": 3.0})
    assert not are_same_runs(run(pushed, STARTS[0]), run(model, STARTS[0]))
    assert are_same_runs(run(pushed, STARTS[0]), run(pushed, STARTS[0]))


def test_threads_have_each_their_own() -> None:
    model = mstmm.compile(scene(), engine="looped")
    expected, found = run(model, STARTS[0]), list[mstmm.Result]()
    threads = [
        threading.Thread(target=lambda: found.extend(run(model, STARTS[0]) for _ in range(5)))
        for _ in range(4)
    ]
    for one in threads:
        one.start()
    for one in threads:
        one.join()
    assert len(found) == 20 and all(are_same_runs(one, expected) for one in found)


@pytest.mark.parametrize("engine", ["looped", "fused"])
def test_models_are_let_go(engine: str) -> None:
    model = mstmm.compile(scene(), engine=engine)
    run(model, STARTS[0], "rodas4")
    gone = weakref.ref(model)
    del model
    gc.collect()
    assert gone() is None
