"""Pictures of natural motions and of matrices: what is drawn is the motion."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import mstmm
from mstmm.errors import SceneError
from mstmm.runtime.linear.modes import Modes
from mstmm.runtime.linear.plots.mode_shapes import deformed_outlines
from tests.support.scenes.linear import UNIT, column, hanging, masses, pendulum


def modes_of(scene: mstmm.Scene) -> Modes:
    return mstmm.compile(scene, engine="looped").modes()


def test_points_move_as_the_shape_says() -> None:
    """Small angles of rods that hang move their ends sideways, by the sum of all above."""
    modes = modes_of(hanging(4))
    rest, moved = deformed_outlines(modes.linear, modes.shapes, 0.1)
    assert [len(line) for line in rest.bodies] == [2] * 7  # four rods and three joints between
    for k, outline in enumerate(moved):
        tips = np.array([line[1] for line in outline.bodies[:4]])
        sideways = np.cumsum(np.cumsum(modes.shapes[:, k]) * 0.25)
        np.testing.assert_allclose(tips[:, 0], 0.1 * sideways / np.abs(sideways).max(), atol=1e-7)
        np.testing.assert_allclose(tips[:, 1], [-0.25, -0.5, -0.75, -1.0], atol=1e-6)


def test_beams_are_bent() -> None:
    """The first shape of a clamped beam, in closed form, in the plane in which it bends."""
    beam = {"name": "beam", **UNIT, "modes": {"z": 6}}
    hinge = {"name": "foot", "type": "fixed", "inboard": "ground", "outboard": "beam"}
    modes = modes_of(mstmm.Scene(gravity=(0, 0, 0), beam=[beam], hinge=[hinge]))
    figure = modes.plot(which=[0])
    (panel,) = figure.axes
    assert (panel.get_xlabel(), panel.get_ylabel()) == ("x in m", "z in m")
    assert panel.get_title() == f"1: {modes.frequency[0]:.4g} Hz"
    drawn = panel.collections[2].get_segments()[0]  # bodies, springs at rest; bodies displaced
    beta = 1.8751040687
    x = drawn[:, 0] * beta
    ratio = (np.sinh(beta) - np.sin(beta)) / (np.cosh(beta) + np.cos(beta))
    expected = np.cosh(x) - np.cos(x) - ratio * (np.sinh(x) - np.sin(x))
    np.testing.assert_allclose(np.abs(drawn[:, 1]), 0.15 * expected / expected[-1], atol=1e-4)


def test_what_a_panel_says() -> None:
    standing = mstmm.compile(pendulum(), engine="looped").linearize([np.pi]).modes()
    assert standing.plot().axes[0].get_title() == "1: growth rate 4.302 1/s"
    damped = modes_of(pendulum(law={"damping": 0.5})).plot().axes[0].get_title()
    assert damped == "1: 0.6806 Hz, damping 10.96%"
    row = modes_of(masses(8, 1.0, 1.0)).plot()
    assert len([panel for panel in row.axes if panel.get_visible()]) == 6
    spinning = mstmm.Scene(
        gravity=(0, 0, 0), body=[{"name": "top", "mass": 1.0, "inertia": [1, 1, 1]}],
        hinge=[{"name": "pin", "type": "pin", "axis": [0, 0, 1], "inboard": "ground",
                "outboard": "top", "law": {"stiffness": 1.0}}],
    )  # fmt: skip
    panel = modes_of(spinning).plot().axes[0]
    assert panel.texts[0].get_text() == "rotation about its own axis"


def test_eigenvalues_in_their_plane(tmp_path: Path) -> None:
    modes = mstmm.compile(column(25.0, "body", 6), engine="looped").modes()
    axis = modes.plot_eigenvalues(tmp_path / "map.svg").axes[0]
    still, growing = (np.column_stack(line.get_data()) for line in axis.lines[:2])
    assert len(growing) == 1 and growing[0, 0] > 0
    values = modes.eigenvalues[~modes.unstable]
    np.testing.assert_array_equal(still, np.column_stack([values.real, values.imag]))
    assert (tmp_path / "map.svg").stat().st_size > 5_000


def test_slow_motions_stand_apart_from_fast_ones() -> None:
    """Over some decades the slow ones would share a place, and one number."""
    axis = modes_of(hanging(40)).plot_eigenvalues().axes[0]
    assert axis.get_yscale() == "symlog"
    assert {text.get_text() for text in axis.texts} >= {"1", "2", "3", "4"}


def test_dots_do_not_hide_a_long_shape() -> None:
    few, many = (modes_of(masses(n, 1.0, 1.0)).plot(which=[0]).axes[0] for n in (4, 20))
    dots = [sum(line.get_marker() == "o" for line in panel.lines) for panel in (few, many)]
    assert dots == [2, 1]


def test_matrices_as_maps(tmp_path: Path) -> None:
    linear = mstmm.compile(hanging(3), engine="looped").linearize()
    panels = linear.plot(tmp_path / "matrices.png").axes[:3]
    np.testing.assert_array_equal(panels[2].images[0].get_array(), linear.K)
    assert [panel.get_title() for panel in panels] == ["M", "C = 0", "K"]
    assert panels[0].get_yticklabels()[1].get_text() == "rope[1].hinge.angle"


def test_pictures_that_make_no_sense(tmp_path: Path) -> None:
    linear = mstmm.compile(hanging(3), engine="looped").linearize()
    modes = linear.modes()
    with pytest.raises(SceneError, match="the index of one of 3 modes, from 0"):
        modes.plot(which=[3])
    for wrong in ("ab", 1, [], list(range(13))):
        with pytest.raises(SceneError, match="expected a list of 1 to 12 shapes"):
            modes.plot(which=wrong)  # type: ignore[arg-type]
    for path in (3, ["a.png"]):
        for draw in (modes.plot, modes.plot_eigenvalues, linear.plot, modes.save):
            with pytest.raises(SceneError, match="expected a path"):
                draw(path)  # type: ignore[arg-type]
    with pytest.raises(SceneError, match=r"expected a name that ends in \.png"):
        modes.plot(tmp_path / "modes.txt")
    body = {"name": "block", "mass": 1.0, "inertia": [1, 1, 1]}
    weld = {"name": "on", "type": "fixed", "inboard": "ground", "outboard": "block"}
    still = mstmm.compile(mstmm.Scene(gravity=(0, 0, 0), body=[body], hinge=[weld]))
    for draw in (still.modes().plot, still.modes().plot_eigenvalues, still.linearize().plot):
        with pytest.raises(SceneError, match="no degrees of freedom"):
            draw()
