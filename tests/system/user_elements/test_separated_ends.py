"""Hinges whose ends lie apart at their start: no welds, and no plane may be taken for granted."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mstmm
from tests.support.paths import TESTS

DEFINITIONS = TESTS / "support" / "user_elements" / "definitions" / "bracket.py"
ROD: dict[str, Any] = {
    "name": "rod", "mass": 1.0, "center_of_mass": [0.5, 0, 0], "inertia": [0.01, 0.08, 0.09],
    "ends": {"tip": [1.0, 0, 0]},
}  # fmt: skip
ARM = {**ROD, "name": "arm"}


@pytest.fixture(scope="module", autouse=True)
def store(tmp_path_factory: pytest.TempPathFactory) -> Any:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("MSTMM_KERNELS", str(tmp_path_factory.mktemp("kernels")))
        mstmm.generate_file(DEFINITIONS)
        yield


def arm(at: float, held: dict[str, Any], **more: Any) -> mstmm.Scene:
    rod = {**ROD, "ends": {"tip": [at, 0, 0]}}
    pin = {"name": "pin", "type": "pin", "inboard": "ground", "outboard": "rod"}
    joint = {"name": "joint", "inboard": "rod.tip", "outboard": "arm", **held}
    return mstmm.Scene(gravity=[0, -9.81, 0], body=[rod, ARM], hinge=[pin, joint], **more)


def test_a_bracket_holds_at_its_reach() -> None:
    bracket = arm(1.0, {"type": "bracket", "parameters": {"reach": 0.4}})
    weld = arm(1.4, {"type": "fixed"})
    found, expected = (mstmm.compile(s).accelerations([0.3], [0.5]) for s in (bracket, weld))
    np.testing.assert_allclose(found, expected, rtol=1e-14)
    assert not np.allclose(
        found, mstmm.compile(arm(1.0, {"type": "fixed"})).accelerations([0.3], [0.5])
    )


def test_a_bracket_cannot_be_let_go_as_a_weld() -> None:
    event = {"when": "t >= 1", "do": "release", "hinge": "joint"}
    scene = arm(1.0, {"type": "fixed"}, event=[event])
    assert mstmm.compile(scene).nu == 7
    held = {"type": "bracket", "parameters": {"reach": 0.4}}
    with pytest.raises(mstmm.SceneError, match="neither driven nor fixed"):
        arm(1.0, held, event=[event]).check_types({})


def test_a_raised_pin_leaves_the_plane() -> None:
    """A beam above the rod bends out of the plane in which both turn."""

    def shapes(hinge: dict[str, Any]) -> tuple[str, ...]:
        blade = {"name": "blade", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": 40.0}
        pin = {"name": "pin", "type": "pin", "inboard": "ground", "outboard": "rod"}
        joint = {"name": "joint", "inboard": "rod.tip", "outboard": "blade", **hinge}
        scene = mstmm.Scene(gravity=[0, -9.81, 0], body=[ROD], beam=[blade], hinge=[pin, joint])
        return mstmm.compile(scene).flexible_bodies["blade"].modes

    assert not any(mode.startswith("z") for mode in shapes({"type": "pin"}))
    raised = {"type": "raised_pin", "parameters": {"height": 0.3}}
    assert any(mode.startswith("z") for mode in shapes(raised))
