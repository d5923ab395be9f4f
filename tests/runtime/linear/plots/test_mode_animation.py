"""Natural motions as they move: how far, where they rest, and which of them a page shows."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import mstmm
from mstmm.errors import SceneError
from mstmm.runtime.linear.modes import Modes
from tests.support.scenes import view as scenes
from tests.support.view import browser

#: A parallel crank on springs: two cranks of 1 m and a bar between them.
CRANKS: dict[str, Any] = {
    "gravity": [0, -9.81, 0],
    "body": [
        {"name": name, "mass": 1.0, "center_of_mass": [x, y, 0], "inertia": [0.1, 0.1, 0.1],
         "ends": {"end": [2 * x, 2 * y, 0]}}
        for name, x, y in (("left", 0, 0.5), ("bar", 1.0, 0.25), ("right", 0, 0.75))
    ],
    "hinge": [
        {"name": "a", "type": "pin", "inboard": "ground", "outboard": "left",
         "law": {"stiffness": 200.0}},
        {"name": "b", "type": "pin", "inboard": "left.end", "outboard": "bar"},
        {"name": "c", "type": "pin", "inboard": "ground", "position": [2, 0, 0],
         "outboard": "right"},
        {"name": "d", "type": "pin", "inboard": "bar.end", "outboard": "right.end"},
    ],
}  # fmt: skip


@pytest.fixture(scope="module")
def modes() -> Modes:
    return scenes.model().linearize().modes(damped=False)


def test_the_widest_is_a_part_of_the_scene_and_a_quarter_later_all_rests(modes: Modes) -> None:
    view = modes.view(which=[0, 4], amplitude=0.01)
    state = modes.linear.state
    still = scenes.model().simulate(0.0, initial=(state.q, state.u))
    size = still.view().stage.size
    (name, stage), _ = view.parts
    assert name.startswith("mode 1, ")
    assert name.endswith(" Hz")
    assert stage.clock == ("phase", "deg")
    rod = stage.poses["bodies/rod"].position
    rest = still.position("rod")[0]
    assert rod[10] == pytest.approx(rest, abs=1e-9)
    assert rod[30] == pytest.approx(rest, abs=1e-9)
    assert rod[0] - rest == pytest.approx(rest - rod[20], abs=1e-3)
    ends = [stage.poses[owner].position for owner in stage.poses if owner.startswith("bodies/")]
    farthest = max(np.linalg.norm(x[0] - x[10], axis=-1).max() for x in ends)
    assert 0.002 * size < farthest < 0.012 * size


def test_loops_stay_closed() -> None:
    modes = mstmm.compile(mstmm.Scene(**CRANKS), engine="looped").linearize().modes()
    assert len(modes) == 1
    [(_, stage)] = modes.view(amplitude=0.2).parts
    bar = stage.poses["bodies/bar"].inertial_points(np.array([[2.0, 0.5, 0]]))[:, 0]
    right = stage.poses["bodies/right"].inertial_points(np.array([[0.0, 1.5, 0]]))[:, 0]
    assert np.ptp(bar, axis=0).max() > 0.3
    assert bar == pytest.approx(right, abs=1e-9)


def test_a_strip_has_a_panel_for_each_and_a_title(modes: Modes, tmp_path: Path) -> None:
    view = modes.view(which=[0, 1, 2])
    heights = []
    for title in (False, True):
        view.save(tmp_path / "modes.png", title=title)
        with Image.open(tmp_path / "modes.png") as picture:
            heights.append(picture.size[1])
            thirds = np.array_split(np.asarray(picture.convert("L")), 3, axis=1)
        assert min((third < 200).mean() for third in thirds) > 0.005
    assert heights[1] > heights[0] + 30


def test_refusals(modes: Modes) -> None:
    with pytest.raises(SceneError, match="amplitude = 2: expected a fraction of the size"):
        modes.view(amplitude=2)
    with pytest.raises(SceneError, match="shape 99: expected the index of one of 7"):
        modes.view(which=[99])
    with pytest.raises(SceneError, match="expected a list of 1 to 12 shapes"):
        modes.view(which=3)  # type: ignore[arg-type]


@pytest.mark.skipif(browser.PROGRAM is None, reason="Chromium is not installed")
def test_one_is_chosen_on_the_page(modes: Modes, tmp_path: Path) -> None:
    path = modes.view(which=[0, 2]).save(tmp_path / "modes.html")
    near = "window.__viserMutable.nodePoseData['/{}'].position[0] === 0"
    with browser.open_page(path) as page:
        names = page.wait("[...(document.querySelector('#mstmm select') || [])].map((o) => o.text)")
        assert len(names) == 2
        assert page.wait(f"window.__viserMutable && {near.format(names[0])}"), page.console
        assert page.wait(f"!({near.format(names[1])})")
        page.value(
            "(() => { const s = document.querySelector('#mstmm select'); s.selectedIndex = 1; })()"
        )
        assert page.wait(f"{near.format(names[1])} && !({near.format(names[0])})")
        assert "phase = " in page.value("document.querySelector('#mstmm div').textContent")
        assert page.console == []
