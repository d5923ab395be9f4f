"""However a run is cut into slices, buffers or processes, the numbers are the same bits."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mstmm.errors import SceneError
from mstmm.runtime.integrate.c_loop import Integrator, Samples, Status
from tests.support.integration.compiled_systems import Lab, Problem, same_bits
from tests.support.paths import ROOT

START = (1.0, 0.0)
CASES: dict[str, tuple[str, dict[str, Any]]] = {
    "every step": ("dop853", {"rtol": 1e-10, "atol": 1e-12}),
    "output times": (
        "dop853",
        {"rtol": 1e-8, "atol": 1e-10, "output_times": np.linspace(0, 1.5, 301)},
    ),
    "breaks": ("dopri5", {"rtol": 1e-9, "atol": 1e-12, "breaks": [0.2, 0.7]}),
    "fixed": ("rk4", {"step": 1e-3, "output_times": np.linspace(0, 1.5, 77)}),
}


def bouncing(lab: Lab) -> Problem:
    """A bouncing body: events, memory and accept at work."""
    problem = lab.problem("falling", 2, 0.8)
    lab.lib.test_use_accept(problem.system, problem.at)
    lab.lib.test_use_bounce(problem.system, problem.at)
    problem.at.p[7] = -1.0  # accept says that the first stage is invalid
    return problem


def uninterrupted_run(lab: Lab, case: str) -> tuple[Samples, Integrator]:
    method, options = CASES[case]
    run = bouncing(lab).finished_run(method, 1.5, START, **options)
    return run.samples, run


def equal(a: Samples, b: Samples) -> bool:
    pairs = ((a.t, b.t), (a.y, b.y), (a.memory, b.memory), (a.event, b.event))
    return all(same_bits(x, y) for x, y in pairs)


@pytest.mark.parametrize("case", CASES)
def test_slices_and_small_buffers_change_nothing(lab: Lab, case: str) -> None:
    wanted, reference = uninterrupted_run(lab, case)
    assert wanted.event.any()
    method, options = CASES[case]
    for capacity in (2, 3, 7):
        run = bouncing(lab).run(method, 1.5, START, capacity=capacity, **options)
        slices = 0
        while run.advance(0.0) is Status.RUNNING:
            slices += 1
        assert slices > 5
        assert run.status is Status.FINISHED
        assert equal(run.samples, wanted)
        assert run.statistics == reference.statistics


@pytest.mark.parametrize("case", CASES)
def test_a_saved_run_continues_bit_for_bit(lab: Lab, case: str) -> None:
    wanted, reference = uninterrupted_run(lab, case)
    method, options = CASES[case]
    run = bouncing(lab).run(method, 1.5, START, capacity=2, **options)
    parts, sizes = [], set()
    while True:  # a fresh run after every buffer, also in the middle of a step
        status = lab.lib.mstmm_advance(run._run, float("inf"))
        run._drain()
        parts.append(run.take_samples())
        state = run.state()
        sizes.add(len(state["real"]))
        if status != Status.BUFFER_FULL:
            break
        run = bouncing(lab).run(method, 1.5, START, capacity=2, **options)
        run.restore(state)
    assert status == Status.FINISHED
    assert equal(Samples.join(parts), wanted)
    assert run.statistics == reference.statistics
    assert len(sizes) == 2, sizes  # between steps little is kept, within a step everything


CONTINUE = """
import sys
import numpy as np
from pathlib import Path
from tests.support.integration.compiled_systems import Lab
from tests.runtime.integrate import test_c_loop_restart as here

folder, compiled = map(Path, sys.argv[1:])
method, options = here.CASES["output times"]
lab = Lab(compiled)
run = here.bouncing(lab).run(method, 1.5, here.START, **options)
run.restore(np.load(folder / "state.npz"))
while run.advance(1.0) == 0:
    pass
