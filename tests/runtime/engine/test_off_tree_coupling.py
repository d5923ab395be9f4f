"""Loops that stand side by side are answered together, as if each had been asked alone."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.runtime.engine import tangent_matrix
from mstmm.runtime.engine.looped_engine import LoopedEngine
from mstmm.runtime.engine.off_tree_coupling import OffTreeCoupling, off_tree_coupling, single_group
from tests.reference.random_couplings import random_coupled
from tests.support.scenes.linkages import cranks, legs
from tests.support.scenes.published_mechanisms import andrews, four_bars, scissors
from tests.system.loops.test_flexible_against_tree import (
    hanging_bar,
    meshed_slider_crank,
    shackled_beam,
)

SEED = 20


def on_a_frame(count: int) -> dict[str, Any]:
    """Windows whose feet stand on a body that is welded to the ground."""
    scene = four_bars(count, angle=0.7)
    ends = dict[str, list[float]]()
    for hinge in scene["hinge"]:
        if hinge["inboard"] == "ground":
            ends[hinge["name"]] = hinge.pop("position")
            hinge["inboard"] = f"frame.{hinge['name']}"
    frame = {"name": "frame", "mass": 1.0, "inertia": [1.0, 1.0, 1.0], "ends": ends}
    weld = {"name": "held", "type": "fixed", "inboard": "ground", "outboard": "frame"}
    return scene | {"body": [frame, *scene["body"]], "hinge": [weld, *scene["hinge"]]}


def with_springs() -> dict[str, Any]:
    """Windows tied to others, a load in axes of another one's body."""
    law = {"stiffness": 40.0, "damping": 1.0}
    return four_bars(6, angle=0.7) | {
        "spring": [
            {"from": "coupler0", "to": "crank3.tip", "law": law},
            {"from": "crank1", "to": "coupler5.tip", "law": law},
        ],
        "load": [{"on": "crank2", "force": [1.0, "3*sin(t)", 0], "axes": "coupler4"}],
    }


def follower_cranks(count: int) -> dict[str, Any]:
    """Four-bars whose cranks follow the left one; laws of closing hinges depend on a crank."""
    scene = four_bars(count, angle=0.7)
    hinges = {hinge["name"]: hinge for hinge in scene["hinge"]}
    for k in range(count):
        hinges[f"foot{k + 1}"]["law"] = {"effort": f"9*(foot{k}.q - q) - 0.3*u"}
        hinges[f"right{k}"]["law"] = {"effort": f"0.1*foot{k}.u - 0.2*u"}
    return scene | {"load": [{"on": "crank1", "force": ["foot0.q", 0, 0], "axes": "body"}]}


SCENES = {
    "windows": four_bars(6, angle=0.7), "on a frame": on_a_frame(5), "springs": with_springs(),
    "told": follower_cranks(6),
    "cranks": cranks(), "legs": legs(law=100.0), "Andrews": andrews(), "scissors": scissors(4),
    "a blade that hangs": hanging_bar(), "shapes in mesh": meshed_slider_crank(),
    "a flexible rod": shackled_beam(),
}  # fmt: skip


def engine_of(scene: dict[str, Any]) -> LoopedEngine:
    return mstmm.compile(mstmm.Scene(**scene), engine="looped").looped


def answers(engine: LoopedEngine, q: Any, u: Any, s: float) -> list[Any]:
    """One step's answers to a right-hand side and to increments that are known."""
    rng = np.random.default_rng(SEED)
    one = tangent_matrix.TangentMatrix(engine)
    one.residual(0.1, q, u)
    one.factor(s, s)
    r, d_a = rng.normal(size=(2, engine.nu))
    d_q = one.coordinates(np.zeros(engine.nu), rng.normal(size=engine.nq))
    found = [one.solve(r), one.solve(r, d_q, d_a)]
    return [*found, one.accelerations_rate()]


@pytest.mark.parametrize("name", SCENES)
def test_answers_are_those_of_the_full_matrix(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    model = mstmm.compile(mstmm.Scene(**SCENES[name]), engine="looped")
    engine, state = model.looped, model.initial_state()
    s = 1e5 if name == "Andrews" else 50.0
    found = answers(engine, *state, s)

    def full(engine: LoopedEngine) -> OffTreeCoupling:
        own = off_tree_coupling(engine)
        return single_group(own.bodies, own.efforts, own.rows, engine.nu)

    monkeypatch.setattr(tangent_matrix, "off_tree_coupling", full)
    for one, other in zip(found, answers(engine, *state, s), strict=True):
        assert np.abs(one - other).max() <= 1e-11 * np.abs(other).max()


@pytest.mark.parametrize(
    "make",
    [lambda n: four_bars(n, angle=0.7), on_a_frame, pytest.param(follower_cranks, id="told")],
)
def test_passes_do_not_grow_with_the_windows(make: Any) -> None:
    few, many = (off_tree_coupling(engine_of(make(count))) for count in (8, 64))
    assert many.count == 8 * few.count
    assert len(many.passes) == len(few.passes) < 40
    assert many.width == few.width < 120


def test_couplings_keep_all_in_one_group() -> None:
    across = off_tree_coupling(engine_of(random_coupled(4)[0]))
    assert len(across.passes) == across.width == across.count
