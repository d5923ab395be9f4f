"""Pictures: the right numbers under the right labels."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.image import imread

import mstmm
from mstmm.runtime.result.plotting.default_quantities import choose_panels
from mstmm.runtime.result.plotting.panels import curve, spectrum
from mstmm.runtime.result.quantity_names import Quantity
from mstmm.runtime.result.result import Result
from tests.support.models import model_of
from tests.support.scenes.results import motor, pins, tree


@pytest.fixture(scope="module")
def run() -> Result:
    return mstmm.compile(tree()).simulate(1.0)


def test_one_panel_per_unit_with_names_and_units(run: Result) -> None:
    figure = run.plot("elbow.angle1", "arm.tip.y", "elbow.angle2", "wrist.force", "energy")
    panels = figure.axes
    assert [p.get_title("left") for p in panels] == [
        "angles of hinge elbow (rad)", "position of arm.tip, y (m)",
        "force of the inboard on the outboard side of hinge wrist (N)", "total energy (J)",
    ]  # fmt: skip
    assert panels[-1].get_xlabel() == "time (s)"
    names = [[text.get_text() for text in p.get_legend().get_texts()]
             for p in panels if p.get_legend()]  # fmt: skip
    assert names == [["elbow.angle1", "elbow.angle2"], [f"wrist.force.{x}" for x in "xyz"]]
    x, y = panels[0].lines[1].get_data()
    at = np.searchsorted(x, run.t)
    np.testing.assert_allclose(y[at], run.coordinates("elbow")[:, 1], atol=1e-12)
    assert [len(p.lines) for p in panels] == [2, 1, 3, 1]


def test_curves_between_samples_follow_the_motion() -> None:
    angle = mstmm.compile(pins(1, [0.4])).simulate(3.0)
    assert len(angle.t) < 60
    t, values = curve(angle.t, angle.quantity("pin0.angle"))
    exact = model_of(angle).simulate(3.0, rtol=1e-11, output_times=np.unique(t))
    straight = np.interp(t, angle.t, angle.q[:, 0]) - exact.q[:, 0]
    smooth = values[:, 0] - exact.q[:, 0]
    assert np.abs(smooth).max() < 0.1 * np.abs(straight).max() < 0.1


def test_of_many_hinges_those_are_drawn_that_move_most() -> None:
    scene = pins(40, [0.1 * k for k in range(40)])
    run = mstmm.compile(scene, engine="looped").simulate(0.2, output_times=np.linspace(0, 0.2, 9))
    (chosen,) = choose_panels(run)
    moved = np.ptp(run.q, axis=0)
    largest = sorted(np.argsort(-moved)[:6].tolist())
    assert chosen.names == tuple(f"pin{k}.angle" for k in largest)
    seventh = np.sort(moved)[-7]
    assert chosen.more == f"34 more that move by {seventh:.2g} rad or less"
    for candidate in run.default_quantities()[::9]:
        values = run.quantity(candidate.name).values
        assert candidate.moved == np.ptp(values) and candidate.unit == "rad"
    (panel,) = run.plot().axes
    assert panel.get_title("left") == "angle of 6 hinges (rad)" and len(panel.lines) == 6
    told = panel.get_legend().get_texts()[-1].get_text().replace("\n", " ")
    assert told == chosen.more and chosen.other in chosen.sentence


def test_one_quantity_over_another_and_its_rate_over_itself(run: Result) -> None:
    (panel,) = run.plot("arm.tip.y", against="arm.tip.x").axes
    x, y = panel.lines[0].get_data()
    assert (panel.get_xlabel(), panel.get_title("left")) == (
        "position of arm.tip, x (m)", "position of arm.tip, y (m)",
    )  # fmt: skip
    place = run.position("arm.tip")
    for row in place[::7, :2]:
        assert np.min(np.hypot(x - row[0], y - row[1])) < 1e-12
    (panel,) = run.plot("elbow.angle1", kind="phase").axes
    angle, rate = panel.lines[0].get_data()
    assert panel.get_title("left") == "rate of angle1 of hinge elbow (rad/s)"
    for q, u in zip(run.coordinates("elbow")[::7, 0], run.speeds("elbow")[::7, 0], strict=True):
        assert np.min(np.hypot(angle - q, rate - u)) < 1e-12
    with pytest.raises(mstmm.SceneError, match="a phase plot needs its rate"):
        run.plot("energy", kind="phase")
    with pytest.raises(mstmm.SceneError, match=r"give one, such as arm\.tip\.position\.x"):
        run.plot("arm.tip.y", against="arm.tip.position")
    with pytest.raises(mstmm.SceneError, match="give only one of them"):
        run.plot("arm.tip.y", against="arm.tip.x", kind="spectrum")
    with pytest.raises(mstmm.SceneError, match="expected one of time, phase, spectrum"):
        run.plot("arm.tip.y", kind="polar")


@pytest.mark.parametrize("even", [True, False])
def test_a_spectrum_shows_amplitudes_in_the_unit(even: bool) -> None:
    t = np.linspace(0.0, 20.0, 2001)
    if not even:
        t = t + 0.004 * np.sin(7 * t) * (t > 0) * (t < 20)
    two = 2 + 0.3 * np.sin(2 * np.pi * 2.5 * t) + 0.01 * np.cos(2 * np.pi * 11.25 * t)
    frequencies, amplitudes = spectrum(t, Quantity("x", two, "m", "x"))
    for frequency, height in ((2.5, 0.3), (11.25, 0.01)):
        near = np.abs(frequencies - frequency) < 0.5
        top = np.argmax(amplitudes[near, 0])
        assert frequencies[near][top] == pytest.approx(frequency, abs=0.02)
        assert amplitudes[near, 0][top] == pytest.approx(height, rel=0.02)
    far = np.abs(frequencies - 6.5) < 1
    assert amplitudes[far].max() < 2e-4 and amplitudes[0] < 1e-3
    with pytest.raises(mstmm.SceneError, match="needs 16 samples or more, there are 5"):
        spectrum(t[:5], Quantity("x", two[:5], "m", "x"))


def test_runs_over_each_other_and_axes_of_others(run: Result, tmp_path: Path) -> None:
    loose = model_of(run).simulate(1.0, rtol=1e-3)
    table = mstmm.load_result(loose.save(tmp_path / "loose.csv"))
    (panel,) = run.plot("energy", beside={"loose": table}, label="tight").axes
    assert [x.get_text() for x in panel.get_legend().get_texts()] == ["tight", "loose"]
    assert panel.lines[1].get_ydata()[-1] == loose.energy()[-1]
    both = run.plot("elbow.angle1", "elbow.angle2", beside={"loose": loose}).axes[0]
    names = [x.get_text() for x in both.get_legend().get_texts()]
    assert names == ["elbow.angle1", "elbow.angle2", "this run", "loose"]
    dashes = [line.get_linestyle() for line in both.get_legend().get_lines()]
    assert dashes == ["-", "-", "-", "--"] and both.lines[2].get_linestyle() == "--"
    assert both.lines[2].get_label() == "elbow.angle1, loose"
    colours = [line.get_color() for line in both.lines]
    assert colours[:2] == colours[2:] and colours[0] != colours[1]
    mine = Figure().subplots(2)
    assert run.plot("elbow.angle1", "energy", ax=mine) is mine[0].figure
    assert [len(axis.lines) for axis in mine] == [1, 1]
    with pytest.raises(mstmm.SceneError, match="there are 2 panels, one for each unit, and 1 axes"):
        run.plot("elbow.angle1", "energy", ax=mine[0])
    with pytest.raises(mstmm.SceneError, match='"a" is the label of another run'):
        run.plot("energy", beside={"a": loose}, label="a")


def test_names_and_runs_that_are_none(run: Result) -> None:
    for names, against in ((["elbow.angle1", "energy"], None), (5, None), ("energy", 3)):
        with pytest.raises(mstmm.SceneError, match=r"expected the name of a quantity, .*found"):
            run.plot(names, against=against)  # type: ignore[arg-type]
    for beside in (run, "run.nc", {"other": "run.nc"}):
        with pytest.raises(mstmm.SceneError, match=r"beside: .*expected (runs by their|a result)"):
            run.plot("energy", beside=beside)  # type: ignore[arg-type]


def test_what_one_of_several_runs_lacks_is_said(run: Result) -> None:
    other = mstmm.compile(motor("1")).simulate(1.0)
    panel = run.plot("elbow.angle1", "motor.angle", beside={"other": other}).axes[0]
    assert len(panel.lines) == 2
    told = " ".join(panel.get_legend().get_texts()[-1].get_text().split())
    assert told == "this run has no motor.angle; other has no elbow.angle1"
    with pytest.raises(mstmm.SceneError, match=r'did you mean "elbow\.angle1"'):
        run.plot("elbow.angel1", beside={"other": other})


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
    from tests.support.scenes.results import pins

    with pytest.raises(mstmm.SceneError, match="the run has no samples; give other output times"):
        mstmm.compile(pins(1, [0.3])).simulate(1.0, output_times=[]).plot()


@pytest.mark.parametrize("title", [r"$\foo$", "$", "a\x1b[31mred", "50 $ and 60 $"])
def test_a_title_is_text(run: Result, tmp_path: Path, title: str) -> None:
    figure = run.plot("energy", path=tmp_path / "a.png", title=title)
    assert figure.get_suptitle() == title.replace("\x1b", "\\x1b")
