"""Members of chains: rigid, one, and without their springs, by themselves or all together."""

from __future__ import annotations

import tomllib
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import mstmm
from mstmm.runtime.experiments.model_reduction import scene_edits as chain_expansion
from mstmm.runtime.experiments.model_reduction.scene_edits import (
    expand_chains,
    expandable_chains,
    rename_reference,
)
from mstmm.runtime.experiments.model_reduction.weld_merging import merge_welds
from tests.support.scenes.advice import tip

OF = "rope[last].tip.position"


def rope(count: int, *hinges: dict[str, Any], **more: Any) -> mstmm.Scene:
    """Rods in a row on pins with these laws, the first one on a post on the ground."""
    rod = {"mass": 1.0, "center_of_mass": [0.1, 0, 0], "inertia": [1e-3, 4e-3, 4e-3],
           "ends": {"tip": {"position": [0.2, 0, 0], "orientation": [0, 0, 0.1]}}}  # fmt: skip
    row = [{"type": "pin", **one} for one in hinges]
    return mstmm.Scene(
        gravity=[0, -9.81, 0],
        body=[{"name": "post", "mass": 2.0, "ends": {"top": [0, 1, 0]}}],
        hinge=[{"name": "foot", "type": "fixed", "inboard": "ground", "outboard": "post"},
               *more.pop("hinge", [])],
        chain=[{"name": "rope", "count": count, "inboard": "post.top", "body": rod, "hinge": row,
                "orientation": [0, 0, -0.2]}],
        **more,
    )  # fmt: skip


def spoken_of() -> dict[str, Any]:
    """What speaks of members: loads, springs, an event, an output and a law."""
    return {
        "load": [{"on": "rope[1].tip", "force": [1, "sin(t)", 0], "axes": "rope[last]"}],
        "spring": [{"from": "rope[0].tip", "to": "rope[last]", "law": {"stiffness": 5}}],
        "event": [{"when": "rope[last].tip.y + rope[2].hinge.q > 100", "do": "stop"}],
        "output": [{"name": "low", "of": "rope[2].tip.y"}],
    }


def places(scene: mstmm.Scene, names: list[str]) -> NDArray[np.float64]:
    model = mstmm.compile(scene, engine="looped")
    times = np.linspace(0, 0.5, 6)
    result = model.simulate(0.5, rtol=1e-11, atol=1e-13, output_times=times)
    return np.hstack([result.position(name) for name in names])


NAMES = ["rope[0]", "rope[1].tip", "rope[3].tip", "rope[last].tip"]


def test_written_out_it_is_the_same() -> None:
    scene = rope(4, {"law": {"stiffness": 3.0}}, {"law": {"damping": 0.1}}, **spoken_of())
    found = expand_chains(scene, expandable_chains(scene))
    read = mstmm.Scene.from_data(tomllib.loads(found.scene.to_toml()))
    assert read.chain == ()
    assert read.event[0].when.text == "rope_3.tip.y + rope_2_hinge.q > 100"
    assert read.output[0].of.text == "rope_2.tip.y"
    assert read.load[0].axes == "rope_3"
    after = places(read, [rename_reference(name, found.names) for name in NAMES])
    assert np.abs(places(scene, NAMES) - after).max() < 1e-12


def test_names_that_are_taken() -> None:
    """A hinge has the name that a member's would get, and stays what it is."""
    bob = {"name": "rope_1", "mass": 1.0, "inertia": [0.1, 0.1, 0.1]}
    pin = {"name": "rope_1_hinge", "type": "pin", "inboard": "rope[1].tip", "outboard": "rope_1"}
    given = rope(2, {}).model_dump(by_alias=True, exclude_none=True)
    scene = mstmm.Scene(**given | {"body": [*given["body"], bob], "hinge": [*given["hinge"], pin]})
    found = expand_chains(scene, expandable_chains(scene))
    assert found.names["rope[1].tip"] == "rope_1_.tip"
    assert found.names["rope[1].hinge"] == "rope_1_hinge_"
    names = ["rope_1", "rope[last].tip"]
    after = places(found.scene, [rename_reference(name, found.names) for name in names])
    assert np.abs(places(scene, names) - after).max() < 1e-12


