"""Named constants as parameters of a model: everything that is written with them follows."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.errors import SceneError
from mstmm.scene import Scene
from tests.support.scenes.minimal import body, hinge


def rod(half: Any = 0.5, named: bool = True, **of_hinge: Any) -> Scene:
    """A rod of length 2 half on a motor half sin(3 t), by a named constant or without."""
    size: Any = "half" if named else half
    table = body(
        mass=f"4*{size}", center_of_mass=[size, 0, 0], ends={"tip": [f"2*{size}", 0, 0]},
        inertia=[0.001, 0.084, 0.084],
    )  # fmt: skip
    motor = hinge(law={"effort": f"{size}*sin(3*t)"}) | of_hinge
    data = {"gravity": [0, -9.81, 0], "body": [table], "hinge": [motor]}
    return Scene.from_data({**data, "constants": {"half": half}} if named else data)


@pytest.mark.parametrize("engine", ["looped", "fused"])
def test_a_model_follows_its_constants(engine: str) -> None:
    model = mstmm.compile(rod(), engine=engine)
    assert model.parameters["constants.half"] == 0.5
    assert model.parameters["shoulder.law.stiffness[0]"] == 0.0
    changed = model.with_parameters({"constants.half": 0.7})
    assert changed.parameters["rod1.mass"] == pytest.approx(2.8)
    assert changed.engine == engine
    state, plain = ([0.3], [0.2], 0.4), mstmm.compile(rod(0.7, named=False), engine="looped")
    np.testing.assert_allclose(changed.accelerations(*state), plain.accelerations(*state), 1e-14)
    batch = model.simulate_batch(([[0.3]], [[0.2]]), {"constants.half": np.array([0.7])}, t_end=0.5)
    run = plain.simulate(0.5, output_times=[0.5], initial=([0.3], [0.2]))
    np.testing.assert_allclose(batch.q[0, -1], run.q[-1], rtol=1e-7)


def test_trajectories_side_by_side_end_steps_at_their_own_times() -> None:
    """Where a constant says when a motor gives a short blow."""
    blow = "where(t < on, 0, where(t < on + 0.001, 50, 0))"
    shown = {"gravity": [0, 0, 0], "body": [body()], "hinge": [hinge(law={"effort": blow})],
             "constants": {"on": 0.2}}  # fmt: skip
    model = mstmm.compile(Scene.from_data(shown), engine="fused")
    on = np.array([0.2, 0.31, 0.44, 0.2])
    states = np.full((4, 1), 0.3), np.zeros((4, 1))
    batch = model.simulate_batch(states, {"constants.on": on}, t_end=0.5, rtol=1e-6)
    for i, one in enumerate(on):
        alone = model.with_parameters({"constants.on": float(one)})
        run = alone.simulate(0.5, rtol=1e-12, output_times=[0.5], initial=([0.3], [0.0]))
        assert batch.q[i, -1] == pytest.approx(run.q[-1], abs=3e-7)


def test_a_constant_that_others_cannot_follow_is_named() -> None:
    """The others are said where they stand, as if the file had them so."""
    there = rod().model_dump(by_alias=True)
    model = mstmm.compile(Scene.from_data({**there, "constants": {"half": 0.5, "w": "1/half"}}))
    with pytest.raises(SceneError, match=r"scene: constants\.w: expected a number.*by zero"):
        model.with_parameters({"constants.half": 0.0})
    with pytest.raises(
        SceneError, match=r'"half": there is no such.*did you mean "constants.half"'
    ):
        model.with_parameters({"half": 0.6})


def test_a_number_may_be_set_in_spite_of_its_constant() -> None:
    changed = mstmm.compile(rod()).with_parameters({"rod1.mass": 3.0})
    assert changed.parameters["rod1.mass"] == 3.0
    assert changed.with_parameters({"constants.half": 0.7}).parameters["rod1.mass"] == 3.0


def test_start_values_follow_a_drive_of_constants() -> None:
    scene = rod(type="planar", drive=["free", "half + 3*half*t", "free"], law={})
    model = mstmm.compile(scene).with_parameters({"constants.half": 0.7})
    q, u = model.initial_state()
    assert q[1] == pytest.approx(0.7) and u[1] == pytest.approx(2.1)


def test_constants_have_no_exact_derivative() -> None:
    model = mstmm.compile(rod())
    with pytest.raises(SceneError, match=r"constants.half.*take a difference of two models"):
        model.derivatives([0.3], [0.2], parameters=["constants.half"])
    with pytest.raises(SceneError, match=r'did you mean "constants.half"'):
        model.with_parameters({"constants.haf": 1.0})


def test_a_saved_result_keeps_them(tmp_path: Path) -> None:
    result = mstmm.compile(rod()).simulate(0.1)
    result.save(str(tmp_path / "run.nc"))
    again = mstmm.load_result(tmp_path / "run.nc")
    assert again.model.scene == result.model.scene
    assert again.model.parameters["constants.half"] == 0.5
