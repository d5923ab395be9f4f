"""Answers over the frequency as pictures and files."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

import mstmm
from mstmm.errors import SceneError
from mstmm.runtime.linear.frequency_response import FrequencyResponse
from tests.support.scenes.linear import hanging_beam, pendulum

OMEGA = np.geomspace(0.5, 60, 60)


@pytest.fixture(scope="module")
def response() -> FrequencyResponse:
    model = mstmm.compile(hanging_beam(1.0, 3), engine="looped")
    return model.frequency_response(OMEGA, ["pin.effort"], ["pin.angle", "beam.tip.y"])


def test_pictures(response: FrequencyResponse, tmp_path: Path) -> None:
    figure = response.plot(tmp_path / "bode.png")
    above, below = figure.axes
    x, y = above.lines[1].get_data()
    np.testing.assert_allclose(x, OMEGA / (2 * np.pi))
    np.testing.assert_allclose(y, response.magnitude[:, 1, 0])
    assert above.get_legend().get_texts()[0].get_text() == "pin.angle / pin.effort, rad/(N*m)"
    assert below.get_xlabel() == "frequency in Hz"
    plane = response.plot_nyquist(tmp_path / "nyquist.svg").axes[0]
    np.testing.assert_allclose(plane.lines[0].get_xdata(), response.response[:, 0, 0].real)
    assert {p.name for p in tmp_path.iterdir()} == {"bode.png", "nyquist.svg"}
    with pytest.raises(SceneError, match=r"expected a name that ends in \.png, \.svg or"):
        response.plot(tmp_path / "bode.txt")


def test_files(response: FrequencyResponse, tmp_path: Path) -> None:
    rows = list(csv.reader(response.save(tmp_path / "frf.csv").read_text().splitlines()))
    assert rows[0][:3] == ["omega [rad/s]", "frequency [Hz]", "pin.angle / pin.effort magnitude"]
    np.testing.assert_allclose(float(rows[5][2]), response.magnitude[4, 0, 0])
    import xarray

    with xarray.open_dataset(response.save(tmp_path / "frf.nc"), engine="h5netcdf") as data:
        found = data.phase.sel(output="beam.tip.position.y", input="pin.effort")
        np.testing.assert_allclose(found, response.phase[:, 1, 0])
    assert response.to_dict()["outputs"] == ["pin.angle", "beam.tip.position.y"]


def test_a_waterfall_is_a_row_of_answers(tmp_path: Path) -> None:
    model = mstmm.compile(pendulum(law={"stiffness": 1.0, "damping": 0.3}), engine="looped")
    stiffness, names = [1.0, 4.0, 9.0], ("pivot.effort", "pivot.angle")
    found = model.waterfall("pivot.law.stiffness[0]", stiffness, OMEGA, *names)
    k = np.array(stiffness)[:, None] + 9.81
    expected = 1 / (k + 0.3j * OMEGA - 0.53 * OMEGA**2)
    np.testing.assert_allclose(found.response, expected, rtol=1e-9)
    with pytest.raises(SceneError, match=r"output = \['pivot.angle'\]: expected one name"):
        model.waterfall("pivot.law.stiffness[0]", stiffness, OMEGA, names[0], [names[1]])  # type: ignore[arg-type]
    mixed = model.waterfall("pivot.law.stiffness[0]", [4.0, 9.0, 1.0], OMEGA, *names)
    shown = [one.plot().axes[0].collections[0].get_array() for one in (found, mixed)]
    np.testing.assert_array_equal(*shown)  # a picture goes up, whatever the order of the rows
    rows = list(csv.reader(found.save(tmp_path / "waterfall.csv").read_text().splitlines()))
    assert rows[0][:2] == ["pivot.law.stiffness[0]", "omega [rad/s]"] and len(rows) == 1 + 3 * 60
    numbers = np.array(rows[1:], float).reshape(3, 60, 5)
    np.testing.assert_array_equal(numbers[:, 0, 0], stiffness)
    np.testing.assert_allclose(
        numbers[:, :, 3] * np.exp(1j * numbers[:, :, 4]), found.response, rtol=1e-12
    )
    with pytest.raises(SceneError, match="expected a path"):
        found.save(None)  # type: ignore[arg-type]
    found.plot(tmp_path / "waterfall.png")
    assert (tmp_path / "waterfall.png").stat().st_size > 10_000
