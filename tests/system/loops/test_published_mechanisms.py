"""Closed mechanisms that others have published, against closed forms and printed numbers."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mstmm
from tests.support.scenes.published_mechanisms import andrews, four_bars

#: Crank angle of the N-four-bar after 10 s: I theta'' = -W cos theta, solved to 15 digits.
ANGLES = {2: -30.179800860191, 40: -30.026637417191}

#: Velocity of the first crank's tip then, with two windows, by the energy in closed form.
TIP = (1.42305147, -0.49486885)

#: Andrews' squeezer at 0.03 s: IVP test set (andrews.f, by PSIDE at 1e-14), and its own precision.
PRINTED = {
    "beta": 15.81077119629904, "Theta": -15.75637105984298, "gamma": 0.04082224013073101,
    "Phi": -0.5347301163226948, "delta": 0.5244099658805304, "Omega": 0.5347301163226948,
    "eps": 1.048080741042263,
}  # fmt: skip
PRINTED_SPEEDS = {
    "beta": 1139.920302151208, "Theta": -1424.379294994111, "gamma": 11.03291221937134,
    "Phi": 19.29337464421385, "delta": 0.5735699284790808, "eps": 0.3231791658026955,
}  # fmt: skip


@pytest.mark.parametrize(
    ("count", "rtol", "bound", "most"),
    [(2, 1e-6, 1e-3, 1500), (2, 1e-9, 1e-6, 3000), (40, 1e-6, 1e-3, 1500), (2, 1e-11, 1e-8, 4000),
     (40, 1e-10, 1e-7, 4000), (40, 1e-11, 1e-8, 15000)],
)  # fmt: skip
def test_four_bars_pass_their_singular_pose(
    count: int, rtol: float, bound: float, most: int
) -> None:
    """Flat on the ground the windows could fold; the cranks stay side by side.  With slips of
    stages in their accelerations the last three take 4586, 18734 and 56438 evaluations."""
    model = mstmm.compile(mstmm.Scene(**four_bars(count)))
    result = model.simulate(10.0, "dop853", rtol=rtol, atol=1e-3 * rtol, output_times=[0.0, 10.0])
    assert result.success, result.message
    cranks = result.q[-1, : count + 1]
    assert abs(cranks[0] - ANGLES[count]) < bound
    assert np.ptp(cranks) < 1e-12
    if count == 2 and rtol < 1e-9:
        assert np.abs(result.velocity("crank0.tip")[-1, :2] - TIP).max() < 2e-7
    assert result.statistics is not None
    assert result.statistics.evaluations < most


def test_code_of_its_own_passes_alike() -> None:
    """Near the singular pose stages go without slips there too."""
    counts = []
    for engine in ("looped", "fused"):
        model = mstmm.compile(mstmm.Scene(**four_bars(2)), engine=engine)
        result = model.simulate(10.0, rtol=1e-11, atol=1e-14, output_times=[0.0, 10.0])
        assert result.success and abs(result.q[-1, 0] - ANGLES[2]) < 1e-8
        assert result.statistics is not None
        counts.append(result.statistics.evaluations)
    assert abs(counts[0] - counts[1]) < 0.2 * counts[0]


def test_lanes_of_batches_pass_alike() -> None:
    """Each remembers where its own step ended; with slips they take 3254 evaluations.  A run by
    itself closes positions of stages as well."""
    model = mstmm.compile(mstmm.Scene(**four_bars(6)), engine="fused")
    given: dict[str, Any] = {"t_end": 10.0, "method": "dop853", "rtol": 1e-11, "atol": 1e-14}
    one = model.simulate(**given, output_times=[0.0, 10.0])
    q, u = (np.tile(x, (5, 1)) for x in model.initial_state())
    many = model.simulate_batch((q, u), **given)
    assert "side by side" in many.engine and many.success.all()
    assert np.abs(many.q[:, -1, 0] - one.q[-1, 0]).max() < 1e-8
    assert one.statistics is not None
    assert np.ptp(many.evaluations) == 0
    assert many.evaluations[0] < 3000 and one.statistics.evaluations < 4000


def test_a_session_passes_as_a_run_does() -> None:
    """Where a step ended is remembered: ticks and copies change nothing."""
    model = mstmm.compile(mstmm.Scene(**four_bars(2)), engine="looped")
    ends = []
    for ticks in (1, 40):
        session = model.session(method="rk4", step=0.005)
        for _ in range(ticks):
            session.advance(4.0 / ticks)
            session = session.copy()
        ends.append(session.q)
    assert np.array_equal(ends[0], ends[1])


def test_four_bars_at_the_start() -> None:
    """theta'' = -W cos(theta) / I with I = (N + 1) / 3 + N and W = g ((N + 1) / 2 + N)."""
    for count in (1, 3, 30):
        for angle in (0.4, 1.3, 2.5):
            model = mstmm.compile(mstmm.Scene(**four_bars(count, angle)))
            inertia = (count + 1) / 3 + count
            weight = 9.81 * ((count + 1) / 2 + count)
            q, u = model.initial_state()
            udot = model.accelerations(q, u)
            wanted = -weight * np.cos(angle) / inertia
            assert np.abs(udot[: count + 1] - wanted).max() < 1e-11


def test_andrews_squeezer_at_the_start() -> None:
    model = mstmm.compile(mstmm.Scene(**andrews()))
    udot = model.accelerations(*model.initial_state())
    assert abs(udot[0] - 14222.4439199541) < 1e-6
    assert abs(udot[1] + 10666.8329399656) < 1e-6
    assert np.abs(udot[2:7]).max() < 1e-8
    assert (model.loops.rank, model.loops.mobility) == (6, 1)


@pytest.mark.parametrize(
    ("rtol", "angle", "speed", "most"),
    [(1e-6, 8e-6, 1e-4, 1000), (1e-9, 3e-9, 1e-6, 2000), (1e-10, 3e-9, 1e-6, 3000)],
)
def test_andrews_squeezer(rtol: float, angle: float, speed: float, most: int) -> None:
    """The printed beta and Theta are off by 1.1e-9 and 1.4e-9 themselves."""
    model = mstmm.compile(mstmm.Scene(**andrews()))
    result = model.simulate(0.03, "dop853", rtol=rtol, atol=1e-3 * rtol, output_times=[0.0, 0.03])
    assert result.success, result.message
    assert result.statistics is not None and result.statistics.evaluations < most
    for name, wanted in PRINTED.items():
        assert abs(result.q[-1, model.coordinate_layout.hinges[name].q] - wanted) < angle, name
    for name, wanted in PRINTED_SPEEDS.items():
        found = result.u[-1, model.coordinate_layout.hinges[name].u]
        assert abs(found - wanted) < speed * abs(wanted), name


def test_two_trees_of_the_squeezer_agree() -> None:
    """The pins in which three bodies meet are cut, or those that hold or carry these."""
    first = mstmm.compile(mstmm.Scene(**andrews()))
    start, ends = first.initial_state()[0], []
    for cuts in (("E3", "E4", "E6"), ("gamma", "Phi", "Omega")):
        scene = andrews()
        for hinge in scene["hinge"]:
            place = first.coordinate_layout.hinges[hinge["name"]].q
            hinge |= {"initial": {"q": float(start[place])}, "cut": hinge["name"] in cuts}
        model = mstmm.compile(mstmm.Scene(**scene))
        assert set(model.loops.cut_hinges) == set(cuts)
        result = model.simulate(0.03, "dop853", rtol=1e-13, atol=1e-16, output_times=[0.0, 0.03])
        assert result.success, result.message
        ends.append(
            [result.q[-1, model.coordinate_layout.hinges[name].q] for name in ("beta", "Theta")]
        )
    assert np.abs(np.subtract(ends[0], ends[1])).max() < 2e-12
