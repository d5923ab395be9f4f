"""What the shapes of elastic bodies miss is told, beside deflections of bars (beam theory)."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.runtime.flexible.elastic.modal_elastic import elastic_bodies
from mstmm.runtime.flexible.modal_body import radius_of_gyration

LENGTH, SIDE, YOUNG = 1.0, 0.02, 2e11
BENDING, STRETCHING = YOUNG * SIDE**4 / 12, YOUNG * SIDE**2


def bar(hinge: str, static: bool | None = None, **more: Any) -> mstmm.Scene:
    """A bar of four modes with, or without, static shapes at its tip."""
    tip = {"plane": [1, 0, 0, LENGTH]} | ({} if static is None else {"static_shapes": static})
    body = {
        "name": "e", "young": YOUNG, "poisson": 0.0, "density": 7850.0, "modes": 4,
        "box": {"size": [LENGTH, SIDE, SIDE], "divisions": [8, 1, 1],
                "corner": [0, -SIDE / 2, -SIDE / 2]},
        "ends": {"root": {"plane": [1, 0, 0, 0]}, "tip": tip},
    }  # fmt: skip
    held = {"name": "h", "type": hinge, "inboard": "ground", "outboard": "e.root"}
    return mstmm.Scene(**{"gravity": [0, 0, 0], "elastic": [body], "hinge": [held]} | more)


@pytest.mark.parametrize(
    ("static", "wrench", "share"),
    [
        (True, [0, 0, 0, 0, 0, 1], 0.0),
        (True, [1, 0, 0, 0, 0, 0], 0.0),
        (False, [1, 0, 0, 0, 0, 0], 1.0),  # no axial mode among the first four
        (False, [0, 0, 0, 1, 0, 0], 1.0),  # nor one of twist
    ],
)
def test_loads_of_an_end_in_balance_with_its_hinge(
    static: bool, wrench: list[float], share: float
) -> None:
    """Pulled, twisted and bent by what the hinge takes up."""
    body = elastic_bodies(bar("fixed", static))["e"]
    assert body.truncation is not None
    held = -np.array(wrench)
    ports = {"root": held, "tip": wrench}
    loads = np.concatenate([*(ports[name] for name in body.truncation.ports),
                            np.zeros(9 + body.n)])  # fmt: skip
    missed = body.truncation.missed_share(loads[None], radius_of_gyration(body))
    assert missed[0] == pytest.approx(share, abs=1e-6)


@pytest.mark.parametrize("load", [[1.0, 0, 0, 0, 0, 0], [0, 0, 0, 0, 0, 1.0]])
def test_the_whole_deflection_is_that_of_a_bar(load: list[float]) -> None:
    body = elastic_bodies(bar("fixed", True))["e"]
    assert body.truncation is not None
    signs = {"root": -1.0, "tip": 1.0}
    wrench = [signs[name] * np.array(load) for name in body.truncation.ports]
    given = np.concatenate([*wrench, np.zeros(9 + body.n)])
    moved = dict(zip(body.truncation.ports, (body.truncation.full_response @ given).reshape(-1, 6),
                     strict=True))  # fmt: skip
    apart = (moved["tip"] - moved["root"]) @ load
    exact = LENGTH / (STRETCHING if load[0] else BENDING)
    assert apart == pytest.approx(exact, rel=1e-3)


def shape_warnings(scene: mstmm.Scene, t_end: float) -> list[str]:
    run = mstmm.compile(scene, engine="looped").simulate(t_end, rtol=1e-5)
    assert run.certificate.flexible_bodies[0].tail is not None
    return [text for text in run.warnings if "miss" in text]


def test_a_run_whose_shapes_cannot_carry_its_loads_is_doubted() -> None:
    """A moment at an end without static shapes, raised slowly; with them nothing is missed."""
    load = [{"on": "e.tip", "moment": [0, 0, "20*(1 - cos(30*t))"]}]
    poor, good = (shape_warnings(bar("fixed", static, load=load), 0.1) for static in (False, True))
    assert len(poor) == 1 and "deflection of its ends" in poor[0] and not good


@pytest.mark.parametrize("hinge", ["fixed", "pin"])
def test_weight_is_carried_by_default_shapes(hinge: str) -> None:
    assert not shape_warnings(bar(hinge, gravity=[0, -9.81, 0]), 0.05)
