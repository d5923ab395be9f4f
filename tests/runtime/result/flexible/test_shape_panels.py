"""Pictures of flexible bodies: what is drawn is what moved."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.collections import LineCollection
from matplotlib.image import imread

import mstmm
from mstmm.runtime.result.flexible.shape_panels import (
    Strip,
    principal_plane,
    shape_samples,
    strip_height,
)
from mstmm.runtime.result.result import Result


@pytest.fixture(scope="module")
def run() -> Result:
    blade = {"name": "blade", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": 5.0,
             "modes": {"y": 2}, "frame": "chord"}  # fmt: skip
    arm = {"name": "arm", "mass": 0.5, "inertia": [0.01] * 3, "ends": {"tip": [0.4, 0, 0]}}
    hinges = [
        {"name": "pivot", "type": "pin", "inboard": "ground", "outboard": "arm"},
        {"name": "elbow", "type": "pin", "inboard": "arm.tip", "outboard": "blade"},
    ]
    scene = mstmm.Scene(gravity=(0, -9.81, 0), body=[arm], beam=[blade], hinge=hinges)
    return mstmm.compile(scene, engine="looped").simulate(0.6, output_times=np.linspace(0, 0.6, 61))


def lines_of(axis: Any, count: int) -> Any:
    """Points of the lines of the collection whose lines have `count` points."""
    found = [c for c in axis.collections if isinstance(c, LineCollection)]
    return [np.array(c.get_segments()) for c in found if len(c.get_segments()[0]) == count]


def test_shapes_are_drawn_where_the_beam_was(run: Result) -> None:
    figure = run.plot("blade.shape")
    rest, bent = lines_of(figure.axes[0], 61)
    at = shape_samples(run.t)
    assert len(at) == 12 and at[0] == 0 and at[-1] == 60
    np.testing.assert_allclose(bent, run.deflected_shape("blade", 61)[at][:, :, :2], atol=1e-14)
    np.testing.assert_allclose(rest[:, 0], run.position("blade")[at][:, :2], atol=1e-14)
    assert np.abs(rest[-1, 30] - bent[-1, 30]).max() > 1e-3
    assert [figure.axes[0].get_xlabel(), figure.axes[0].get_ylabel()] == ["x in m", "y in m"]


def test_all_bodies_in_one_picture_with_rigid_ones_and_the_ground(run: Result) -> None:
    axis = run.plot("shape").axes[0]
    (rigid,) = lines_of(axis, 2)
    at = shape_samples(run.t)
    np.testing.assert_allclose(rigid[:, 1], run.position("arm.tip")[at][:, :2], atol=1e-14)
    assert len(axis.lines) == 1 and axis.lines[0].get_xdata()[0] == 0.0


def test_the_default_plot_begins_with_the_shapes(run: Result) -> None:
    figure = run.plot()
    assert figure.axes[0].get_ylabel() == "y in m"
    titles = [axis.get_title("left") for axis in figure.axes[-2:]]
    assert titles == ["angle of hinges pivot, elbow (rad)", "y1 of flexible body blade (m)"]


def test_deflection_along_the_beam_and_energies(run: Result, tmp_path: Path) -> None:
    path = tmp_path / "blade.png"
    figure = run.plot("blade.deflection", "blade.modal_energy", "pivot.angle", path=path)
    by_label = {axis.get_ylabel(): axis for axis in figure.axes}
    (curves,) = lines_of(by_label["deflection of blade\nalong y in m"], 61)
    expected = run.deflection("blade", np.linspace(0, 1, 61))[shape_samples(run.t)][:, :, 1]
    np.testing.assert_allclose(curves[:, :, 1], expected, atol=1e-15)
    energies = by_label["modal energy\nof blade in J"]
    top = max(c.get_paths()[0].vertices[:, 1].max() for c in energies.collections)
    assert top == pytest.approx(run.modal_energy("blade").sum(axis=1).max(), rel=0.05)
    assert [t.get_text() for t in energies.get_legend().get_texts()] == ["y2", "y1"]
    last = figure.axes[-1]
    assert (last.get_title("left"), last.get_xlabel()) == ("angle of hinge pivot (rad)", "time (s)")
    assert len(np.unique(imread(path)[..., :3].reshape(-1, 3), axis=0)) > 100


def test_pictures_have_names(run: Result) -> None:
    assert run.picture_names() == ("shape", "blade.shape", "blade.deflection", "blade.modal_energy")
    with pytest.raises(mstmm.SceneError, match="no such quantity"):
        run.plot("arm.shape")


def test_the_plane_of_largest_motion() -> None:
    random = np.random.default_rng(1)
    flat = random.normal(size=(50, 3)) * [3.0, 0.1, 2.0]
    first, second = principal_plane(flat)
    assert first.tolist() == [1, 0, 0] and second.tolist() == [0, 0, 1]
    assert [v.tolist() for v in principal_plane(flat[:, [0, 2, 1]] * [1, 1, 0])] == [
        [1, 0, 0],
        [0, 1, 0],
    ]
    turn, _ = np.linalg.qr(random.normal(size=(3, 3)))
    tilted = random.normal(size=(200, 3)) * [3.0, 2.0, 0.05] @ turn.T
    for direction in principal_plane(tilted):
        assert abs(direction @ turn[:, 2]) < 0.05


def test_strips_are_as_high_as_their_shapes_ask_for() -> None:
    def height(ratio: float) -> float:
        box = np.array([[[0.0, 0, 0], [1.0, ratio, 0]], [[0.0, ratio, 0], [1.0, 0, 0]]])
        return strip_height([Strip("b", np.zeros(2), box, box)])

    assert height(0.01) < height(0.5) < height(0.8) == pytest.approx(height(5.0), rel=0.2)
