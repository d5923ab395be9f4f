"""The method whose stages lie side by side: the same bits as the same method written out."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from mstmm.errors import SceneError
from mstmm.runtime.integrate.c_loop import Integrator, Status
from mstmm.runtime.integrate.steppers import Tableau, get
from tests.support.integration.compiled_systems import Lab, same_bits

START = (1.0, 1.0)


def runs(lab: Lab, tableau: Tableau, lanes: int) -> Integrator:
    problem = lab.problem("mixed", 2)
    lab.lib.test_use_lanes(problem.system, problem.at, lanes)
    return problem.finished_run(
        tableau, 3.0, START, rtol=1e-9, atol=1e-11, output_times=[0.7, 1.9, 3.0]
    )


def test_side_by_side_is_one_after_the_other(lab: Lab) -> None:
    tableau = get("pirk13")
    written_out = dataclasses.replace(tableau, name="written out", iterated=None)
    wanted = runs(lab, written_out, 0)
    assert wanted.statistics.steps > 5
    for lanes in (0, 2, 4, 8):
        run = runs(lab, tableau, lanes)
        assert same_bits(run.samples.y, wanted.samples.y)
        assert same_bits(run.y, wanted.y)
        assert run.statistics == wanted.statistics


def test_every_width_of_registers_gives_the_same_bits(
    lab: Lab, tmp_path_factory: pytest.TempPathFactory
) -> None:
    narrow = Lab(tmp_path_factory.mktemp("narrow"), "-DMSTMM_ONE_WIDTH")
    for name in ("dop853", "pirk13"):
        wide, plain = (runs(one, get(name), 8) for one in (lab, narrow))
        assert same_bits(wide.samples.y, plain.samples.y)
        assert wide.statistics == plain.statistics


def test_a_failure_in_one_lane_is_reported_with_its_time(lab: Lab) -> None:
    messages = []
    for lanes in (0, 8):
        problem = lab.problem("failing", 1, 0.5)
        lab.lib.test_use_lanes(problem.system, problem.at, lanes)
        run = problem.run("pirk13", 2.0, [1.0], step=0.4)
        assert run.advance(10.0) is Status.RHS_FAILED
        assert run.t == 0.4
        messages.append(run.message())
    assert messages[0] == messages[1]
    assert "at t = 0.5" in messages[0] or "at t = 0.6" in messages[0]


def test_contradictory_blocks_are_refused() -> None:
    tableau = get("pirk13")
    for blocks in ((8, 11), (6, 16), (1, 96)):
        with pytest.raises(ValueError, match="blocks"):
            dataclasses.replace(tableau, iterated=blocks)


def test_another_number_of_lanes_is_another_run(lab: Lab) -> None:
    def run(lanes: int) -> Integrator:
        problem = lab.problem("mixed", 2)
        lab.lib.test_use_lanes(problem.system, problem.at, lanes)
        return problem.run("pirk13", 3.0, START, rtol=1e-9, atol=1e-11)

    first = run(8)
    first.advance(0.0)
    again = run(8)
    again.restore(first.state())
    assert again.advance(10.0) is first.advance(10.0) is Status.FINISHED
    assert same_bits(again.y, first.y)
    with pytest.raises(SceneError, match="another scene, method or version"):
        run(4).restore(first.state())


def test_dense_output_integrates_polynomials_in_time_exactly() -> None:
    tableau = get("pirk13")
    nodes = np.append(tableau.C, 1.0)
    for theta in (0.1, 0.37, 0.5, 0.93):
        weights = tableau.weights(theta)
        for power in range(10):
            assert weights @ nodes**power == pytest.approx(theta ** (power + 1) / (power + 1))
