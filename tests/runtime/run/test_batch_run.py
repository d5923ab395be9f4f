"""Batches of runs: each trajectory by itself, to the last bit, whatever runs beside it."""

from __future__ import annotations

import signal
import subprocess
import sys
from concurrent import futures
from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike

import mstmm
from mstmm.errors import SceneError
from mstmm.runtime.model.model import Model
from mstmm.runtime.run import batch_lanes as on_threads
from tests.support.integration.compiled_systems import same_bits

RUN: dict[str, Any] = {"t_end": 1.5, "rtol": 1e-9, "atol": 1e-11, "output_times": [0.4, 1.1, 1.5]}
ENGINES = ("looped", "fused")


def rods(*types: str, **more: Any) -> mstmm.Scene:
    """A chain of rods on hinges of these types; `more` goes into the first hinge."""
    bodies = [
        {
            "name": f"rod{i}", "mass": 1.0, "center_of_mass": [0.5, 0, 0],
            "inertia": [0.01, 0.09, 0.085], "ends": {"tip": [1, 0, 0]},
        }
        for i in range(len(types))
    ]  # fmt: skip
    axes = ([0, 0, 1], [0, 1, 0], [1, 0, 0])
    hinges = [
        {
            "name": f"hinge{i}", "type": kind, "outboard": f"rod{i}",
            "inboard": "ground" if i == 0 else f"rod{i - 1}.tip",
            **({"axis": axes[i]} if kind == "pin" else {}), **(more if i == 0 else {}),
        }
        for i, kind in enumerate(types)
    ]  # fmt: skip
    return mstmm.Scene(gravity=[0, -9.81, 0], body=bodies, hinge=hinges)


def states(model: Model, n: int) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]:
    """n starts around the scene's own."""
    rng = np.random.default_rng(5)
    q, _ = model.initial_state()
    return q + 0.3 * rng.standard_normal((n, model.nq)), rng.standard_normal((n, model.nu))


@cache
def rod_model(kind: str, engine: str) -> Model:
    return mstmm.compile(rods("pin", "pin") if kind == "pins" else rods("ball"), engine=engine)


@pytest.fixture(params=[(kind, engine) for kind in ("pins", "ball") for engine in ENGINES])
def model(request: pytest.FixtureRequest) -> Model:
    return rod_model(*request.param)


@pytest.fixture(params=ENGINES)
def pins(request: pytest.FixtureRequest) -> Model:
    return rod_model("pins", request.param)


def test_size_neighbours_and_threads_change_nothing(model: Model) -> None:
    q, u = states(model, 19)
    whole = model.simulate_batch((q, u), threads=2, **RUN)
    assert whole.success.all()
    assert whole.q.shape == (19, 3, model.nq)
    order = np.random.default_rng(1).permutation(19)
    for threads, rows in ((1, np.arange(19)), (2, order), (3, np.arange(5)), (1, np.array([11]))):
        part = model.simulate_batch((q[rows], u[rows]), threads=threads, **RUN)
        assert same_bits(part.q, whole.q[rows])
        assert same_bits(part.u, whole.u[rows])
        assert np.array_equal(part.evaluations, whole.evaluations[rows])


def test_a_batch_gives_what_single_runs_give(model: Model) -> None:
    q, u = states(model, 5)
    batch = model.simulate_batch((q, u), **RUN)
    for i in range(5):
        one = model.simulate(initial=(q[i], u[i]), **RUN)
        assert batch.q[i] == pytest.approx(one.q, abs=1e-9)
        assert batch.u[i] == pytest.approx(one.u, abs=1e-8)
        assert batch.messages[i] == one.message
        assert one.statistics is not None
        assert batch.evaluations[i] == one.statistics.evaluations  # the same control of steps


@pytest.mark.parametrize("options", [{"method": "rk4", "step": 0.01}, {"method": "dopri5"}])
def test_other_methods(pins: Model, options: dict[str, Any]) -> None:
    q, u = states(pins, 9)
    batch = pins.simulate_batch((q, u), **RUN | options)
    for i in (0, 8):
        one = pins.simulate(initial=(q[i], u[i]), **RUN | options)
        assert batch.q[i] == pytest.approx(one.q, abs=1e-10)
        assert one.statistics is not None
        assert batch.evaluations[i] == one.statistics.evaluations


@pytest.mark.parametrize("engine", ENGINES)
def test_a_trajectory_that_fails_disturbs_no_other(engine: str) -> None:
    model = mstmm.compile(rods("pin", law={"effort": "1e-4*q[0]^7"}), engine=engine)
    q, u = np.full((12, 1), 0.1), np.linspace(-1, 1, 12)[:, None]
    calm = model.simulate_batch((q, u), threads=1, **RUN)
    assert calm.success.all()
    q[3], q[7] = 8.0, 9.0  # these reach infinity before the end
    mixed = model.simulate_batch((q, u), threads=1, **RUN)
    assert np.flatnonzero(~mixed.success).tolist() == [3, 7]
    others = mixed.success
    assert same_bits(mixed.q[others], calm.q[others])
    for i in (3, 7):
        assert np.isnan(mixed.q[i, -1]).all()
        assert "last good state at t = 0." in mixed.messages[i]
        assert "hinge0" in mixed.messages[i] or "rod0" in mixed.messages[i]


