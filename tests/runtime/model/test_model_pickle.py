"""Models and results can be pickled and copied: as the scene and the run that they come from."""

from __future__ import annotations

import pickle
from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mstmm
from tests.support.scenes.results import pins

#: A beam at a hub; as a one-way body its results are of their own kind.
BLADE = mstmm.Scene(
    gravity=(0, -9.81, 0),
    beam=[{"name": "blade", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": 100.0,
           "modes": {"y": 2}}],
    hinge=[{"name": "hub", "type": "fixed", "inboard": "ground", "outboard": "blade"}],
)  # fmt: skip


@pytest.mark.parametrize("engine", ["looped", "fused", "auto"])
def test_a_result_comes_back_with_all_that_follows_from_it(engine: str) -> None:
    model = mstmm.compile(pins(2, [1.0, 0.3]), engine=engine)
    run = model.simulate(1.0, rtol=1e-5, certify=True)
    again: Any
    for again in (pickle.loads(pickle.dumps(run)), deepcopy(run)):
        np.testing.assert_array_equal(again.q, run.q)
        np.testing.assert_array_equal(again.acceleration("rod1"), run.acceleration("rod1"))
        assert again.risks == run.risks and str(again.certificate) == str(run.certificate)
        assert again.model.engine == run.model.engine
        np.testing.assert_array_equal(again.model.simulate(1.0, rtol=1e-5).q, run.q)


def test_a_fixed_step_is_judged_as_before() -> None:
    run = mstmm.compile(pins(1, [1.0], damping=100.0)).simulate(1.0, "rk4", 0.02)
    again = pickle.loads(pickle.dumps(run))
    assert "step-stability" in {risk.name for risk in run.risks} and again.risks == run.risks


def test_a_one_way_result_and_a_loaded_one(tmp_path: Path) -> None:
    run = mstmm.compile(BLADE, flexibility="one-way").simulate(0.5, output_times=[0.1, 0.5])
    loaded: Any = mstmm.load_result(run.save(tmp_path / "run.nc"))
    for again in pickle.loads(pickle.dumps(run)), pickle.loads(pickle.dumps(loaded)):
        assert type(again) is type(run)
        np.testing.assert_array_equal(
            again.deflection("blade", "tip"), run.deflection("blade", "tip")
        )


@pytest.mark.parametrize("sweep", ["riccati", "product", "qr"])
def test_a_model_keeps_its_numbers_and_what_was_asked(sweep: str) -> None:
    model = mstmm.compile(pins(2, [1.0, 0.3]), sweep=sweep).with_parameters({"rod0.mass": 2.0})
    again = pickle.loads(pickle.dumps(model))
    assert again.packed_scene.qr == model.packed_scene.qr
    assert again.parameters == model.parameters and again.engine_reason == model.engine_reason
    q, u = model.initial_state()
    np.testing.assert_array_equal(again.accelerations(q, u), model.accelerations(q, u))


def test_a_session_says_what_to_pickle_instead() -> None:
    model = mstmm.compile(pins(1, [0.3]))
    session = model.session(method="rk4", step=0.01)
    with pytest.raises(mstmm.SceneError, match=r"pickle model, t and state"):
        pickle.dumps(session)
    session.advance(0.1)
    again = pickle.loads(pickle.dumps(model)).session(*session.state, session.t, "rk4", 0.01)
    for one in (session, again):
        one.advance(0.1)
    assert np.abs(again.q - session.q).max() < 1e-12
