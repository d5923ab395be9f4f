"""Welded rigid bodies as one: the same motion by fewer bodies."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from advice.scenes import TIP, hub_and_beam, period
from numpy.typing import NDArray

import mstmm
from mstmm.runtime.advice.merging import merged
from mstmm.runtime.advice.renaming import renamed


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
    found = merged(scene)
    assert found is not None
    assert [body.name for body in found.scene.body] == ["p", "s"]
    assert found.into == {"q": "p", "r": "p", "t": "s"}
    loaded = mstmm.Scene(**found.scene.model_dump(by_alias=True, exclude_none=True))
    for place in ("p.b", "q", "q.a", "r.b", "s.a", "t", "t.a"):
        for kind in ("position", "velocity", "orientation"):
            name = f"{place}.{kind}"
            one, other = run(scene, name), run(loaded, renamed(name, found.names))
            assert np.abs(one - other).max() < 1e-9


@pytest.mark.parametrize(
    ("more", "kept"),
    [
        ({"event": [{"when": "t.x > 100", "do": "stop"}]}, "t"),
        ({"load": [{"on": "q.a", "force": [1, 0, 0], "axes": "body"}]}, "q"),
        ({"load": [{"on": "p.a", "force": [1, 0, 0], "axes": "r"}]}, "r"),
    ],
)
def test_what_is_spoken_of_stays(more: dict[str, Any], kept: str) -> None:
    found = merged(lumps(np.random.default_rng(1), **more))
    assert found is not None
    assert kept in {body.name for body in found.scene.body}
    assert len(found.into) == 2


def test_nothing_to_merge() -> None:
    assert merged(hub_and_beam("A")) is None  # the beam deforms


def test_in_an_advice() -> None:
    """A rigid arm on its hub: one body, and the words to find the tip again."""
    made = mstmm.advise(hub_and_beam("A"), period("A"), error=5e-3, of=TIP, rounds=0, budget=600)
    assert [body.name for body in made.scene.body] == ["hub"]
    assert made.scene.beam == ()
    assert made.renamed(TIP) == "hub.arm_tip.position"
    assert any("arm.tip is hub.arm_tip now" in text for text in made.changes)
    assert "arm.tip is hub.arm_tip now" in made.to_toml()