def test_welded_members_are_one() -> None:
    scene = rope(5, {"law": {"stiffness": 3.0}}, {"type": "fixed", "orientation": [0.3, 0, 0.2]})
    found = merge_welds(scene)
    assert found is not None
    read = mstmm.Scene.from_data(tomllib.loads(found.scene.to_toml()))
    assert [body.name for body in read.body] == ["rope_0", "rope_2", "rope_4"]
    assert read.hinge[0].inboard == "ground"
    after = places(read, [rename_reference(name, found.names) for name in NAMES])
    assert np.abs(places(scene, NAMES) - after).max() < 1e-11
    assert found.fixed_points["post.top"] == (0.0, 1.0, 0.0)


def test_a_chain_on_what_is_welded_to_the_ground_stays_one() -> None:
    scene = rope(3, {}, {"law": {"damping": 0.1}})
    found = merge_welds(scene)
    assert found is not None
    (chain,) = found.scene.chain
    assert (chain.inboard, chain.position) == ("ground", (0.0, 1.0, 0.0))
    assert np.abs(places(scene, NAMES[:2]) - places(found.scene, NAMES[:2])).max() < 1e-12


def checked_advice(scene: mstmm.Scene, error: float) -> mstmm.Advice:
    made = mstmm.advise(scene, 0.5, error=error, of=OF, rounds=0, budget=600)
    truth = tip(scene, 0.5, OF, method="rodas5p", rtol=1e-9, atol=1e-11)
    read = mstmm.Scene.from_data(tomllib.loads(made.scene.to_toml()))
    ours = tip(read, 0.5, made.reduced_name(OF), **made.options)
    assert np.linalg.norm(ours - truth, axis=1).max() <= error
    return made


def test_stiff_members_become_rigid_and_one() -> None:
    """Stiff pins but for the first of every two: three rods of two."""
    made = checked_advice(rope(6, {}, {"law": {"stiffness": 1e6, "damping": 1e2}}), 1e-2)
    assert [body.name for body in made.scene.body] == ["rope_0", "rope_2", "rope_4"]
    assert made.reduced_name("rope[last].tip") == "rope_4.rope_5_tip"
    assert 'hinge "rope[3].hinge": rigid' in " ".join(made.other_changes)
    assert 'chain "rope": expanded into bodies rope_0 to rope_5' in " ".join(made.other_changes)


def test_dampers_of_a_chain_that_hardly_matter_go_together() -> None:
    made = checked_advice(rope(3, {"law": {"damping": 1e-9}}), 1e-3)
    (chain,) = made.scene.chain
    assert chain.hinge[0].law.damping == (0.0,)
    assert 'chain "rope": without its damper' in " ".join(made.other_changes)


def test_dampers_of_some_members() -> None:
    made = checked_advice(rope(4, {"law": {"damping": 1e-9}}, {"law": {"damping": 1.0}}), 1e-3)
    assert made.scene.chain == ()
    kept = {hinge.name: hinge.law.damping for hinge in made.scene.hinge}
    assert kept == {
        "rope_0_hinge": (0.0,), "rope_1_hinge": (1.0,), "rope_2_hinge": (0.0,),
        "rope_3_hinge": (1.0,),
    }  # fmt: skip


def test_long_chains_stay_chains(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(chain_expansion, "MAX_MEMBERS", 2)
    made = checked_advice(rope(3, {"law": {"damping": 1e-9}}), 1e-3)
    assert made.scene.chain[0].hinge[0].law.damping == (0.0,)
    stiff = checked_advice(rope(3, {}, {"law": {"stiffness": 1e6, "damping": 1e2}}), 1e-2)
    assert stiff.scene.chain[0].count == 3