def test_too_many_steps_is_a_matter_of_each_trajectory(pins: Model) -> None:
    q, u = states(pins, 6)
    u[2] *= 60.0
    batch = pins.simulate_batch((q, u), method=mstmm.methods.Method(max_steps=60), **RUN)
    assert np.flatnonzero(~batch.success).tolist() == [2]
    assert "more steps than allowed" in batch.messages[2]


@pytest.mark.parametrize("engine", ENGINES)
def test_parameters_by_name(engine: str) -> None:
    scene = rods("pin", "pin", law={"stiffness": 2.0, "damping": 0.1})
    model = mstmm.compile(scene, engine=engine)
    masses, stiffness = np.array([0.5, 1.0, 2.0]), 7.0
    q, u = model.initial_state()
    changes: dict[str, ArrayLike] = {"rod1.mass": masses, "hinge0.law.stiffness": stiffness}
    batch = model.simulate_batch((np.tile(q, (3, 1)), u), changes, **RUN)
    assert batch.success.all()
    for i, mass in enumerate(masses):
        changed = model.with_parameters({"rod1.mass": mass, "hinge0.law.stiffness": 7.0})
        one = changed.simulate(**RUN)
        assert batch.q[i] == pytest.approx(one.q, abs=1e-8)
    assert not np.allclose(batch.q[0], batch.q[2], atol=1e-3)


@pytest.mark.parametrize("engine", ENGINES)
def test_scenes_with_events_run_one_after_the_other(engine: str) -> None:
    stopping = mstmm.Scene(
        gravity=[0, -9.81, 0],
        body=[{"name": "rod0", "mass": 1.0, "center_of_mass": [0.5, 0, 0],
               "inertia": [0.01, 0.09, 0.085]}],
        hinge=[{"name": "hinge0", "type": "pin", "inboard": "ground", "outboard": "rod0"}],
        event=[{"when": "hinge0.q < -1", "do": "stop"}],
    )  # fmt: skip
    model = mstmm.compile(stopping, engine=engine)
    u = np.array([[0.0], [3.0], [-3.0]])
    batch = model.simulate_batch((np.zeros((3, 1)), u), threads=2, **RUN)
    for i in range(3):
        one = model.simulate(initial=([0.0], u[i]), **RUN)
        reached = ~np.isnan(batch.q[i, :, 0])
        assert batch.q[i][reached] == pytest.approx(one.q, abs=1e-9)
        assert batch.messages[i] == one.message
    assert batch.success.all()
    assert "stopped by" in batch.messages[0]


def test_what_makes_no_sense_is_refused(pins: Model) -> None:
    q, u = states(pins, 3)
    for initial, more, message in (
        ((q[:, :1], u), {}, r"q has shape \(3, 1\)"),
        ((np.stack([q, q]), np.stack([u, u])), {}, "one leading axis, .* found 2"),
        ((q, u), {"t_end": 0.0}, "t_end"),
        ((q, u), {"output_times": [0.5, 0.2]}, "increasing"),
        ((q, u), {"output_times": [0.5, 2.0]}, "between"),
        ((q, u), {"parameters": {"rod0.mass": [1.0, 2.0]}}, r"expected \(3,\)"),
        ((q, u), {"parameters": {"rod0.mas": 1.0}}, "did you mean"),
        ((q, u), {"parameters": {"rod0.mass": [1.0, 2.0, -1.0]}}, "trajectory 2"),
        ((q, u), {"method": "rk5"}, "not known"),
        ((q, u), {"method": "rk4"}, "fixed steps"),
        ((q, u), {"atol": 0.0}, "atol = 0: expected"),
    ):
        with pytest.raises(SceneError, match=message):
            pins.simulate_batch(initial, **RUN | more)


@pytest.mark.parametrize("which", [signal.SIGINT, signal.SIGTERM], ids=["SIGINT", "SIGTERM"])
@pytest.mark.parametrize("engine", ENGINES)
def test_an_interrupt_ends_a_batch(
    engine: str, which: signal.Signals, heard: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    model = rod_model("pins", engine)
    q, u = states(model, 40)
    before = signal.getsignal(which)

    def wait(*arguments: Any, **more: Any) -> Any:
        signal.raise_signal(which)
        return futures.wait(*arguments, **more)

    with monkeypatch.context() as patch:
        patch.setattr(on_threads, "wait", wait)
        with pytest.raises(KeyboardInterrupt):
            model.simulate_batch((q, u), t_end=1e5, threads=2)
    assert signal.getsignal(which) is before
    assert model.simulate_batch((q[:3], u[:3]), **RUN).success.all()


def test_a_run_needs_no_scipy() -> None:
    """Neither for coefficients nor for anything else that a first result waits for."""
    program = """
import sys
import mstmm
body = {"name": "rod", "mass": 1.0, "center_of_mass": [0.5, 0, 0], "inertia": [0.01, 0.09, 0.08]}
pin = {"name": "pin", "type": "pin", "inboard": "ground", "outboard": "rod"}
scene = mstmm.Scene(gravity=[0, -9.81, 0], body=[body], hinge=[pin])
run = mstmm.compile(scene, engine="looped").simulate(1.0)
assert run.success and run.position("rod").shape == (len(run.t), 3)
print([name for name in ("scipy", "sympy", "jinja2", "mstmm.derive") if name in sys.modules])
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.stdout.strip() == "[]", done.stderr
