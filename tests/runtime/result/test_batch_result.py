"""Quantities of batches: those of single runs, run by run."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray

import mstmm
from mstmm.runtime.model.model import Model
from mstmm.runtime.result.batch_result import BatchResult
from tests.support.scenes.results import rod

RUN: dict[str, Any] = {"t_end": 1.0, "output_times": np.linspace(0, 1, 6), "rtol": 1e-10}
PUSHES = np.array([-1.0, 0.5, 2.0])
MASSES = np.array([0.5, 1.0, 3.0])


@pytest.fixture(scope="module")
def model() -> Model:
    scene = mstmm.Scene(
        gravity=(0, -9.81, 0), body=[rod("rod1"), rod("rod2")],
        hinge=[
            {"name": "shoulder", "type": "pin", "inboard": "ground", "outboard": "rod1",
             "law": {"effort": "motor"}},
            {"name": "elbow", "type": "pin", "inboard": "rod1.tip", "outboard": "rod2",
             "law": {"damping": 0.2}},
        ],
        load=[{"name": "wind", "on": "rod2.tip", "force": [0, "push", 0]}],
        input=[{"name": "motor"}, {"name": "push"}],
        controller=[{"name": "regulator", "sample_time": 0.25, "inputs": ["shoulder.angle"],
                     "outputs": ["motor"], "D": [[-3.0]], "reference": [0.5]}],
    )  # fmt: skip
    return mstmm.compile(scene, engine="looped")


@pytest.fixture(scope="module")
def batch(model: Model) -> BatchResult:
    return model.simulate_batch(
        model.initial_state(), {"rod2.mass": MASSES}, inputs={"push": PUSHES}, **RUN
    )


def test_each_run_has_the_quantities_of_a_single_one(model: Model, batch: BatchResult) -> None:
    names = ("rod2.tip.position", "shoulder.force", "energy", "motor", "push", "wind.power",
             "shoulder.motor_power", "rod2.yaw")  # fmt: skip
    for k, (mass, push) in enumerate(zip(MASSES, PUSHES, strict=True)):
        one = model.with_parameters({"rod2.mass": mass}).simulate(inputs={"push": push}, **RUN)
        for name in names:
            known, found = one.quantity(name), batch.quantity(name)
            assert (found.unit, found.labels) == (known.unit, known.labels)
            np.testing.assert_allclose(found.values[k], known.values, rtol=1e-6, atol=1e-6)
    assert set(batch.quantity_names()) == set(one.quantity_names()) - {"work"}
    with pytest.raises(mstmm.SceneError, match="not integrated in batches"):
        batch.quantity("work")
    with pytest.raises(mstmm.SceneError, match='did you mean "energy"'):
        batch.quantity("enegry")
    for wrong in (-4, "0", 0.0, None):
        with pytest.raises(mstmm.SceneError, match="expected the index of a run, 0 to 2"):
            batch.result(wrong)  # type: ignore[arg-type]
    with pytest.raises(mstmm.SceneError, match="run = 3: expected the index of a run, 0 to 2"):
        batch.result(3)
    with pytest.raises(mstmm.SceneError, match="no certificate"):
        batch.result(1).certificate  # noqa: B018


def test_as_a_dataset_and_in_a_file(batch: BatchResult, tmp_path: Path) -> None:
    data = batch.to_xarray()
    assert dict(data.sizes) | {"run": 3, "time": 6} == dict(data.sizes)
    tip = data["position"].sel(body="rod2.tip").values
    np.testing.assert_array_equal(tip, batch.quantity("rod2.tip.position").values)
    wind = data["load_force"].sel(load="wind", axis="y").values
    np.testing.assert_array_equal(wind, np.repeat(PUSHES[:, None], 6, axis=1))
    assert "work" not in data
    with xarray.open_dataset(batch.save(tmp_path / "many.nc"), engine="h5netcdf") as file:
        np.testing.assert_array_equal(file["energy"], batch.quantity("energy").values)
        assert file.attrs["format"] == "mstmm batch"
    with pytest.raises(mstmm.SceneError, match="this is a batch of runs; open it as a Dataset"):
        mstmm.load_result(tmp_path / "many.nc")
    with pytest.raises(mstmm.SceneError, match=r"ends in \.nc"):
        batch.save(tmp_path / "many.csv")


def test_lines_for_few_runs_and_a_band_for_many(batch: BatchResult, tmp_path: Path) -> None:
    (axis,) = batch.plot("energy", path=tmp_path / "few.png").axes
    assert [line.get_label() for line in axis.lines] == ["run 0", "run 1", "run 2"]
    (axis,) = batch.plot("energy", band=True).axes
    np.testing.assert_allclose(
        axis.lines[0].get_ydata(), np.median(batch.quantity("energy").values, axis=0)
    )
    assert len(axis.collections) == 1
    told = axis.get_legend().get_texts()[-1].get_text().replace("\n", " ")
    assert told == "median and 5 to 95 % of 3 runs"


def test_what_a_run_did_not_reach_is_nan() -> None:
    hinge = {"name": "h", "type": "pin", "inboard": "ground", "outboard": "a",
             "law": {"effort": "push*exp(u)^3"}}  # fmt: skip
    scene = mstmm.Scene(gravity=(0, 0, 0), body=[rod("a")], hinge=[hinge], input=[{"name": "push"}])
    model = mstmm.compile(scene, engine="looped")
    start = np.zeros((2, 1)), np.ones((2, 1))
    batch = model.simulate_batch(start, inputs={"push": [0.0, 5.0]}, **RUN)
    assert batch.success.tolist() == [True, False]
    speeds = batch.quantity("a.tip.velocity").values
    assert np.isfinite(speeds[0]).all() and np.isfinite(speeds[1, 0]).all()
    assert np.isnan(speeds[1, -1]).all()


def test_batches_without_states_say_so() -> None:
    hinges = [
        {"name": name, "type": "pin", "inboard": on, "outboard": name, "axis": (0, 0, 1),
         "initial": {"q": [0.5]}}
        for name, on in (("a", "ground"), ("b", "a.tip"))
    ]  # fmt: skip
    wire = {"name": "wire", "type": "distance", "from": "ground", "to": "b.tip", "length": 1.8}
    scene = mstmm.Scene(
        gravity=(0, 0, 0), body=[rod("a"), rod("b")], hinge=hinges, constraint=[wire]
    )
    model = mstmm.compile(scene, engine="looped")
    lost = model.simulate_batch(
        model.initial_state(), parameters={"wire.length": [9.0, 9.5]}, **RUN
    )
    assert not lost.success.any() and lost.messages[0]
    none = model.simulate_batch((np.zeros((0, 2)), np.zeros((0, 2))), **RUN)
    for batch in (lost, none):
        for band in (False, True):
            with pytest.raises(mstmm.SceneError, match="nothing to plot: no run has a state"):
                batch.plot("a.angle", band=band)
    with pytest.raises(mstmm.SceneError, match="a batch of no runs has no quantities"):
        none.quantity("a.angle")


@pytest.mark.parametrize("band", [False, True])
def test_what_batches_do_not_integrate_is_refused(batch: BatchResult, band: bool) -> None:
    with pytest.raises(mstmm.SceneError, match='"work": not integrated in batches'):
        batch.plot("work", band=band)
