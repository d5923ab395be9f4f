"""Scenes that start with speeds: a model at rest says so where these last and matter."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.errors import NumericalFailure
from tests.support.scenes.linear import pendulum

SPIN, MASS, STIFF = 3.0, 2.0, 200.0
SOLID = {"mass": MASS, "inertia": [0.1, 0.1, 0.1]}


def compile_tables(**scene: Any) -> mstmm.Model:
    return mstmm.compile(mstmm.Scene(**{"gravity": (0, 0, 0), **scene}), engine="looped")


def table(law: dict[str, float] | None = None) -> mstmm.Model:
    """A slider on a spring along a table that starts with a spin about z."""
    turn = {"name": "turn", "type": "pin", "inboard": "ground", "outboard": "table",
            "initial": {"u": [SPIN]}}  # fmt: skip
    rail = {"name": "rail", "type": "prismatic", "axis": [1, 0, 0], "inboard": "table",
            "outboard": "slider", "law": {"stiffness": STIFF}}  # fmt: skip
    return compile_tables(
        body=[{"name": "table", **SOLID}, {"name": "slider", **SOLID}],
        hinge=[turn | ({"law": law} if law else {}), rail],
    )


def start_speed_elements(answer: Any) -> list[str]:
    return [risk.element for risk in answer.risks if risk.name == "start-at-speed"]


def test_a_spin_that_lasts_is_told() -> None:
    """k / m at rest, k / m - W^2 beside the spin."""
    model = table()
    rest, spun = model.modes(), model.modes(None, *model.initial_state())
    assert rest.omega.max() ** 2 == pytest.approx(STIFF / MASS)
    assert spun.omega.max() ** 2 == pytest.approx(STIFF / MASS - SPIN**2)
    response = model.frequency_response([1.0], ["rail.effort"], ["rail.displacement"])
    assert (
        start_speed_elements(rest)
        == start_speed_elements(response)
        == start_speed_elements(model.linearize())
        == ["turn.angle_rate"]
    )
    assert (
        not start_speed_elements(spun)
        and not start_speed_elements(model.linearize([0.0, 0.0]))
        and rest.trusted
    )
    (text,) = [text for text in rest.warnings if "starts with steady speeds" in text]
    assert "linearize(*model.initial_state())" in text and "--at-start" in text


@pytest.mark.parametrize("law", [{"stiffness": 50.0}, {"damping": 5.0}])
def test_a_transient_about_rest_is_not(law: dict[str, float]) -> None:
    assert not start_speed_elements(table(law).linearize())


def test_what_changes_nothing_is_not() -> None:
    """A balanced wheel, a carriage, a pendulum that swings or starts to go round."""
    for kind in ("pin", "prismatic"):
        hinge = {"name": "h", "type": kind, "inboard": "ground", "outboard": "b",
                 "initial": {"u": [SPIN]}}  # fmt: skip
        assert not start_speed_elements(
            compile_tables(body=[{"name": "b", **SOLID}], hinge=[hinge]).linearize()
        )
    for speed in (0.5, 50.0):
        scene = pendulum(initial={"u": [speed]})
        assert not start_speed_elements(mstmm.compile(scene, engine="looped").linearize())


def test_a_free_body_that_spins_is_told() -> None:
    hinge = {"name": "h", "type": "free", "inboard": "ground", "outboard": "b"}
    body = {"name": "b", "mass": 1.0, "inertia": [0.1, 0.1, 0.15]}
    for u, names in ((np.eye(6)[2] * SPIN, []), (np.eye(6)[5] * SPIN, ["h.wz"])):
        model = compile_tables(body=[body], hinge=[hinge | {"initial": {"u": u.tolist()}}])
        assert start_speed_elements(model.linearize()) == names


def test_a_disc_that_rolls_in_a_circle_is_refused_with_the_remedy() -> None:
    """Its start leans, which is no rest; its motion has a model of first order."""
    lean, turn, r, m = 0.4, -2.0, 0.3, 2.0
    spin = turn * np.sin(lean) / 6 - 2 * 9.81 * np.tan(lean) / (3 * r * turn)
    start = {"q": [0, 0, r * np.cos(lean), np.cos(lean / 2), np.sin(lean / 2), 0, 0],
             "u": [spin * r, 0, 0, 0, spin, turn * np.cos(lean)]}  # fmt: skip
    model = compile_tables(
        gravity=(0, 0, -9.81),
        body=[{"name": "disc", "mass": m, "inertia": [m * r**2 / 4, m * r**2 / 2, m * r**2 / 4]}],
        hinge=[{"name": "motion", "type": "free", "inboard": "ground", "outboard": "disc",
                "initial": start}],
        constraint=[{"name": "road", "type": "rolling", "from": "ground", "to": "disc",
                     "normal": [0, 0, 1], "radius": r, "axis": [0, 1, 0]}],
    )  # fmt: skip
    with pytest.raises(NumericalFailure, match=r"linearize\(\*model\.initial_state\(\)\)"):
        model.linearize()
    assert model.linearize(*model.initial_state()).trusted
