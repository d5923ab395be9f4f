"""Trajectories side by side: the loop's own numbers, for every width, order and number of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray

from mstmm.runtime.integrate.c_loop import Status
from mstmm.runtime.integrate.c_tableau import c_tableau
from mstmm.runtime.integrate.steppers import get
from tests.support.integration.compiled_systems import Lab, Problem, same_bits

Array = NDArray[np.float64]
TIMES = (0.0, 0.35, 1.0, 1.1, 2.0)


@dataclass
class Batch:
    """What a batch gave."""

    samples: Array
    last: Array
    outcomes: Any  # mstmm_outcome[]


def side_by_side(
    problem: Problem, lanes: int, method: str, y0: ArrayLike, t_end: float, wall: float = 10.0,
    **options: Any,
) -> Batch:  # fmt: skip
    """One group on this thread, advanced until all are done."""
    ffi, lib = problem.lab.ffi, problem.lab.lib
    lib.test_use_lanes(problem.system, problem.at, lanes)
    start = np.array(y0, dtype=np.float64)
    n, width = start.shape
    times, breaks = np.array(options.pop("output_times", TIMES)), options.pop("breaks", [])
    samples, last = np.full((n, len(times), width), np.nan), np.zeros((n, width))
    many, group = ffi.new("mstmm_many *"), ffi.new("mstmm_group *")
    outcomes = ffi.new("mstmm_outcome[]", n)
    atol, stops = np.full(width, options.pop("atol", 1e-9)), np.array(breaks, dtype=float)
    kept = [ffi.from_buffer("double[]", x) for x in (start, samples, last, atol, stops, times)]
    many.y0, many.samples, many.last = kept[:3]
    many.problem.atol, many.problem.breaks, many.problem.outputs = kept[3:]
    many.problem.n_breaks, many.problem.n_outputs = len(stops), len(times)
    many.problem.tableau, many.problem.t_end = c_tableau(ffi, get(method)), t_end
    many.problem.rtol = options.pop("rtol", 1e-9)
    many.problem.fixed_step = options.pop("step", 0.0)
    many.problem.max_steps = options.pop("max_steps", 0)
    many.n, many.outcomes = n, outcomes
    group.many, group.system = many, problem.system
    workspace = np.zeros(lib.mstmm_group_size(problem.system, many.problem.tableau))
    group.workspace = ffi.from_buffer("double[]", workspace)
    assert not options
    assert lib.mstmm_group_start(group) == 0
    while lib.mstmm_group_advance(group, wall) == Status.RUNNING:
        pass
    return Batch(samples, last, outcomes)


CASES: dict[str, tuple[str, dict[str, Any]]] = {
    "dop853": ("mixed", {"method": "dop853"}),
    "dopri5": ("mixed", {"method": "dopri5"}),
    "pirk13": ("mixed", {"method": "pirk13"}),
    "fixed": ("mixed", {"method": "rk4", "step": 0.03}),
    "breaks": ("piecewise", {"method": "dop853", "breaks": [1.0]}),
    "breaks on a grid": ("piecewise", {"method": "rk4", "breaks": [1.0], "step": 0.06}),
}


@pytest.mark.parametrize("lanes", [2, 4, 8])
@pytest.mark.parametrize("case", CASES)
def test_a_lane_makes_the_steps_of_a_run_alone(lab: Lab, case: str, lanes: int) -> None:
    name, options = CASES[case]
    problem = lab.problem(name, 1 if name == "piecewise" else 2, 1.0)
    rng = np.random.default_rng(8)
    y0 = rng.uniform(0.2, 2.0, (11, problem.system.n_state))
    batch = side_by_side(problem, lanes, y0=y0, t_end=2.0, **options)
    lab.lib.test_use_lanes(problem.system, problem.at, 0)
    for i, start in enumerate(y0):
        alone = problem.finished_run(
            t_end=2.0, y0=start, rtol=1e-9, atol=1e-9, output_times=TIMES, **options
        )
        assert same_bits(batch.samples[i], alone.samples.y)
        assert same_bits(batch.last[i], alone.y)
        counts, outcome = alone.statistics, batch.outcomes[i]
        assert outcome.status == Status.FINISHED
        found = (outcome.steps, outcome.rejected, outcome.evaluations)
        assert found == (counts.steps, counts.rejected_steps, counts.evaluations)


def test_slices_of_time_change_nothing(lab: Lab) -> None:
    y0 = np.random.default_rng(2).uniform(0.2, 2.0, (30, 2))
    runs = [
        side_by_side(lab.problem("mixed", 2), 4, "dop853", y0, 2.0, wall) for wall in (0.0, 10.0)
    ]
    assert same_bits(runs[0].samples, runs[1].samples)


def test_failures_stay_in_their_lane(lab: Lab) -> None:
    """y' = y^2 from y0 reaches infinity at 1 / y0."""
    y0 = np.array([0.1, 0.2, 5.0, 0.3, np.nan, 0.1, 2.0, 0.4, 0.05])
    y0 = np.stack([np.ones(9), y0], axis=1)
    problem = lab.problem("blow_up", 2)
    batch = side_by_side(problem, 8, "dop853", y0, 2.0)
    fine = [0, 1, 3, 5, 7, 8]
    without = side_by_side(lab.problem("blow_up", 2), 8, "dop853", y0[fine], 2.0)
    assert same_bits(batch.samples[fine], without.samples)
    for i, outcome in enumerate(batch.outcomes):
        if i in fine:
            assert outcome.status == Status.FINISHED
            exact = y0[i, 1] / (1 - y0[i, 1] * np.array(TIMES))
            assert batch.samples[i][:, 1] == pytest.approx(exact, rel=1e-7)
    assert batch.outcomes[2].status < 0
    assert batch.outcomes[2].t == pytest.approx(0.2, rel=1e-3)
    assert np.isnan(batch.samples[2, 1:]).all()
    assert batch.outcomes[4].status == Status.NOT_FINITE
    assert batch.outcomes[4].steps == 0


def test_a_failing_right_hand_side_and_too_many_steps(lab: Lab) -> None:
    problem = lab.problem("failing", 1, 0.5)
    batch = side_by_side(problem, 4, "rk4", np.ones((3, 1)), 2.0, step=0.4)
    for outcome in batch.outcomes:
        assert (outcome.status, outcome.code, outcome.t) == (Status.RHS_FAILED, 7, 0.4)
        assert outcome.fail_time == pytest.approx(0.6)
    batch = side_by_side(lab.problem("mixed", 2), 4, "dop853", np.ones((3, 2)), 2.0, max_steps=4)
    assert {o.status for o in batch.outcomes} == {Status.TOO_MANY_STEPS}
    assert {o.steps for o in batch.outcomes} == {4}


def test_what_cannot_run_in_lanes_has_no_size(lab: Lab) -> None:
    problem = lab.problem("falling", 2, 0.8)
    lab.lib.test_use_lanes(problem.system, problem.at, 4)
    tableau = c_tableau(lab.ffi, get("dop853"))
    assert lab.lib.mstmm_group_size(problem.system, tableau) > 0
    lab.lib.test_use_bounce(problem.system, problem.at)
    assert lab.lib.mstmm_group_size(problem.system, tableau) == 0


def test_implicit_methods_have_no_lanes(lab: Lab) -> None:
    problem = lab.mechanism("chain", 4.0)
    lab.lib.test_use_lanes(problem.system, problem.at, 4)
    sizes = [
        lab.lib.mstmm_group_size(problem.system, c_tableau(lab.ffi, get(name)))
        for name in ("rodas4", "genalpha")
    ]
    assert sizes == [0, 0]
