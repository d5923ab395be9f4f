"""[[chain]]: what is read, how members are called, what is refused, and their place in the tree."""

from __future__ import annotations

import json
from typing import Any

import pytest

from mstmm.errors import SceneError
from mstmm.scene import Scene
from mstmm.scene.checks import topology
from tests.support.scenes.minimal import Data, arm, body, hinge, is_chain

LINK = {key: value for key, value in body().items() if key != "name"}
TWO_ENDS = LINK | {"ends": {"tip": [1, 0, 0], "side": [0, 1, 0]}}
PIN: Data = {"type": "pin", "axis": [0, 1, 0]}


def chain(name: str = "rope", **changes: Any) -> Data:
    return {"name": name, "count": 5, "inboard": "ground", "body": LINK, "hinge": PIN} | changes


def rope(**changes: Any) -> Data:
    return {"gravity": [0, 0, -9.81], "chain": [chain(**changes)]}


def message_of(data: Data) -> str:
    with pytest.raises(SceneError) as caught:
        Scene.from_data(data, "rope.toml")
    assert all(line.startswith("rope.toml: ") for line in str(caught.value).split("\n"))
    return str(caught.value)


def test_members_are_bodies_and_hinges_with_names() -> None:
    ball = {"type": "ball"}
    data = arm(chain=[chain(inboard="rod2.tip", body=[LINK, TWO_ENDS], hinge=[PIN, ball, PIN],
                            end="tip")])  # fmt: skip
    scene = Scene(**data)
    assert len(scene.bodies) == len(scene.hinges) == 7 and len(scene.body) == 2
    assert [b.name for b in scene.bodies] == ["rod1", "rod2", *(f"rope[{k}]" for k in range(5))]
    assert scene.hinges[-1].name == "rope[4].hinge" and scene.hinges[1] is scene.hinge[1]
    assert [scene.hinges[2 + k].type for k in range(5)] == ["pin", "ball", "pin", "pin", "ball"]
    assert [sorted(scene.bodies[2 + k].ends) for k in (0, 1)] == [["tip"], ["side", "tip"]]
    assert scene.hinges[2].inboard == "rod2.tip" and scene.hinges[3].inboard == "rope[0].tip"
    assert scene.hinges[5].outboard == "rope[3]"
    assert scene.bodies.find("rope[last]") == scene.bodies.find("rope[4]") == 6
    assert scene.hinges.find("rope[1].hinge") == 3 and scene.hinges.find("rope[1]") is None
    assert scene.bodies.find("rope[5]") is None and scene.bodies.find("rope") is None
    assert scene.bodies.by_name["rope[2]"].mass == 1.0
    assert "rope[9]" not in scene.bodies.by_name
    assert [b.name for b in scene.bodies[1:3]] == ["rod2", "rope[0]"]
    with pytest.raises(IndexError):
        scene.bodies[7]


def test_a_table_alone_and_a_list_of_one_are_the_same() -> None:
    assert Scene(**rope(body=[LINK], hinge=[PIN])) == Scene(**rope())


def test_round_trip_and_schema() -> None:
    import tomllib

    scene = Scene(**rope(hinge=[PIN, {"type": "planar", "normal": [0, 1, 0]}], position=[0, 1, 2]))
    assert Scene(**tomllib.loads(scene.to_toml())) == scene
    assert Scene(**json.loads(scene.model_dump_json(by_alias=True))) == scene
    schema = Scene.model_json_schema(by_alias=True)["$defs"]
    assert set(schema["Chain"]["required"]) == {"name", "count", "inboard", "body", "hinge"}
    assert "name" not in schema["BodyTable"]["properties"]


def test_only_the_only_end_needs_no_name() -> None:
    assert Scene(**rope(count=1, body={"mass": 1.0})).chain[0].held_ends == ("",)
    assert Scene(**rope(body=TWO_ENDS, end="side")).hinges[3].inboard == "rope[2].side"


def test_a_chain_is_one_run_whatever_its_length() -> None:
    scene = Scene(
        gravity=[0, 0, 0], body=[body("load"), body("base")],
        hinge=[hinge("g", inboard="rope[2].tip", outboard="load"), hinge("h", outboard="base")],
        chain=[chain("rope", count=1000, inboard="base.tip"), chain("side", inboard="rope[7].tip")],
    )  # fmt: skip
    tree = topology.build_topology(scene)
    assert [(run.body, run.count, run.position, run.parent) for run in tree.runs] == [
        (1, 1, 0, -1), (2, 1000, 1, 0), (1002, 5, 1001, 8), (0, 1, 1006, 3),
    ]  # fmt: skip
    links = tree.links
    assert tree.count == len(links) == 1007
    assert all(parent < place for place, parent in enumerate(tree.parents))
    assert links[8].children == (9, 1001) and links[3].children == (4, 1006)
    assert links[500].inboard_end == "tip" and links[500].parent == 499
    for place, link in enumerate(links):
        assert tree.scene_indices(place) == (link.body, link.hinge)
        assert tree.position_of_body(link.body) == tree.position[link.body] == place
        assert tree.position_of_hinge(link.hinge) == place
    assert not is_chain(tree) and is_chain(topology.build_topology(Scene(**rope())))


def test_subtrees_are_contiguous() -> None:
    """Depth first: the descendants of every body stand right behind it."""
    chains = [chain("a"), chain("b", inboard="a[1].tip"), chain("c", inboard="a[3].tip"),
              chain("d", inboard="b[last].tip"), chain("e", inboard="a[1].tip")]  # fmt: skip
    tree = topology.build_topology(Scene(gravity=[0, 0, 0], chain=chains))
    size = [1] * tree.count
    for place in range(tree.count - 1, 0, -1):
        if tree.parents[place] >= 0:
            size[tree.parents[place]] += size[place]
    for place, parent in enumerate(tree.parents):
        assert parent < place < (parent + size[parent] if parent >= 0 else tree.count)


