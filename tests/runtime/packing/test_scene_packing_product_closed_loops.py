"""Loops closed in the plain product, both ends of the cut hinge as boundaries of the chain."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import mstmm
from tests.reference.compare import worst
from tests.support.scenes.linkages import OBLIQUE, four_bar, rod

Scene = dict[str, Any]

LAWS: dict[str, Scene] = {
    "foot": {"stiffness": 3.0, "effort": "0.5*cos(3*t)"}, "knee": {"damping": 0.2},
    "tip": {"stiffness": 2.0, "rest": 0.3},
    "end": {"stiffness": 1.0, "damping": 0.1, "effort": "0.2*u"},
}  # fmt: skip


def rope(kind: str, count: int) -> Scene:
    """Rods in a zigzag between two points of the ground, all hinges of one type."""
    hinges: list[Scene] = []
    for k in range(count):
        angle = 0.6 if k == 0 else 1.2 * (-1) ** k
        pin = {"q": angle, "u": float(k == 0)}
        ball = {"q": [np.cos(angle / 2), 0.0, 0.0, np.sin(angle / 2)]}
        ball |= {"u": [0.2, -0.3, 0.5]} if k == 0 else {}
        hinges.append({"name": f"h{k}", "type": kind, "outboard": f"rod{k}",
                       "inboard": f"rod{k - 1}.tip" if k else "ground",
                       "initial": pin if kind == "pin" else ball})  # fmt: skip
    place = [count * np.cos(0.6), 0.5 * (count % 2), 0.0]
    hinges.append({"name": "last", "type": kind, "inboard": "ground", "position": place,
                   "outboard": f"rod{count - 1}.tip", "cut": True})  # fmt: skip
    return {"gravity": [0, -9.81, 0], "hinge": hinges,
            "body": [rod(f"rod{k}", 1.0) for k in range(count)]}  # fmt: skip


def on_an_arm() -> Scene:
    """The loop of a four-bar on a swinging arm, not on the ground."""
    scene, feet = four_bar(cut="end"), {}
    for hinge in scene["hinge"]:
        if hinge["inboard"] == "ground":
            foot = np.array(hinge.pop("position", [0.0, 0.0, 0.0]))
            feet[f"at_{hinge['name']}"] = (foot + np.array([0.7, 0.1, 0.0])).tolist()
            hinge["inboard"] = f"arm.at_{hinge['name']}"
    swing = {"name": "swing", "type": "pin", "inboard": "ground", "outboard": "arm",
             "initial": {"q": -0.4, "u": 1.5}}  # fmt: skip
    bodies = [rod("arm", 0.8) | {"ends": feet}, *scene["body"]]
    return scene | {"body": bodies, "hinge": [swing, *scene["hinge"]]}


def product_and_default_models(scene: Scene, accuracy: float) -> tuple[mstmm.Model, mstmm.Model]:
    made = mstmm.Scene(**scene)
    return mstmm.compile(made, sweep="product", accuracy=accuracy), mstmm.compile(made)


SCENES: dict[str, Callable[[], Scene]] = {
    "four_bar": lambda: four_bar(speed=1.0, cut="end", laws=LAWS),
    "oblique": lambda: four_bar(speed=1.0, cut="end", laws=LAWS, tilt=OBLIQUE),
    "on_an_arm": on_an_arm,
    "balls": lambda: rope("ball", 3),
}


@pytest.mark.parametrize("name", SCENES)
def test_accelerations_are_those_of_the_sweep(name: str) -> None:
    product, sweep = product_and_default_models(SCENES[name](), 1e-10)
    q, u = sweep.initial_state()
    efforts = np.random.default_rng(4).uniform(-1, 1, sweep.nu)
    for given in (None, efforts):
        found = product.accelerations(q, u, 0.3, given)
        assert worst(found, sweep.accelerations(q, u, 0.3, given)) < 1e-12
    assert product.loops.redundant_rows == sweep.loops.redundant_rows


def test_motions_agree() -> None:
    product, sweep = product_and_default_models(four_bar(speed=1.0, cut="end", laws=LAWS), 1e-10)
    options: dict[str, Any] = {"rtol": 1e-9, "output_times": [0.0, 0.5, 1.0]}
    found, wanted = product.simulate(1.0, **options), sweep.simulate(1.0, **options)
    assert found.success, found.message
    assert np.abs(found.q - wanted.q).max() < 1e-11
    assert np.abs(found.force("end") - wanted.force("end")).max() < 1e-9


def test_digits_go_along_a_closed_chain_as_along_an_open_one() -> None:
    """Ten times as wrong with every rod or two, until the accuracy asked for is lost by name."""
    errors = []
    for count in (4, 8, 12):
        product, sweep = product_and_default_models(rope("pin", count), 1.0)
        q, u = sweep.initial_state()
        errors.append(worst(product.accelerations(q, u), sweep.accelerations(q, u)))
    assert errors[0] < 1e-11
    assert errors[2] > 1e3 * errors[0]
    scene = rope("pin", 12)
    with pytest.raises(mstmm.NumericalFailure, match=r"deviation.*accuracy.*riccati"):
        mstmm.compile(mstmm.Scene(**scene), sweep="product", accuracy=1e-14).accelerations(q, u)


def test_a_mechanism_at_rest() -> None:
    """Where nothing accelerates, what deviates is rounding of what the open chain would do; the
    natural motion is that by the sweep."""
    scene = mstmm.Scene(**four_bar(cut="end", laws={"tip": {"damping": 0.05}}))
    model = mstmm.compile(scene, sweep="product")
    rest = np.asarray(model.equilibrium())
    assert np.abs(model.accelerations(rest, np.zeros(4))).max() < 1e-11
    found, wanted = (one.modes().omega for one in (model, mstmm.compile(scene)))
    assert worst(found, wanted) < 1e-9


def test_what_is_refused() -> None:
    branches = four_bar(cut="tip")
    with pytest.raises(mstmm.SceneError, match=r"unbranched chain, the hinges .* cut .*riccati"):
        mstmm.compile(mstmm.Scene(**branches), sweep="product")
    rotor = four_bar(cut="end", laws={"end": {"inertia": 0.1}})
    with pytest.raises(mstmm.SceneError, match=r'hinge "end": drives and rotor inertia.*riccati'):
        mstmm.compile(mstmm.Scene(**rotor), sweep="product")
    geared = four_bar(cut="tip") | {
        "coupling": [{"name": "mesh", "expression": "foot.q - 2*end.q"}]
    }
    del geared["hinge"][2]
    with pytest.raises(mstmm.SceneError, match=r'found coupling "mesh"; use .*riccati'):
        mstmm.compile(mstmm.Scene(**geared), sweep="product")
