"""Hinges that close loops: which are cut, what is asked of them, and what is refused."""

from __future__ import annotations

from typing import Any

import pytest

from mstmm.errors import SceneError
from mstmm.scene import Scene, load_scene
from mstmm.scene.checks import topology
from mstmm.scene.checks.connectivity import row_count_if_cut
from mstmm.scene.checks.topology import Topology
from tests.support.scenes.minimal import Data, arm, beam, body, hinge


def rope(**changes: Any) -> Data:
    """Five links on pins at the tip of the arm's second rod."""
    link = {key: value for key, value in body().items() if key != "name"}
    return {"name": "rope", "count": 5, "inboard": "rod2.tip", "body": link,
            "hinge": {"type": "pin"}} | changes  # fmt: skip


def four_bar(**changes: Any) -> Data:
    """Crank, coupler and rocker; `changes` are keys of hinges by the hinge's name."""
    joints = {"crank": ("ground", "a"), "knee": ("a.tip", "b"), "tip": ("b.tip", "c.tip"),
              "rocker": ("ground", "c")}  # fmt: skip
    return {
        "gravity": [0, -9.81, 0],
        "body": [body(name) for name in "abc"],
        "hinge": [
            hinge(name, inboard=inboard, outboard=outboard) | changes.get(name, {})
            for name, (inboard, outboard) in joints.items()
        ],
    }


def tree_of(data: Data) -> tuple[Scene, Topology]:
    scene = Scene(**data)
    return scene, topology.build_topology(scene)


def cut_of(data: Data) -> list[str]:
    scene, tree = tree_of(data)
    return [scene.hinges.name(hinge) for hinge in tree.cut_hinges]


def test_a_hinge_that_holds_a_held_body_closes_the_loop() -> None:
    scene, tree = tree_of(four_bar())
    assert tree.plan is not None
    assert len(tree.links) == 3 and len(tree.cut_hinges) == 1
    assert scene.hinge[tree.cut_hinges[0]].outboard_body == "c"
    assert {link.hinge for link in tree.links} | set(tree.cut_hinges) == {0, 1, 2, 3}
    assert (tree.plan.rows, tree.plan.front) == (5, 5)


@pytest.mark.parametrize(("cut", "other"), [("tip", "rocker"), ("rocker", "tip")])
def test_the_scene_may_say_which_hinge_is_cut(cut: str, other: str) -> None:
    assert cut_of(four_bar(**{cut: {"cut": True}})) == [cut]
    assert cut_of(four_bar(**{other: {"cut": False}})) == [cut]


def test_the_hinge_with_the_fewest_rows_is_cut() -> None:
    for ball, pin in (("tip", "rocker"), ("rocker", "tip")):
        assert cut_of(four_bar(**{ball: {"type": "ball"}, pin: {}})) == [ball]


def test_drives_and_rotor_inertia_are_rows_of_a_cut_hinge() -> None:
    rows = {
        "free": ({}, 5), "driven": ({"drive": "sin(t)"}, 6), "rotor": ({"law": {"inertia": 1}}, 6),
        "both": ({"drive": "sin(t)", "law": {"inertia": 1}}, 6),
        "ball": ({"type": "ball"}, 3), "weld": ({"type": "fixed"}, 6),
        "slider": ({"type": "cylindrical", "drive": ["free", "t"]}, 5),
    }  # fmt: skip
    for changes, expected in rows.values():
        assert row_count_if_cut(Scene(**four_bar(tip=changes)).hinge[2]) == expected


def test_members_of_a_chain_may_carry_what_closes_a_loop() -> None:
    data = arm(
        chain=[rope()],
        body=[body(), body("rod2"), body("seat")],
        hinge=[hinge(), hinge("elbow", inboard="rod1.tip", outboard="rod2"),
               hinge("hook", inboard="rope[3].tip", outboard="seat"),
               hinge("foot", inboard="ground", outboard="seat", type="ball")],
    )  # fmt: skip
    scene, tree = tree_of(data)
    assert tree.plan is not None
    assert [scene.hinges.name(hinge) for hinge in tree.cut_hinges] == ["foot"]
    passed = {scene.bodies.name(k) for k, groups in enumerate(tree.plan.pending) if groups}
    assert passed == {"rod1", "rod2", "seat", *(f"rope[{k}]" for k in range(4))}
    assert sorted(tree.order) == list(range(len(scene.bodies)))


