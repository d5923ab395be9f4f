"""Beams in parts: the same body, the same ends, the same loads."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

import mstmm
from mstmm.runtime.experiments.model_levels import with_model_level
from mstmm.runtime.experiments.model_reduction.beam_splitting import (
    make_splittable,
    split_beams,
    split_obstacle,
)
from mstmm.runtime.experiments.model_reduction.scene_edits import rename_reference
from mstmm.scene.tables.beam import Beam


def scene(held: str, gravity: float = -9.81) -> mstmm.Scene:
    """A beam of two sections with an inner end, loads along it, a spring and a body on its ends."""
    other = "root" if held == "tip" else "tip"
    return mstmm.Scene(
        gravity=[0, gravity, 0],
        beam=[{
            "name": "beam", "length": 1.2, "modes": {"y": 3, "z": 1}, "ends": {"mid": 0.5},
            "section": [
                {"from": 0.0, "to": 0.7, "mass_per_length": 1.0, "bending_stiffness": 300.0},
                {"from": 0.7, "to": 1.2, "mass_per_length": 2.0, "bending_stiffness": 500.0},
            ],
        }],
        body=[{"name": "bob", "mass": 0.3, "inertia": [0.01, 0.01, 0.01]}],
        hinge=[
            {"name": "pin", "type": "pin", "inboard": "ground", "outboard": f"beam.{held}"},
            {"name": "grip", "type": "fixed", "inboard": f"beam.{other}", "outboard": "bob"},
        ],
        load=[
            {"on": "beam", "force_per_length": [0, "2*sin(5*t)", 0], "span": [0.2, 1.0]},
            {"on": "beam.mid", "force": [1, 2, 0], "axes": "body"},
        ],
        spring=[{"from": "ground", "to": f"beam.{other}", "law": {"stiffness": 5.0}}],
    )  # fmt: skip


def place(one: mstmm.Scene, name: str) -> NDArray[np.float64]:
    model = mstmm.compile(one, engine="looped")
    times = np.linspace(0, 0.6, 7)
    return model.simulate(0.6, rtol=1e-9, atol=1e-11, output_times=times).position(name)


@pytest.mark.parametrize("count", [2, 3])
@pytest.mark.parametrize("held", ["root", "mid", "tip"])
def test_the_same_body(held: str, count: int) -> None:
    """Rigid, the parts move as the whole does: masses, ends, loads and springs are where they
    were."""
    whole = scene(held)
    found = split_beams(whole, ["beam"], count)
    assert len(found.scene.beam) == count
    for name in ("beam.root", "beam.mid", "beam.tip", "bob"):
        one = place(with_model_level(whole, "rigid"), name)
        other = place(with_model_level(found.scene, "rigid"), rename_reference(name, found.names))
        assert np.abs(one - other).max() < 1e-8


def test_the_same_bending() -> None:
    """Held still, it bends as the whole does: deflections of 1 cm to some per cent."""
    whole = scene("root").model_dump(by_alias=True, exclude_none=True)
    pin = whole["hinge"][0] | {"drive": "0"}
    pin.pop("initial")
    pin.pop("law")
    still = mstmm.Scene(**whole | {"hinge": [pin, whole["hinge"][1]]})
    found = split_beams(still, ["beam"], 3)
    one, other = (
        place(still, "beam.tip"),
        place(found.scene, rename_reference("beam.tip", found.names)),
    )
    bent = np.abs(one[:, 1]).max()
    assert bent > 5e-3
    assert np.abs(one - other).max() < 0.05 * bent


def test_what_speaks_of_an_end_speaks_of_that_of_a_part() -> None:
    data = scene("root").model_dump(by_alias=True, exclude_none=True)
    event = {"name": "low", "when": "beam.tip.y + 2*bob.y < -1.5", "do": "stop"}
    output = {"name": "high", "of": "beam.mid.y - beam.root.y"}
    found = split_beams(mstmm.Scene(**data | {"event": [event], "output": [output]}), ["beam"], 3)
    assert found.scene.event[0].when.text == "beam_3.tip.y + 2*bob.y < -1.5"
    assert found.scene.output[0].of.text == "beam_2.mid.y - beam.root.y"


def test_what_cannot_be_split() -> None:
    keys = scene("root").beam[0].model_dump(by_alias=True, exclude_none=True)
    assert split_obstacle(Beam.model_validate(keys)) == ""
    assert "initial state" in split_obstacle(
        Beam.model_validate(keys | {"initial": {"eta": [0.0] * 4}})
    )
    assert "left open" in split_obstacle(Beam.model_validate(keys | {"modes": "auto"}))


def test_shapes_and_damping_of_the_whole_are_left() -> None:
    keys = scene("root").beam[0].model_dump(by_alias=True, exclude_none=True)
    plain = Beam.model_validate(keys)
    assert make_splittable(plain, 20.0) == (plain, "")
    given = keys | {"damping": 0.03, "shapes": {"y": ["x^2", "x^3"]}, "modes": {"y": 2}}
    made, words = make_splittable(Beam.model_validate(given | {"basis": "auto"}), 20.0)
    assert made.damping.ratio == (0.0,)
    assert made.damping.stiffness == pytest.approx(0.003)
    assert (made.basis, made.shapes) == ("auto", None)
    assert "stiffness-proportional damping (0.003 s)" in words
    assert "given ones" in words
