"""Shapes of elastic bodies as their hinges hold them, against Euler-Bernoulli bars: beta L of R. D.
Blevins, Formulas for Natural Frequency and Mode Shape (1979), table 8-1."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.runtime.flexible.elastic.modal_elastic import elastic_bodies
from mstmm.runtime.flexible.modal_body import ModalBody

LENGTH, SIDE, YOUNG, DENSITY = 1.0, 0.02, 2e11, 7850.0
UNIT = float(np.sqrt(YOUNG * SIDE**2 / 12 / DENSITY)) / LENGTH**2  # sqrt(EI / m) / L^2, rad/s
X, Y, Z = [1, 0, 0], [0, 1, 0], [0, 0, 1]


def bar(hinge: dict[str, Any], **more: Any) -> mstmm.Scene:
    body = {
        "name": "e", "young": YOUNG, "poisson": 0.0, "density": DENSITY,
        "box": {"size": [LENGTH, SIDE, SIDE], "divisions": [10, 1, 1],
                "corner": [0, -SIDE / 2, -SIDE / 2]},
        "ends": {"root": {"plane": [1, 0, 0, 0]}, "tip": {"plane": [1, 0, 0, LENGTH]}},
        **more.pop("elastic", {}),
    }  # fmt: skip
    held = {"name": "h", "inboard": "ground", "outboard": "e.root", **hinge}
    return mstmm.Scene(gravity=[0, 0, 0], elastic=[body], hinge=[held], **more)


@pytest.mark.parametrize(
    ("hinge", "expected"),
    [
        ({"type": "free"}, [4.730, 4.730, 7.853, 7.853]),
        ({"type": "planar"}, [1.875, 4.694, 4.730, 7.853]),
        ({"type": "ball"}, [3.927, 3.927, 7.069, 7.069]),
        ({"type": "pin", "axis": Z}, [1.875, 3.927, 4.694, 7.069]),
        ({"type": "pin", "axis": X}, [1.875, 1.875, 4.694, 4.694]),
        ({"type": "prismatic", "axis": Y}, [1.875, 2.365, 4.694, 5.498]),
        ({"type": "fixed"}, [1.875, 1.875, 4.694, 4.694]),
    ],
)
def test_default_shapes_hold_the_first_modes_of_a_bar(
    hinge: dict[str, Any], expected: list[float]
) -> None:
    """The second bending mode of a free bar was at 1.9 times its frequency."""
    model = mstmm.compile(bar(hinge), engine="looped")
    found = 2 * np.pi * model.linearize(q=model.initial_state()[0]).modes().frequency
    elastic = found[found > 0.1 * UNIT]
    assert elastic == pytest.approx(np.square(expected) * UNIT, rel=0.015)


def test_the_axes_of_the_held_end_turn_what_its_hinge_leaves_free() -> None:
    """A pin along the y axis of an end that is turned by 90 degrees about x turns about z."""
    ends = {"root": {"plane": [1, 0, 0, 0], "orientation": [np.pi / 2, 0, 0]}}
    turned = bar({"type": "pin", "axis": Y}, elastic={"ends": ends})
    straight = bar({"type": "pin", "axis": Z}, elastic={"ends": {"root": {"plane": [1, 0, 0, 0]}}})
    one, other = (elastic_bodies(scene)["e"].K for scene in (turned, straight))
    assert np.diag(one) == pytest.approx(np.diag(other), rel=1e-6)


def modal_deflection(body: ModalBody, **wrenches: Any) -> np.ndarray:
    """Modal coordinates under wrenches (force, moment) on ends, the frame's motion free."""
    load = sum(
        np.concatenate([body.ports[end].phi, body.ports[end].theta]).T @ np.asarray(wrench, float)
        for end, wrench in wrenches.items()
    )
    return np.asarray(np.linalg.solve(body.K, load))


@pytest.mark.parametrize("acts", ["load", "spring", "law"])
def test_loaded_ends_of_a_free_bar_stretch_twist_and_bend_it(acts: str) -> None:
    """By what acts on both ends in balance, with the deflections of a bar."""
    more: dict[str, Any] = {"load": [{"on": "e.tip", "force": X}]}
    if acts == "load":
        more["load"].append({"on": "e.root", "force": X})
    if acts == "spring":
        more["spring"] = [{"from": "ground", "to": "e.root", "type": "spring"}]
    law = {"law": {"stiffness": 6 * [1.0]}} if acts == "law" else {}
    body = elastic_bodies(bar({"type": "free"} | law, **more))["e"]
    tip, root = body.ports["tip"], body.ports["root"]
    pulled = modal_deflection(body, tip=[1, 0, 0, 0, 0, 0], root=[-1, 0, 0, 0, 0, 0])
    assert (tip.phi - root.phi)[0] @ pulled == pytest.approx(LENGTH / (YOUNG * SIDE**2), rel=1e-6)
    bent = modal_deflection(body, tip=[0, 0, 0, 0, 0, 1], root=[0, 0, 0, 0, 0, -1])
    curved = LENGTH / (YOUNG * SIDE**4 / 12)
    assert (tip.theta - root.theta)[2] @ bent == pytest.approx(curved, rel=1e-3)


def test_an_end_that_only_its_hinge_holds_brings_no_static_shapes() -> None:
    assert elastic_bodies(bar({"type": "free"}))["e"].n == 4
    assert elastic_bodies(bar({"type": "pin", "law": {"damping": 0.1}}))["e"].n == 5
    guided = {"constraint": [{"type": "point-on-plane", "from": "ground", "to": "e.tip",
                              "normal": Y}]}  # fmt: skip
    assert elastic_bodies(bar({"type": "free"}, **guided))["e"].n == 10