def wire(**changes: Any) -> Data:
    """The arm's tip on a curve that is fixed to the ground."""
    row = {"type": "point-on-curve", "from": "ground", "to": "rod2.tip", "curve": ["s", "s", 0]}
    return arm(constraint=[row | changes])


def beam_scene(*hinges: Data, **changes: Any) -> Data:
    """A beam on a hinge to the ground at its root, with further hinges."""
    return {"gravity": [0, 0, 0], "beam": [beam("boom", **changes)],
            "hinge": [hinge("root", outboard="boom.root"), *hinges]}  # fmt: skip


def test_the_frame_of_a_beam_in_a_loop_is_judged_by_the_hinge_of_the_tree() -> None:
    grip = {"type": "fixed", "outboard": "boom.tip"}
    for cut, warned in ((False, True), (True, False)):
        data = beam_scene(hinge("grip", cut=not cut, **grip), frame="tangent")
        data["hinge"][0]["cut"] = cut
        kept = [risk for risk in Scene(**data).risks if risk.name == "frame"]
        assert bool(kept) == warned


def test_a_beam_may_spin_only_if_all_that_hold_it_let_it() -> None:
    spin = {"axis": [1, 0, 0]}
    data = beam_scene(hinge("grip", outboard="boom.tip", type="ball"))
    data["hinge"][0] |= spin
    with pytest.raises(SceneError, match='hinge "root" allows the beam to spin about its axis'):
        Scene(**data)
    data["hinge"][1]["type"] = "fixed"
    assert Scene(**data).beam[0].polar_inertia_per_length is None


def test_what_else_closes_is_counted_behind_the_hinges() -> None:
    data = four_bar(knee={"type": "universal", "axis2": [0, 1, 0]})
    data["constraint"] = [{"type": "distance", "from": "a.tip", "to": "ground", "length": 2}]
    data["coupling"] = [{"expression": "crank.q - 2*rocker.q"}]
    tree = tree_of(data)[1]
    assert tree.plan is not None
    groups = [(rows.count, sorted(set(rows.ends))) for rows in tree.plan.groups]
    assert groups[1:] == [(1, [-1, 0]), (1, [-1, 0, 2])]
    assert tree.plan.cut_of == tree.cut_hinges


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (arm(hinge=[hinge(cut=True), hinge("elbow", inboard="rod1.tip", outboard="rod2")]),
         'hinge "shoulder": cut: cannot be cut: it is the only inboard hinge of "rod1"'),
        (four_bar(tip={"cut": True}, rocker={"cut": True}),
         'hinge "tip": cut: with these cut keys no tree of hinges reaches "c"; leave cut out '
         'of "tip" or "rocker"'),
        (four_bar(tip={"cut": False}, rocker={"cut": False}),
         'hinge "rocker": cut: "c" already has the inboard hinge "tip" with cut = false; leave'),
        (four_bar(tip={"cut": 1}), 'hinge "tip": cut: expected true or false, found 1'),
        (four_bar(tip={"hold": "yes"}), 'hinge "tip": hold: expected true or false'),
        (four_bar(tip={"type": "fixed", "hold": True}),
         'hinge "tip": hold: a fixed hinge has no coordinates; leave it out'),
        (four_bar(crank={"drive": "t", "hold": True}),
         'hinge "crank": hold: the drive gives the initial values; leave it out'),
        (arm(chain=[rope(hinge={"type": "pin", "cut": True})]),
         "hinge[0].cut: hinges of a chain are never cut"),
        (four_bar(tip={"inboard": "c.tip", "outboard": "b.tip"},
                  knee={"inboard": "b", "outboard": "a.tip"},
                  rocker={"inboard": "b", "outboard": "c"}),
         'body "b": it has no inboard hinge; swap inboard and outboard of hinge "knee"'),
        (arm(constraint=[{"type": "rope", "from": "rod1", "to": "rod2"}]),
         'constraint number 1: type: expected "distance" or "point-on-plane" or "point-on-curve" '
         'or "rolling", found'),
        (arm(constraint=[{"type": "distance", "from": "rod1", "to": "rod3.tip", "length": 1}]),
         'constraint number 1: to: there is no body "rod3"; did you mean "rod'),
        (arm(constraint=[{"type": "distance", "from": "rod1", "to": "rod1.tip", "length": 1}]),
         'to: both ends are on "rod1"; connect two bodies'),
        (arm(constraint=[{"type": "distance", "from": "rod1", "to": "rod2.tip"}]),
         "length: missing; expected a number in m, more than 0"),
        (arm(constraint=[{"type": "distance", "from": "rod1", "to": "rod2.tip", "length": 0}]),
         "length: expected a number in m, more than 0, found 0"),
        (arm(constraint=[{"type": "distance", "from": "rod1", "to": "ground", "normal": [0, 0, 1],
                          "length": 1}]), 'normal: a "distance" has no normal; leave it out'),
        (arm(constraint=[{"type": "point-on-plane", "from": "ground", "to": "rod2.tip"}]),
         "normal: missing; expected three numbers, the normal in the axes of the end"),
        (arm(constraint=[{"type": "point-on-plane", "from": "ground", "to": "rod2.tip",
                          "normal": [0, 1, 0], "length": 2}]),
         'length: a "point-on-plane" has no length; leave it out'),
        (arm(constraint=[{"type": "distance", "from": "rod1", "to": "rod2.tip", "length": 1,
                          "position": [1, 0, 0]}]), "position: only a constraint on the ground"),
        (arm(constraint=[{"type": "distance", "from": "rod1", "to": "rod2.tip", "length": 1},
                         {"type": "distance", "from": "rod2.tip", "to": "rod1", "length": 2}]),
         "constraint number 2: repeats constraint number 1; leave one out"),
        (wire(curve=["s", "s"]), "curve: expected three expressions of s"),
        (wire(curve=["s", "t", 0]), "curve[1]: expected a function of s only, found 't'"),
        (wire(curve=["s", "abs(s)", 0]), "curve[1]: no derivative where 'abs(s)' switches"),
        (wire(curve=["s", "sqrt(s)", 0]), "its first two derivatives is not finite at s = 0"),
        (wire(curve=["s^2", "cos(s)", 1]), "curve: all derivatives are 0 at s = 0; set start"),
        (wire(name="work"), '"work" is reserved for a quantity of results; choose another name'),
        (wire(radius=1), 'radius: a "point-on-curve" has no radius; leave it out'),
        (arm(constraint=[{"type": "rolling", "from": "ground", "to": "rod2", "normal": [0, 1, 0]}]),
         "radius: missing; expected a number in m, more than 0"),
        (arm(constraint=[{"type": "rolling", "from": "rod2", "to": "ground", "normal": [0, 1, 0],
                          "radius": 1}]), "to: expected a body, found the ground; swap from and"),
    ],
)  # fmt: skip
def test_refused_with_element_key_and_way_out(data: Data, message: str) -> None:
    with pytest.raises(SceneError) as caught:
        Scene(**data)
    assert message in str(caught.value)


