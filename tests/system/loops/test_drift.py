"""Loops stay closed over long runs, and what holds along the motion stays."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import mstmm
from mstmm.runtime.result.result import Result
from tests.runtime.model.test_assembly import gap
from tests.support.scenes.linkages import bricard, four_bar


def test_a_four_bar_stays_closed() -> None:
    """100 000 steps of RK4, 60 turns: gaps to rounding; the energy drifts as RK4 lets it."""
    scene = four_bar(speed=8.0) | {"gravity": [0, 0, 0]}
    model = mstmm.compile(mstmm.Scene(**scene))
    drift = {}
    for end, step in ((10.0, 1e-3), (50.0, 5e-4)):
        result = model.simulate(end, "rk4", step=step, output_times=np.linspace(0.0, end, 21))
        assert result.success, result.message
        for row in (7, 20):
            assert gap(model, scene, result.q[row], result.u[row]) < 1e-12
        energy = result.energy_components()["kinetic"]
        drift[step] = float(abs(energy[-1] / energy[0] - 1)) / end
    assert abs(result.q[-1, 0]) > 100 * np.pi
    assert drift[5e-4] < 1e-9
    assert drift[1e-3] / drift[5e-4] > 10


def test_a_bricard_ring_stays_closed() -> None:
    """Angles of neighbours in closed form: with c and s the cosines of the angles between links
    at even and at odd corners, c + s + c s = 0."""
    scene = bricard()
    model = mstmm.compile(mstmm.Scene(**scene))
    result = model.simulate(5.0, "dop853", rtol=1e-8, output_times=np.linspace(0.0, 5.0, 41))
    assert result.success, result.message
    corners = [np.zeros((41, 3)), *(result.position(f"rod{k}.tip") for k in range(5))]
    links = [corners[(k + 1) % 6] - corners[k] for k in range(6)]
    cosines = [-np.sum(links[k - 1] * links[k], axis=1) for k in range(6)]
    for k in range(6):
        assert np.abs(cosines[k] - cosines[k % 2]).max() < 1e-8
    c, s = cosines[0], cosines[1]
    assert np.ptp(c) > 0.5
    assert min(np.abs(c + s + sign * c * s).max() for sign in (1, -1)) < 1e-8
    energy = result.energy()
    assert np.abs(energy - energy[0]).max() < 1e-5
    certificate = result.certificate
    assert certificate.loop_closure is not None
    assert certificate.loop_closure.gap < 1e-12 and certificate.loop_closure.slip < 1e-11
    assert "indeterminate loads: " in str(certificate)
    opened = replace(result.trajectory, q=result.q + 1e-3 * np.eye(1, result.q.shape[1]))
    seen = Result(result.model, opened).certificate.loop_closure
    assert seen is not None and seen.gap > 1e-4


@pytest.mark.parametrize("cut", ["knee", "end"])
def test_turns_of_a_cut_hinge_are_counted(cut: str) -> None:
    """The crank goes round, and with it the pin between it and the coupler, in the tree or cut."""
    results = []
    for which in (cut, "tip"):
        model = mstmm.compile(mstmm.Scene(**four_bar(speed=8.0, cut=which)))
        results.append(model.simulate(4.0, "dop853", rtol=1e-9, output_times=[0.0, 4.0]))
        assert results[-1].success, results[-1].message
    knee = results[0].q[-1] * [1, 1, -1 if cut == "knee" else 1, 1]
    assert abs(knee[1]) > 3 * np.pi
    assert np.abs(knee - results[1].q[-1]).max() < 1e-6
