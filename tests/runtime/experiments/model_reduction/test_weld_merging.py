"""Welded rigid bodies as one: the same motion by fewer bodies."""

from __future__ import annotations

import tomllib
from collections.abc import Collection
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import mstmm
from mstmm.runtime.experiments.model_reduction.scene_edits import rename_reference
from mstmm.runtime.experiments.model_reduction.weld_merging import MergedScene, merge_welds
from tests.support.scenes.advice import TIP, hub_and_beam, period


def quaternion(rng: np.random.Generator) -> list[float]:
    q = rng.normal(size=4)
    return [float(x) for x in q / np.linalg.norm(q)]


def lump(rng: np.random.Generator, name: str) -> dict[str, Any]:
    inertia = np.sort(rng.uniform(0.5, 1, 3))
    inertia[2] = min(inertia[2], 0.95 * (inertia[0] + inertia[1]))
    return {
        "name": name, "mass": float(rng.uniform(0.5, 2)), "inertia": inertia.tolist(),
        "center_of_mass": rng.uniform(-0.3, 0.3, 3).tolist(),
        "ends": {
            end: {"position": rng.uniform(-0.5, 0.5, 3).tolist(), "orientation": quaternion(rng)}
            for end in "ab"
        },
    }  # fmt: skip


def lumps(rng: np.random.Generator, **more: Any) -> mstmm.Scene:
    """Five lumps: three welded in a row, and two, held by any of their ends in any orientation."""
    ball = {"name": "ball", "type": "ball", "inboard": "ground", "outboard": "p.a"}
    pin = {"name": "pin", "type": "pin", "inboard": "r.a", "outboard": "s.b", "axis": [1, 2, 3],
           "orientation": quaternion(rng), "law": {"stiffness": 3.0}}  # fmt: skip
    welds = [
        {"name": f"weld{i}", "type": "fixed", "inboard": a, "outboard": b,
         "orientation": quaternion(rng)}
        for i, (a, b) in enumerate((("p.b", "q.b"), ("q.a", "r"), ("s", "t.b")))
    ]  # fmt: skip
    scene: dict[str, Any] = {
        "gravity": [0, 0, -9.81],
        "body": [lump(rng, name) for name in "pqrst"],
        "hinge": [ball, *welds[:2], pin, welds[2]],
        "load": [{"on": "t.a", "force": [1, "sin(t)", 0]}],
        "spring": [{"from": "ground", "to": "r.b", "law": {"stiffness": 10}}],
    }
    return mstmm.Scene(**scene | more)


def run(scene: mstmm.Scene, quantity: str) -> NDArray[np.float64]:
    model = mstmm.compile(scene, engine="looped")
    result = model.simulate(1.0, rtol=1e-10, atol=1e-12, output_times=np.linspace(0, 1, 11))
    return result.quantity(quantity).values


def test_the_same_motion(rng: np.random.Generator) -> None:
    scene = lumps(rng)
    found = merge_welds(scene)
    assert found is not None
    assert [body.name for body in found.scene.body] == ["p", "s"]
    assert found.carriers == {"q": "p", "r": "p", "t": "s"}
    loaded = mstmm.Scene(**found.scene.model_dump(by_alias=True, exclude_none=True))
    for place in ("p.b", "q", "q.a", "r.b", "s.a", "t", "t.a"):
        for kind in ("position", "velocity", "orientation"):
            name = f"{place}.{kind}"
            one, other = run(scene, name), run(loaded, rename_reference(name, found.names))
            assert np.abs(one - other).max() < 1e-9


def merge_and_compare(scene: mstmm.Scene, keep: Collection[str] = ()) -> MergedScene:
    """Merge the welds of a scene, and assert that it moves as before, also read from text."""
    found = merge_welds(scene, keep)
    assert found is not None
    read = mstmm.Scene.from_data(tomllib.loads(found.scene.to_toml()))
    ends = [f"{body.name}.{end}" for body in scene.body for end in body.ends]
    for place in (*(body.name for body in scene.body), *ends):
        before = run(scene, f"{place}.position")
        after = (
            np.tile(found.fixed_points[place], (len(before), 1))
            if place in found.fixed_points
            else run(read, f"{rename_reference(place, found.names)}.position")
        )
        assert np.abs(before - after).max() < 1e-9, place
    return found


@pytest.mark.parametrize(
    "more",
    [
        {"event": [{"when": "t.a.x + t.z > 100", "do": "stop"}]},
        {"load": [{"on": "q.a", "force": ["2*t", 1, 0], "moment": [0, "t", 2], "axes": "body"}]},
        {"load": [{"on": "p.a", "force": [1, "-t", 0], "axes": "r"}]},
        {"load": [{"on": "q", "at": "center_of_mass", "force": [1, "-t", 0], "axes": "body"}]},
        {"load": [{"on": "p", "at": "center_of_mass", "force": [0, 2, "t"]}]},
        {"spring": [{"from": "p.a", "to": "r.b", "law": {"stiffness": 10}}]},
        {"output": [{"name": "high", "of": "t.a.z - q.z"}]},
    ],
    ids=lambda more: next(iter(more)),
)
def test_what_can_be_said_of_the_whole(rng: np.random.Generator, more: dict[str, Any]) -> None:
    """Places, axes of loads and springs within a body, in expressions too."""
    found = merge_and_compare(lumps(rng, **more))
    assert [body.name for body in found.scene.body] == ["p", "s"]
    assert found.idle == (('spring "spring1"',) if "spring" in more else ())


