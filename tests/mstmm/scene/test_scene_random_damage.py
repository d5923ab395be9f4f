"""Random damage to scenes: a Scene or a SceneError of printable lines, never anything else."""

from __future__ import annotations

import copy
import json
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import hypothesis.strategies as st
import pytest
from hypothesis import HealthCheck, given, settings

from mstmm.errors import SceneError
from mstmm.scene import Scene, load_scene
from tests.fuzz.mutate import places
from tests.mstmm.scene.tables.test_elastic import arrays, link_scene
from tests.reference.random_scenes import random_scene
from tests.support.scenes.minimal import arm, beam, blade_scene, hinge

KEYS = (
    "name type mass inertia ends tip axis axis2 lead normal initial q u law drive release "
    "effort friction limits lower upper stiffness parameters position orientation inboard "
    "outboard on when do hinge body from to gravity beam elastic modes frame section shapes "
    "damping eta mass_per_length force_per_length span nodes plane box arrays \x00 é"
).split(" ")
LEAVES = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.just(10**400),
    st.floats(),
    st.text(max_size=8),
    st.sampled_from(
        "free ground rod1 rod1.tip t sin(t) q[0] rod1.x<1 nan ball universal planar gimbal screw "
        "blade blade.tip tail x^2 static auto tangent@tip fixed t^2 shoulder.q release stop".split()
    ),
)
VALUES = st.recursive(
    LEAVES,
    lambda inner: st.one_of(
        st.lists(inner, max_size=7), st.dictionaries(st.sampled_from(KEYS), inner, max_size=4)
    ),
    max_leaves=12,
)


def damage_data(data: dict[str, Any], draw: st.DataObject) -> dict[str, Any]:
    """Replace, remove or add a few values."""
    data = copy.deepcopy(data)
    for _ in range(draw.draw(st.integers(1, 3))):
        place = draw.draw(st.sampled_from(places(data)))
        inside: Any = data
        for part in place[:-1]:
            inside = inside[part]
        action = draw.draw(st.sampled_from(["replace", "remove", "add"]))
        if action == "remove":
            del inside[place[-1]]
        elif action == "add" and isinstance(inside, dict):
            inside[draw.draw(st.sampled_from(KEYS))] = draw.draw(VALUES)
        else:
            inside[place[-1]] = draw.draw(VALUES)
        if not places(data):
            break
    return data


def check(make: Any) -> None:
    try:
        scene = make()
    except SceneError as error:
        lines = str(error).split("\n")
        assert 1 <= len(lines) <= 11
        assert all(line.isprintable() and len(line) < 1500 for line in lines)
        return
    assert all(line.isprintable() for line in scene.warnings)
    assert Scene(**tomllib.loads(scene.to_toml())) == scene
    assert Scene(**scene.model_dump()) == scene


def check_damaged(scene: Callable[[], dict[str, Any]], count: int) -> None:
    """Damage a scene `count` times in other ways."""

    @settings(max_examples=count, deadline=None, suppress_health_check=SLOW)
    @given(st.data())
    def check_one(draw: st.DataObject) -> None:
        data = damage_data(scene(), draw)
        check(lambda: Scene(**data))

    check_one()


SLOW = (HealthCheck.too_slow, HealthCheck.data_too_large, HealthCheck.function_scoped_fixture)


@pytest.mark.drawn
@pytest.mark.parametrize("count", [150, pytest.param(400, marks=pytest.mark.soak)])
def test_damaged_scenes(count: int) -> None:
    check_damaged(arm, count)


def flexible() -> dict[str, Any]:
    """Two beams and an elastic body, with most of their keys."""
    piece = {"mass_per_length": 1.0, "bending_stiffness": [1.0, 2.0], "rotary_inertia": 1e-3}
    pieces = [piece | {"from": 0, "to": 4}, piece | {"from": 4, "to": 10}]
    divided = beam(mass_per_length=..., bending_stiffness=..., section=pieces, damping=[0.1] * 6,
                   frame="tangent@mid", ends={"mid": 5.0}, initial={"eta": [0.1] * 6})  # fmt: skip
    shaped = beam("flap", shapes={"y": ["(x/L)^2"]}, modes=..., rotary_inertia=1e-3)
    link = link_scene(arrays(), name="tail", frame="tangent")["elastic"][0]
    return blade_scene() | {
        "beam": [divided, shaped], "elastic": [link],
        "hinge": [
            hinge("hub", outboard="blade"),
            hinge("wrist", type="ball", inboard="blade.tip", outboard="flap"),
            hinge("end", type="fixed", inboard="blade.mid", outboard="tail.root"),
        ],
        "load": [{"on": "blade", "force_per_length": [0, "t", 1], "span": [1, 2]}],
        "event": [{"when": "blade.q[1] > flap.tip.x", "do": "stop"}],
    }  # fmt: skip


def test_the_flexible_scene_is_one() -> None:
    assert Scene(**flexible()).warnings == ()


@pytest.mark.drawn
@pytest.mark.parametrize("count", [100, pytest.param(300, marks=pytest.mark.soak)])
def test_damaged_flexible_scenes(count: int) -> None:
    check_damaged(flexible, count)


@settings(max_examples=60, deadline=None, suppress_health_check=SLOW)
@given(st.integers(0, 2**32 - 1), st.data())
def test_damaged_random_scenes(seed: int, draw: st.DataObject) -> None:
    data = damage_data(random_scene(seed, most=4, laws=False), draw)
    check(lambda: Scene(**data))


@settings(max_examples=200, deadline=None, suppress_health_check=SLOW)
@given(st.dictionaries(st.sampled_from(KEYS), VALUES, max_size=5))
def test_arbitrary_tables(data: dict[str, Any]) -> None:
    check(lambda: Scene(**data))


@settings(max_examples=150, deadline=None, suppress_health_check=SLOW)
@given(st.data())
def test_damaged_files(tmp_path: Path, draw: st.DataObject) -> None:
    """Bytes of a good file with some of them changed."""
    suffix = draw.draw(st.sampled_from([".toml", ".json"]))
    good = Scene(**arm()).to_toml() if suffix == ".toml" else json.dumps(arm())
    content = bytearray(good.encode())
    for _ in range(draw.draw(st.integers(1, 4))):
        at = draw.draw(st.integers(0, len(content) - 1))
        content[at : at + draw.draw(st.integers(0, 3))] = draw.draw(st.binary(max_size=3))
    path = tmp_path / f"damaged{suffix}"
    path.write_bytes(content)
    check(lambda: load_scene(path))