BAD: list[tuple[Data, str]] = [
    (rope(count=0), 'chain "rope": count: expected a whole number from 1 to 10000000, found 0'),
    (rope(count=2.5), "count: expected a whole number from 1 to 10000000, found 2.5"),
    (rope(count=True), "count: expected a whole number from 1 to 10000000, found true"),
    (rope(count="5"), "count: expected a whole number from 1 to 10000000, found '5'"),
    (rope(body=...), "body: missing; expected a body table, or a list of body tables"),
    (rope(body=[]), "body: expected a body table or a list of them, found an empty list"),
    (rope(hinge=3), "hinge: expected a hinge table, or a list of hinge tables that is repeated"),
    (rope(body=LINK | {"mass": -1}), 'chain "rope": body[0].mass: expected a number in kg, 0 or'),
    (rope(body=[LINK, LINK | {"inertia": [1, 1, 9]}]), 'chain "rope": body[1].inertia: the princ'),
    (rope(body=LINK | {"name": "x"}), 'body[0].name: members of a chain are named'),
    (rope(hinge=PIN | {"inboard": "ground"}), "hinge[0].inboard: each member is connected to"),
    (rope(hinge=PIN | {"release": 1.0}), "hinge[0].release: members of a chain cannot be rel"),
    (rope(hinge=PIN | {"initial": {"q": [1, 2]}}), "hinge[0].initial.q: expected 1 entry for a p"),
    (rope(body=LINK | {"massa": 1}), 'body[0].massa: unknown key; did you mean "mass"?'),
    (rope(hinges=[PIN]), 'hinges: unknown key; did you mean "hinge"?'),
    (rope(count=1, hinge=[PIN, PIN]), "hinge: 2 tables for a chain of 1; leave some out or raise"),
    (rope(body=LINK | {"ends": {}}),
     "body[0].ends: expected one end for the next body, found no end; give it one"),
    (rope(body=TWO_ENDS), "expected one end for the next body, found tip, side; write end ="),
    (rope(end="top"), 'body[0].ends: there is no end "top" for the next body; give it ends = {'),
    (rope(body=LINK | {"ends": {"hinge": [1, 0, 0]}}), "is the name of a hinge; rename this end"),
    (rope(inboard="rope[4].tip"), 'chain "rope": no hinge connects it to the ground; set inboard'),
    (rope(inboard="base.tip"), 'chain "rope": inboard: there is no body "base"; use one of'),
    (arm(chain=[chain(inboard="rod1.tip", position=[1, 0, 0])]), "position: only a chain"),
    (arm(chain=[chain("rod1")]), 'chain "rod1": name: "rod1" is also the name of a body; rename'),
    (arm(chain=[chain("elbow")]), '"elbow" is also the name of a hinge; rename one'),
    (arm(chain=[chain(), chain()]), '"rope" is also the name of chain number 1; rename one'),
    (arm(chain=[chain("a", inboard="b[0].tip"), chain("b", inboard="a[0].tip")]),
     'chain "a": no hinge connects it (with b) to the ground; set inboard = "ground"'),
    (rope() | {"load": [{"on": "rope[5].tip", "force": [1, 0, 0]}]},
     'load number 1: on: there is no body "rope[5]"; the chain "rope" has rope[0] to rope[4]'),
    (rope() | {"load": [{"on": "rope.tip", "force": [1, 0, 0]}]},
     'there is no body "rope"; the chain "rope" has rope[0] to rope[4]'),
    (rope() | {"load": [{"on": "rope[last].top", "force": [1, 0, 0]}]},
     'body "rope[last]" has no end "top"; did you mean "tip"?'),
    (rope() | {"load": [{"on": "rope[1]", "axes": "rope[9]"}]}, 'axes: there is no body "rop'),
    (rope() | {"load": [{"on": "rope[1]", "force": ["rope[7].hinge.q", 0, 0]}]},
     "there is no hinge 'rope[7].hinge'; the chain \"rope\" has rope[0].hinge to rope[4].hinge"),
    (rope() | {"load": [{"on": "rope[1]", "force": ["rope[1].q", 0, 0]}]},
     "there is no hinge 'rope[1]'; the chain \"rope\" has rope[0].hinge to rope[4].hinge"),
    (rope(hinge={"type": "ball", "law": {"effort": ["q[7]", 0, 0]}}), "hinge[0].law.effort[0]"),
    (rope() | {"event": [{"when": "t > 1", "do": "release", "hinge": "rope[1].hinge"}]},
     "event number 1: hinge: expected the hinge to release"),
    (arm(chain=[chain()], hinge=[hinge(), hinge("elbow", inboard="rod1.tip", outboard="rope[2]")]),
     'hinge "elbow": outboard: "rope[2]" already has an inboard hinge in its chain'),
]  # fmt: skip


@pytest.mark.parametrize(("data", "fragment"), BAD)
def test_refused_with_chain_key_and_way_out(data: Data, fragment: str) -> None:
    for element in data["chain"]:
        for key in [key for key, value in element.items() if value is ...]:
            del element[key]
    assert fragment in message_of(data)


def test_one_message_for_a_mistake_in_a_million_bodies() -> None:
    assert message_of(rope(count=1_000_000, body=LINK | {"mass": "one"})).count("\n") == 0