@pytest.mark.parametrize(
    ("more", "kept"),
    [
        ({"event": [{"when": "t > 100", "do": "release", "hinge": "weld1"}]}, ["p", "r", "s"]),
        ({"output": [{"name": "load", "of": "weld2.force.x"}]}, ["p", "s", "t"]),
    ],
)
def test_what_is_spoken_of_stays(
    rng: np.random.Generator, more: dict[str, Any], kept: list[str]
) -> None:
    found = merge_and_compare(lumps(rng, **more))
    assert [body.name for body in found.scene.body] == kept


def test_the_inboard_one_becomes_part_where_the_outboard_one_stays(
    rng: np.random.Generator,
) -> None:
    found = merge_and_compare(lumps(rng), keep=["r", "t"])
    assert found.carriers == {"q": "r", "p": "r", "s": "t"}


def test_welded_to_the_ground(rng: np.random.Generator) -> None:
    """Two lumps in a row on the ground in any pose: what hung on them hangs on the ground."""
    given = lumps(rng).model_dump(by_alias=True, exclude_none=True)
    weld = {"name": "base", "type": "fixed", "inboard": "ground", "outboard": "p.a",
            "position": [1.0, -2.0, 0.5], "orientation": quaternion(rng)}  # fmt: skip
    springs = [
        {"name": "taut", "from": "s.a", "to": "p.b", "law": {"stiffness": 20}},
        {"name": "idle", "from": "ground", "to": "r.b", "law": {"stiffness": 20}},
    ]
    loads = [
        {"on": "q.a", "force": [1, 0, 0]},
        {"on": "t.a", "force": [0, "sin(t)", 1], "axes": "q"},
    ]
    scene = mstmm.Scene(
        **given | {"hinge": [weld, *given["hinge"][1:]], "spring": springs, "load": loads}
    )
    found = merge_and_compare(scene)
    assert [body.name for body in found.scene.body] == ["s"]
    assert found.carriers == {"p": "ground", "q": "ground", "r": "ground", "t": "s"}
    assert set(found.idle) == {'load "load1"', 'spring "idle"'}
    assert any(text.startswith("the ground: merged with") for text in found.descriptions)
    stays = merge_and_compare(scene, keep=["q"])
    assert [body.name for body in stays.scene.body] == ["q", "s"]


def test_the_only_body_stays() -> None:
    weld = {"name": "weld", "type": "fixed", "inboard": "ground", "outboard": "p"}
    lone = lump(np.random.default_rng(1), "p")
    assert merge_welds(mstmm.Scene(gravity=[0, 0, 0], body=[lone], hinge=[weld])) is None


def test_what_is_welded_to_the_ground_in_an_advice() -> None:
    """A pillar on the ground, a rigid shelf on it with a load along it, and an arm on a pin."""
    scene = mstmm.Scene(
        gravity=[0, -9.81, 0],
        body=[{"name": "pillar", "mass": 5, "ends": {"top": [0, 2, 0]}},
              {"name": "arm", "mass": 1, "inertia": [0.1] * 3, "center_of_mass": [0.5, 0, 0]}],
        beam=[{"name": "shelf", "length": 1, "mass_per_length": 2, "bending_stiffness": 1e3,
               "model": "rigid",
               "modes": {"y": 1}}],
        hinge=[
            {"name": "foot", "type": "fixed", "inboard": "ground", "outboard": "pillar"},
            {"name": "bracket", "type": "fixed", "inboard": "pillar.top", "outboard": "shelf",
             "orientation": [0, 0, 0.3]},
            {"name": "pivot", "type": "pin", "inboard": "shelf.tip", "outboard": "arm"},
        ],
        load=[{"on": "shelf", "force_per_length": [0, -3, 0]}],
    )  # fmt: skip
    made = mstmm.advise(scene, 0.5, error=1e-3, rounds=0, budget=600)
    assert [body.name for body in made.scene.body] == ["arm"]
    assert made.scene.beam == ()
    (pivot,) = made.scene.hinge
    assert pivot.inboard == "ground"
    assert pivot.position == pytest.approx([np.cos(0.3), 2 + np.sin(0.3), 0])
    assert any("pillar.top is at [0, 2, 0] now" in text for text in made.other_changes)
    assert made.error <= 1e-3
    asked = mstmm.advise(scene, 0.5, error=1e-3, of="pillar.top.position", rounds=0, budget=600)
    assert "pillar" in {body.name for body in asked.scene.body}


def test_nothing_to_merge() -> None:
    assert merge_welds(hub_and_beam("A")) is None  # the beam deforms


def test_in_an_advice() -> None:
    """A rigid arm on its hub: one body, and the words to find the tip again."""
    made = mstmm.advise(hub_and_beam("A"), period("A"), error=5e-3, of=TIP, rounds=0, budget=600)
    assert [body.name for body in made.scene.body] == ["hub"]
    assert made.scene.beam == ()
    assert made.reduced_name(TIP) == "hub.arm_tip.position"
    assert any("arm.tip is hub.arm_tip now" in text for text in made.other_changes)
    assert "arm.tip is hub.arm_tip now" in made.to_toml()