def test_the_same_plane_for_two_points_is_no_repetition() -> None:
    plane = {"type": "point-on-plane", "from": "ground", "normal": [0, 1, 0]}
    scene = Scene(**arm(constraint=[plane | {"to": "rod1.tip"}, plane | {"to": "rod2.tip"}]))
    assert [one.name for one in scene.constraint] == ["constraint1", "constraint2"]
    assert scene.constraint[0].unit_normal == (0, 1, 0)


def test_a_scene_with_loops_comes_back_from_its_file(tmp_path: Any) -> None:
    data = four_bar(tip={"cut": True}, crank={"hold": True, "initial": {"q": [0.3]}})
    data["beam"] = [beam("boom", frame="tangent")]
    data["hinge"].append(hinge("root", type="fixed", inboard="a.tip", outboard="boom"))
    data["constraint"] = [
        {"type": "distance", "from": "a.tip", "to": "boom", "length": 2.5},
        {"type": "point-on-plane", "from": "ground", "to": "c.tip", "normal": [0, 0, 2],
         "offset": 0.5, "position": [1, 0, 0]},
        {"type": "point-on-curve", "from": "ground", "to": "b.tip", "start": 0.5,
         "curve": ["cos(s)", "sin(s)", 0]},
        {"type": "rolling", "from": "ground", "to": "a.tip", "normal": [0, 1, 0], "radius": 0.2,
         "axis": [0, 0, 1]},
    ]  # fmt: skip
    data["coupling"] = [
        {"name": "gear", "expression": "crank.angle - 3*rocker.q", "equals": "0.1*sin(t)"},
        {"speeds": "crank.u*0.3 - knee.u"},
    ]
    scene = Scene(**data)
    assert scene.constraint[0].to == "boom.root"
    path = tmp_path / "machine.toml"
    path.write_text(scene.to_toml())
    assert load_scene(path) == scene
    assert [coupling.name for coupling in scene.coupling] == ["gear", "coupling2"]