np.savez(folder / "rest.npz", t=run.samples.t, y=run.samples.y, memory=run.samples.memory)
"""


def test_another_process_continues_bit_for_bit(lab: Lab, tmp_path: Path) -> None:
    wanted, _ = uninterrupted_run(lab, "output times")
    method, options = CASES["output times"]
    run = bouncing(lab).run(method, 1.5, START, **options)
    while run.t < 0.8:
        run.advance(0.0)
    first = run.take_samples()
    state = run.state()
    np.savez(tmp_path / "state.npz", real=state["real"], integer=state["integer"])
    paths = [str(ROOT), *sys.path]
    done = subprocess.run(
        [sys.executable, "-c", CONTINUE, str(tmp_path), str(lab.path.parent)],
        env={**os.environ, "PYTHONPATH": ":".join(filter(None, paths))},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    rest = np.load(tmp_path / "rest.npz")
    assert 0 < len(first.t) < len(wanted.t)
    assert same_bits(np.concatenate([first.t, rest["t"]]), wanted.t)
    assert same_bits(np.concatenate([first.y, rest["y"]]), wanted.y)
    assert same_bits(np.concatenate([first.memory, rest["memory"]]), wanted.memory)


def test_a_foreign_state_is_refused(lab: Lab) -> None:
    run = bouncing(lab).run("dop853", 1.5, START)
    other = bouncing(lab).run("dopri5", 1.5, START)
    with pytest.raises(SceneError, match="another scene, method or version"):
        run.restore(other.state())
    state = run.state()
    with pytest.raises(SceneError, match="another scene"):
        run.restore({"real": state["real"][:-1], "integer": state["integer"]})
    fresh = bouncing(lab).run("dop853", 1.5, START)
    fresh.restore(state)
    assert fresh.advance(10.0) is Status.FINISHED


def random_run_settings(
    rng: np.random.Generator,
) -> tuple[str, float, tuple[float, ...], dict[str, Any]]:
    """Method, end, thresholds and answer of three events, and options of a run of the circle."""
    t_end = float(rng.uniform(0.5, 12.0))
    method = str(rng.choice(["rk4", "dopri5", "dop853"]))
    options: dict[str, Any] = {"breaks": np.sort(rng.uniform(0, t_end, rng.integers(0, 4)))}
    if rng.random() < 0.7:
        options["output_times"] = np.unique(rng.choice([0.0, t_end, *rng.uniform(0, t_end, 9)], 7))
    if method == "rk4" or rng.random() < 0.3:
        options["step"] = float(rng.uniform(5e-3, 2e-2))
    else:
        options |= {"rtol": 1e-9, "atol": 1e-10}
    events = (*rng.uniform([-1.2, 0.0, -1.2], [1.2, t_end, 1.2]), float(rng.choice([0, 1, 3])))
    return method, t_end, events, options


def circling(lab: Lab, events: tuple[float, ...]) -> Problem:
    problem = lab.problem("harmonic", 2, 1.0, 0.0, 0.0, *events)
    lab.lib.test_use_three(problem.system, problem.at)
    return problem


def test_drawn_runs_do_not_depend_on_how_they_are_cut(lab: Lab, rng: np.random.Generator) -> None:
    for _ in range(30):
        method, t_end, events, options = random_run_settings(rng)
        problem, again = circling(lab, events), circling(lab, events)
        wanted = problem.finished_run(method, t_end, START, **options)
        t, y, regular = wanted.samples.t, wanted.samples.y, wanted.samples.event == 0
        assert np.abs(y - np.stack([np.cos(t), -np.sin(t)], axis=1)).max() < 2e-7
        assert np.all(np.diff(t) >= 0.0)
        if "output_times" in options:
            assert np.array_equal(t[regular], options["output_times"])
        run = again.run(method, t_end, START, capacity=int(rng.integers(2, 6)), **options)
        while run.advance(0.0) is Status.RUNNING:
            pass
        assert equal(run.samples, wanted.samples)
        assert run.statistics == wanted.statistics
        assert again.at.calls == problem.at.calls
