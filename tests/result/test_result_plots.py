"""Pictures: the right numbers under the right labels."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread
from support.models import model_of
from support.result_scenes import motor, pins, tree

import mstmm
from mstmm.runtime.result.names import Quantity
from mstmm.runtime.result.output.curves import curve
from mstmm.runtime.result.result import Result


@pytest.fixture(scope="module")
def run() -> Result:
    return mstmm.compile(tree()).simulate(1.0)


def test_one_panel_per_unit_with_names_and_units(run: Result) -> None:
    figure = run.plot("elbow.angle1", "arm.tip.y", "elbow.angle2", "wrist.force", "energy")
    panels = figure.axes
    assert [p.get_ylabel() for p in panels] == ["rad", "arm.tip.y in m", "N", "energy in J"]
    assert panels[-1].get_xlabel() == "time in s"
    names = [[text.get_text() for text in p.get_legend().get_texts()]
             for p in panels if p.get_legend()]  # fmt: skip
    assert names == [["elbow.angle1", "elbow.angle2"], [f"wrist.force.{x}" for x in "xyz"]]
    x, y = panels[0].lines[1].get_data()
    at = np.searchsorted(x, run.t)
    np.testing.assert_allclose(y[at], run.coordinate("elbow")[:, 1], atol=1e-12)
    assert [len(p.lines) for p in panels] == [2, 1, 3, 1]


def test_curves_between_samples_follow_the_motion() -> None:
    angle = mstmm.compile(pins(1, [0.4])).simulate(3.0)
    assert len(angle.t) < 60
    t, values = curve(angle.t, angle.quantity("pin0.angle"))
    exact = model_of(angle).simulate(3.0, rtol=1e-11, output_times=np.unique(t))
    straight = np.interp(t, angle.t, angle.q[:, 0]) - exact.q[:, 0]
    smooth = values[:, 0] - exact.q[:, 0]
    assert np.abs(smooth).max() < 0.1 * np.abs(straight).max() < 0.1


def test_curves_break_where_an_event_makes_them_jump() -> None:
    t = np.array([0.0, 1.0, 1.0, 2.0])
    x, y = curve(t, Quantity("x", np.array([0.0, 1.0, 5.0, 6.0]), "m", "x"))
    gap = np.flatnonzero(np.isnan(x))
    assert len(gap) == 1 and y[gap[0] - 1, 0] == 1.0 and y[gap[0] + 1, 0] == 5.0


def test_a_constant_is_drawn_flat() -> None:
    run = mstmm.compile(pins(2, [0.4, 0.3])).simulate(2.0)
    low, high = run.plot("energy").axes[0].get_ylim()
    assert high - low >= 0.9e-3 * abs(run.energy()[0]) > 1e3 * np.ptp(run.energy())


@pytest.mark.parametrize("suffix", ["png", "svg", "pdf"])
def test_pictures_in_files(run: Result, tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"run.{suffix}"
    run.plot(path=path, title="tree")
    assert [p.name for p in tmp_path.iterdir()] == [path.name]
    if suffix == "png":
        picture = imread(path)
        assert picture.shape[0] > 300 and picture.shape[1] > 800
        assert len(np.unique(picture[..., :3].reshape(-1, 3), axis=0)) > 20
    else:
        assert path.stat().st_size > 5000


def test_words_for_what_cannot_be_drawn(
    run: Result, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(mstmm.SceneError, match=r"\.png, \.svg or \.pdf"):
        run.plot("energy", path=tmp_path / "run.docx")
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(mstmm.EnvironmentFailure, match=r"pip install 'mstmm\[plot\]'"):
        run.plot("energy")


def test_a_run_of_one_sample_and_numbers_that_are_not_finite() -> None:
    run = mstmm.compile(motor("1")).simulate(0.0)
    assert len(run.t) == 1 and len(run.plot("motor.angle", "motor.effort").axes) == 2
    t, values = np.array([0.0, 1.0, 2.0]), np.array([0.0, np.nan, 1.0])
    x, y = curve(t, Quantity("x", values, "m", "x"))
    np.testing.assert_array_equal(x, t)
    np.testing.assert_array_equal(y[:, 0], values)


def test_a_run_without_samples_is_refused() -> None:
    from support.result_scenes import pins

    with pytest.raises(mstmm.SceneError, match="the run has no sample; ask for other times"):
        mstmm.compile(pins(1, [0.3])).simulate(1.0, output_times=[]).plot()


@pytest.mark.parametrize("title", [r"$\foo$", "$", "a\x1b[31mred", "50 $ and 60 $"])
def test_a_title_is_text(run: Result, tmp_path: Path, title: str) -> None:
    figure = run.plot("energy", path=tmp_path / "a.png", title=title)
    assert figure.get_suptitle() == title.replace("\x1b", "\\x1b")
