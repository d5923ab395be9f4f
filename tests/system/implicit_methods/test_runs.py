"""Scenes by implicit methods: against explicit runs, across releases, resumed, in batches."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.errors import SceneError
from mstmm.runtime.integrate.c_loop import Integrator, Samples, Status
from mstmm.runtime.integrate.settings import Settings, validate
from mstmm.runtime.integrate.steppers import IMPLICIT, get
from mstmm.runtime.run.integration_run import make_run
from mstmm.runtime.run.scene_system import SceneSystem
from tests.support.scenes.results import rod


def remembering() -> mstmm.Scene:
    """A chain with everything a run remembers: work, a drive and its release, turns of a ball."""
    hinges = [
        {"name": "motor", "type": "pin", "inboard": "ground", "outboard": "rod0",
         "drive": "0.5*sin(3*t)", "release": "t >= 0.6"},
        {"name": "pin", "type": "pin", "inboard": "rod0.tip", "outboard": "rod1",
         "initial": {"q": [0.7]}},
        {"name": "ball", "type": "ball", "inboard": "rod1.tip", "outboard": "rod2",
         "axis": [1, 0, 0], "initial": {"u": [9.0, 0.1, 0.2]},
         "law": {"stiffness": [0.01, 0.01, 0.01], "damping": [0.001, 0.001, 0.001]}},
    ]  # fmt: skip
    bodies = [rod(f"rod{i}") for i in range(3)]
    return mstmm.Scene(gravity=(0, -9.81, 0), body=bodies, hinge=hinges)


def stiff_rods() -> mstmm.Scene:
    """Two rods on damped springs of 1e6 N m/rad, pushed by a force that varies with time."""
    law = {"stiffness": 1e6, "damping": 1e3}
    hinges = [
        {"name": "first", "type": "pin", "inboard": "ground", "outboard": "rod0", "law": law},
        {"name": "second", "type": "pin", "inboard": "rod0.tip", "outboard": "rod1", "law": law},
    ]
    loads = [{"name": "push", "on": "rod1.tip", "force": ["0", "2e3*sin(8*t)", "0"]}]
    bodies = [rod(f"rod{i}") for i in range(2)]
    return mstmm.Scene(gravity=(0, -9.81, 0), body=bodies, hinge=hinges, load=loads)


TIMES = np.linspace(0.0, 1.2, 25)


@pytest.mark.parametrize("method", IMPLICIT)
def test_implicit_runs_agree_with_an_explicit_one(method: str) -> None:
    model = mstmm.compile(remembering(), engine="looped")
    exact = model.simulate(1.2, rtol=1e-11, atol=1e-13, output_times=TIMES)
    second = get(method).order == 2
    how: dict[str, Any] = {"step": 2e-4} if second else {"rtol": 1e-7, "atol": 1e-9}
    found = model.simulate(1.2, method, output_times=TIMES, **how)
    assert found.success, found.message
    assert len(found.t) == len(exact.t)  # with those before and after the release
    assert found.t == pytest.approx(exact.t, abs=1e-9)
    assert found.q == pytest.approx(exact.q, abs=3e-3 if method == "houbolt" else 2e-4)
    assert found.trajectory.work == pytest.approx(exact.trajectory.work, abs=2e-3)


@pytest.mark.parametrize("method", [m for m in IMPLICIT if get(m).adaptive and m != "exprb32"])
def test_stiff_springs_do_not_set_the_step(method: str) -> None:
    model = mstmm.compile(stiff_rods(), engine="looped")
    # at rest the springs carry the load: their turns are some load / 1e6
    exact = model.simulate(1.0, "rodas5p", rtol=1e-9, atol=1e-14, output_times=[0.5, 1.0])
    found = model.simulate(1.0, method, rtol=1e-4, atol=1e-7, output_times=[0.5, 1.0])
    assert found.success, found.message
    assert found.q == pytest.approx(exact.q, abs=2e-5)
    assert found.statistics is not None
    assert found.statistics.steps < 500
    explicit = model.simulate(0.02, "dop853", rtol=1e-4, atol=1e-7, output_times=[0.02])
    assert explicit.statistics is not None
    assert explicit.statistics.steps > found.statistics.steps / 5  # for a fiftieth of the time


@pytest.mark.parametrize(
    ("method", "how"),
    [("rodas4p2", {"rtol": 1e-4}), ("esdirk436", {"rtol": 1e-4}), ("genalpha", {"rtol": 1e-3}),
     ("genalpha", {"step": 0.01, "radius": 0.5}), ("houbolt", {"step": 0.01}),
     ("exprb32", {"rtol": 1e-4})],
)  # fmt: skip
def test_a_scene_continues_bit_for_bit_from_every_step(method: str, how: dict[str, Any]) -> None:
    model = mstmm.compile(remembering(), engine="looped")
    settings = validate(Settings(1.2, method=method, atol=1e-6, **how))
    systems: list[SceneSystem] = []

    def fresh() -> Integrator:
        systems.append(SceneSystem(model.looped))
        return make_run(systems[-1], settings, *model.initial_state())

    whole, run = fresh(), fresh()
    assert whole.advance(60.0) is Status.FINISHED
    parts, steps = [], 0
    while run.advance(60.0, steps + 1) is Status.RUNNING:
        steps = run.statistics.steps
        parts.append(run.take_samples())
        state = run.state()
        run = fresh()
        run.restore(state)
    found = Samples.join([*parts, run.samples])
    assert np.array_equal(found.y, whole.samples.y)
    assert np.array_equal(found.memory, whole.samples.memory)
    assert run.statistics == whole.statistics
    assert run.statistics.events == 1


def test_a_batch_makes_the_runs_of_its_trajectories() -> None:
    model = mstmm.compile(stiff_rods(), engine="looped")
    q, u = np.zeros((3, model.nq)), np.zeros((3, model.nu))
    q[:, 0] = (0.0, 1e-4, 2e-4)
    batch = model.simulate_batch((q, u), t_end=0.3, method="rodas4p2", rtol=1e-5, atol=1e-8)
    assert batch.success.all()
    for i in range(3):
        alone = model.simulate(
            0.3, "rodas4p2", rtol=1e-5, atol=1e-8, output_times=[0.3], initial=(q[i], u[i])
        )
        # a batch does not integrate the work, by which single runs judge their steps too
        assert batch.q[i, -1] == pytest.approx(alone.q[-1], abs=1e-6)


def test_a_result_keeps_what_was_counted(tmp_path: Any) -> None:
    model = mstmm.compile(stiff_rods(), engine="looped")
    result = model.simulate(
        0.3, mstmm.methods.GeneralizedAlpha("genalpha", radius=0.4), rtol=1e-4, atol=1e-7
    )
    path = tmp_path / "stiff.nc"
    result.save(path)
    loaded = mstmm.load_result(path)
    assert loaded.statistics == result.statistics
    assert loaded.statistics is not None
    assert loaded.statistics.tangents > 0
    assert loaded.settings.radius == 0.4


def test_a_radius_is_asked_of_methods_that_take_one() -> None:
    model = mstmm.compile(stiff_rods(), engine="looped")
    for method in ("dop853", "rodas4p2", "scipy-Radau"):
        with pytest.raises(
            SceneError, match="has no such parameter; methods with a radius are genalpha, dttmm"
        ):
            model.simulate(0.1, mstmm.methods.GeneralizedAlpha(method, radius=0.5))
        with pytest.raises(SceneError, match=f'radius: method "{method}" has no such option'):
            mstmm.methods.method(method, radius=0.5)
