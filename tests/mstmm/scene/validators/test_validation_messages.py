"""Bad scenes: one line a problem, with element, key, what was expected, found, and a way out."""

from __future__ import annotations

from typing import Any

import pytest

from mstmm.errors import SceneError
from mstmm.scene import Scene
from tests.support.scenes.minimal import Data, arm, body, change_value, hinge, one_rod

NAN, INF = float("nan"), float("inf")


def message_of(data: Data) -> str:
    with pytest.raises(SceneError) as caught:
        Scene.from_data(data, "arm.toml")
    lines = str(caught.value).split("\n")
    assert all(line.startswith("arm.toml: ") and line.isprintable() for line in lines)
    assert len(lines) <= 11
    assert caught.value.exit_code == 2
    assert caught.value.__cause__ is None and caught.value.__suppress_context__
    return str(caught.value)


def in_body(**changes: Any) -> Data:
    return arm(body=[body(**changes), body("rod2")])


def in_hinge(**changes: Any) -> Data:
    return arm(hinge=[hinge(**changes), hinge("elbow", inboard="rod1.tip", outboard="rod2")])


BAD: list[tuple[Data, str]] = [
    # the scene itself
    (change_value(arm(), "gravity", to=...), "gravity: missing; expected three numbers in m/s^2"),
    (
        arm(gravity=9.81),
        "gravity: expected three numbers in m/s^2, such as [0, -9.81, 0], found 9.81",
    ),
    (arm(gravity=[0, 0]), "found 2 entries"),
    (
        arm(gravity=[0, NAN, 0]),
        "gravity[1]: expected a number in m/s^2, found nan, which is not finite",
    ),
    (arm(gravity=[0, "-9.81 m/s^2", 0]), "found '-9.81 m/s^2'; an operator is missing here"),
    (arm(gravity=[0, True, 0]), "gravity[1]: expected a number in m/s^2, found true"),
    (arm(gravity=[0, 10**400, 0]), "which is not finite"),
    (arm(schema_version=2), "schema_version: expected 1, the only version, found 2"),
    (arm(schema_version=True), "schema_version: expected 1, the only version, found true"),
    (arm(grvity=[0, 0, 0]), 'grvity: unknown key; did you mean "gravity"?'),
    (arm(bodies=[]), 'bodies: unknown key; did you mean "body"?'),
    (arm(loop=[]), "loop: unknown key; use [[hinge]]: a second inboard hinge of a body closes"),
    (arm(thermal={}), "thermal: thermal data are planned for a later release"),
    (arm(imports=[]), "imports: imports are planned for a later release"),
    (arm(body={"name": "rod1"}), "body: expected a list of tables; write [[body]], found a table"),
    (arm(body=[1]), "body number 1: expected a table, found 1"),
    (arm(hinge="pin"), "hinge: expected a list of tables; write [[hinge]], found 'pin'"),
    (arm(body=[]), "body: a scene needs at least one body"),
    # bodies
    (
        change_value(arm(), "body", 0, "name", to=...),
        "body number 1: name: missing; expected the body's name",
    ),
    (in_body(name="1rod"), "name: expected the body's name: a letter, then letters, digits or _"),
    (in_body(name=""), "found ''"),
    (in_body(name="a b"), "found 'a b'"),
    (in_body(name="rod\n"), "found 'rod\\n'"),
    (in_body(name="r\u00f6d"), "found 'r\\xf6d'"),
    (in_body(name="__import__('os').system('ls')"), "name: expected the body's name"),
    (in_body(name="x" * 65), "64 characters at most"),
    (in_body(name="ground"), '"ground" is reserved'),
    (in_body(name=7), "found 7"),
    (
        change_value(arm(), "body", 0, "mass", to=...),
        'body "rod1": mass: missing; expected a number in kg',
    ),
    (in_body(mass=-1), 'body "rod1": mass: expected a number in kg, 0 or more, found -1'),
    (in_body(mass="-2"), "mass: expected a number in kg, 0 or more, found -2"),
    (in_body(mass="nan"), "mass: expected a number in kg, 0 or more, found 'nan'"),
    (in_body(mass=NAN), "found nan, which is not finite"),
    (in_body(mass=INF), "found inf, which is not finite"),
    (in_body(mass=True), "found true"),
    (in_body(mass=None), "found nothing"),
    (in_body(mass=[1]), "found [1]"),
    (
        in_body(center_of_mass=[0, 0]),
        "center_of_mass: expected three numbers in m, found 2 entries",
    ),
    (in_body(center_of_mass={}), "found a table"),
    (
        in_body(inertia=[1, 1]),
        "inertia: expected [xx, yy, zz] or [xx, yy, zz, xy, xz, yz] in kg m^2",
    ),
    (in_body(inertia=1.0), "inertia: expected [xx, yy, zz]"),
    (in_body(inertia=[1, 1, INF]), "inertia[2]: expected a number in kg m^2, found inf"),
    (in_body(inertia=[1, -1, 1]), "found yy = -1; remove the sign"),
    (
        in_body(inertia=[1, 1, 1, 2, 0, 0]),
        "its principal moments are [-1, 1, 3] kg m^2, one negative",
    ),
    (in_body(inertia=[1, 1, 3]), "[1, 1, 3] kg m^2 violate the triangle inequality"),
    (in_body(inertia=[1, 1, 3]), "allow_unphysical_inertia = true"),
    (in_body(inertia=[2, 2, 1, 1, 0, 0]), "violate the triangle inequality"),
    (in_body(inertia=[1, 1, -1]), "remove the sign, or accept it with allow_unphysical"),
    (in_body(inertia=[1, 1, -1e-11]), "remove the sign"),
    (in_body(allow_unphysical_inertia="yes"), "expected true or false, found 'yes'"),
    (in_body(masss=1.0), 'body "rod1": masss: unknown key; did you mean "mass"?'),
    (in_body(inertias=[1, 1, 1]), 'did you mean "inertia"?'),
    (in_body(ends=[1, 0, 0]), "ends: expected a table such as { tip = [1, 0, 0] }"),
    (in_body(ends={"tip": 1}), "ends.tip: expected a table, found 1"),
    (in_body(ends={"tip": [1, 0]}), "ends.tip.position: expected three numbers in m"),
    (in_body(ends={"tip": {"position": [1, 0, 0], "angle": 2}}), "ends.tip.angle: unknown key"),
    (in_body(ends={"tip": {"orientation": [0, 0, 0]}}), "ends.tip.position: missing"),
    (in_body(ends={"a.b": [1, 0, 0]}), "expected the name of an end, found 'a.b'"),
    (in_body(ends={"tip": {"position": [1, 0, 0], "orientation": [0, 0, 0, 0]}}), "zero length"),
    (in_body(ends={"tip": {"position": [1, 0, 0], "orientation": [0]}}), "found 1 entry"),
    (in_body(parameters={"spin": 3}), "a rigid body has no parameters"),
    (arm(body=[body(), body()]), '"rod1" is also the name of body number 1; rename one'),
    # hinges: what they join
    (arm(hinge=[hinge(), hinge(outboard="rod2")]), '"shoulder" is also the name of hinge number 1'),
    (
        change_value(arm(), "hinge", 0, "type", to=...),
        'hinge "shoulder": type: missing; expected a hinge type: fixed, pin, prismatic, screw',
    ),
    (change_value(arm(), "hinge", 0, "outboard", to=...), 'hinge "shoulder": outboard: missing'),
    (in_hinge(inboard="grnd"), 'there is no body "grnd"'),
    (in_hinge(inboard="ground.tip"), 'expected "ground", which has no ends'),
    (in_hinge(inboard="a.b.c"), "inboard: expected a body or an end of one"),
    (in_hinge(inboard=["ground"]), "inboard: expected a body or an end of one"),
    (in_hinge(outboard="rad1"), 'outboard: there is no body "rad1"; did you mean "rod1"?'),
    (in_hinge(outboard="rod1.tipp"), 'body "rod1" has no end "tipp"; did you mean "tip"?'),
    (in_hinge(outboard="ground"), "the ground cannot be outboard; swap inboard and outboard"),
    (in_hinge(inboard="rod1.tip"), '"rod1" is hinged to itself'),
    (in_hinge(axsi=[0, 0, 1]), 'hinge "shoulder": axsi: unknown key; did you mean "axis"?'),
    (in_hinge(axis=[0, 0, 0]), "axis: expected three numbers, not all zero (a direction)"),
    (in_hinge(axis=[0, 0, NAN]), "axis[2]: expected a number, found nan"),
    (in_hinge(axis="z"), "axis: expected three numbers, not all zero (a direction), found 'z'"),
    (
        in_hinge(orientation=[0, 0, 0, 0]),
        "a quaternion of zero length; use [1, 0, 0, 0] for no rotation",
    ),
    (in_hinge(orientation=[1, 2]), "[roll, pitch, yaw] in rad, a quaternion"),
    (change_value(arm(), "hinge", 1, "position", to=[1, 0, 0]), 'define an end of "rod1" there'),
    # keys of the types
    (one_rod(type="fixed", axis=[1, 0, 0]), "a fixed hinge has no axis"),
    (one_rod(type="gimbal", axis=[1, 0, 0]), "rotate it by orientation"),
    (one_rod(axis2=[1, 0, 0]), "a pin hinge has no axis2"),
    (one_rod(normal=[1, 0, 0]), "a pin hinge has no normal; use axis"),
    (one_rod(lead=0.1), "a pin hinge has no lead"),
    (one_rod(type="screw"), "lead: a screw needs its lead in m per turn"),
    (one_rod(type="screw", lead=0), 'or type = "pin"'),
    (one_rod(type="screw", lead="far"), "lead: expected a number in m per turn"),
    (one_rod(type="universal"), "axis2: a universal hinge needs its second axis"),
    (one_rod(type="universal", axis2=[0, 0, -2]), "is parallel to axis [0, 0, 1]"),
    (one_rod(type="universal", axis=[1, 1, 0], axis2=[1, 1, 1e-9]), "change one of them"),
    (one_rod(type="planar", axis2=[0, 0, 1]), "axis2 [0, 0, 1] is parallel to normal"),
    (one_rod(type="planar", normal=[1, 0, 0], axis=[0, 1, 0]), "differ; give one"),
    (one_rod(parameters={"radius": 1.0}), "a pin hinge has no parameters"),
    # start values
    (
        one_rod(initial={"q": [1, 2]}),
        "initial.q: expected 1 entry for a pin hinge: angle (rad), found 2",
    ),
    (
        one_rod(initial={"u": [1, 2]}),
        "initial.u: expected 1 entry for a pin hinge: angle_rate (rad/s)",
    ),
    (one_rod(initial={"q": ["x"]}), "initial.q[0]: expected a number, found 'x'"),
    (one_rod(initial={"x": [1]}), "initial.x: unknown key"),
    (one_rod(initial=[0.3]), "initial: expected a table, found [0.3]"),
    (one_rod(type="ball", initial={"q": [1, 0, 0]}), "expected 4 entries for a ball hinge"),
    (one_rod(type="ball", initial={"q": [0, 0, 0, 0]}), "a quaternion of zero length"),
    (one_rod(type="free", initial={"q": [0] * 7}), "a quaternion of zero length"),
    (one_rod(type="fixed", initial={"q": [1]}), "expected 0 entries for a fixed hinge"),
    # laws
    (
        one_rod(law={"stiffness": -1}),
        "law.stiffness: expected a number in N/m or N m/rad, 0 or more",
    ),
    (
        one_rod(law={"damping": [-1]}),
        "law.damping[0]: expected a number in N s/m or N m s/rad, 0 or more, found -1",
    ),
    (one_rod(law={"inertia": -1}), "law.inertia: expected"),
    (one_rod(law={"stifness": 1}), 'law.stifness: unknown key; did you mean "stiffness"?'),
    (one_rod(law={"stiffness": [1, 2]}), "law.stiffness: expected 1 entry for a pin hinge"),
    (one_rod(law={"effort": "2*"}), "law.effort: the expression ends where a value is expected"),
    (one_rod(law={"effort": ["1", "2"]}), "law.effort: expected 1 entry"),
    (one_rod(law={"effort": "t < 1"}), "found a comparison; write where(t < 1, 1, 0)"),
    (one_rod(law={"effort": "torque"}), "law.effort[0]: 'torque' is unknown"),
    (
        one_rod(law={"effort": "1 + " * 40 + "torque + 2" + " + 1" * 40}),
        "one of t, q, u, pi (character 161: ...+ 1 + 1 + 1 + 1 + 1 + 1 + 1 +  -->torque + 2",
    ),
    (one_rod(law={"effort": "angle"}), "one of t, q, u, pi"),
    (one_rod(law={"effort": "q[1]"}), 'the last entry of hinge "shoulder" is [0]'),
    (one_rod(law={"effort": "elbow.q"}), "there is no hinge 'elbow'; the only one is shoulder"),
    (
        one_rod(law={"effort": "shoulder.x"}),
        "positions and velocities of bodies are available only in events",
    ),
    (one_rod(law={"effort": "shoulder.angle"}), "a hinge has shoulder.q and shoulder.u"),
    (
        one_rod(law={"effort": "rod1.x"}),
        "positions and velocities of bodies are available only in events",
    ),
    (one_rod(type="universal", axis2=[0, 1, 0], law={"effort": ["q", 0]}), "write q[0] to q[1]"),
    (one_rod(type="fixed", law={"stiffness": 1}), "a fixed hinge has no coordinate for a law"),
    (
        one_rod(type="cylindrical", law={"stiffness": 1}),
        "whose efforts are in N, N*m; give a list with 2",
    ),
    (one_rod(type="free", law={"damping": 1}), "give a list with 6 entries"),
    (
        one_rod(type="ball", law={"rest": [1, 0, 0]}),
        "the rest angle of the rotation of a ball hinge is 0",
    ),
    (
        one_rod(type="ball", law={"limits": {"lower": 0, "stiffness": 1}}),
        "a ball hinge has no limits",
    ),
    (
        one_rod(law={"friction": {"coulomb": -1}}),
        "law.friction[0].coulomb: expected a number in N or N m",
    ),
    (
        one_rod(law={"friction": {"coulomb": 2, "static": 1}}),
        "static friction 1 is below coulomb friction 2",
    ),
    (one_rod(law={"friction": {"coulomb": 2, "stribeck_velocity": 0}}), "more than 0, found 0"),
    (one_rod(law={"friction": {"viscous": 2}}), "law.friction[0].viscous: unknown key"),
    (one_rod(law={"friction": 1}), "law.friction: expected a table, or a list of tables"),
    (
        one_rod(law={"limits": {"lower": 1, "upper": -1, "stiffness": 1}}),
        "lower (1) must be below upper (-1)",
    ),
    (one_rod(law={"limits": {"lower": 1, "upper": 1, "stiffness": 1}}), "must be below upper"),
    (one_rod(law={"limits": {"lower": 1}}), "a stop needs a stiffness above 0"),
    (one_rod(law={"limits": {"stiffness": 1}}), "limits need lower, upper or both"),
    (
        one_rod(law={"limits": {"lower": NAN, "stiffness": 1}}),
        "law.limits[0].lower: expected a number",
    ),
    (one_rod(law=3), "law: expected a table, found 3"),
    # drives and release
    (one_rod(drive="sin(t"), "drive: this parenthesis is not closed"),
    (one_rod(drive="q"), "drive: expected a function of t only, found 'q'; use law.effort"),
    (one_rod(drive="0.1*q + t"), "found 'q' (in '0.1*q + t'); use law.effort"),
    (
        one_rod(drive="+".join(f"sin({k}*t)" for k in range(20)) + "+q"),
        "*t)+ -->q); use law.effort",
    ),
    (one_rod(drive="t + other.q"), "found 'other.q'"),
    (one_rod(drive=["t", "t"]), "drive: expected 1 entry for a pin hinge: angle (rad), found 2"),
    (one_rod(drive="sqrt(t)"), "is not finite at t = 0"),
    (one_rod(drive="t > 1"), "found a comparison"),
    (one_rod(drive="t" + "*1.1e-300" * 400), "contain a constant of thousands of digits"),
    (one_rod(drive="t*1e300*1e300"), "contain a constant above 1.8e308; scale"),
    (one_rod(drive=NAN), "which is not finite"),
    (one_rod(drive={}), "drive: expected a number or an expression"),
    (one_rod(drive="sin(t)", initial={"q": [0]}), "the drive already gives the initial values"),
    (one_rod(drive="sin(t)", initial={"u": [0]}), "the drive already gives the initial values"),
    (
        one_rod(type="ball", drive="t"),
        "a ball hinge cannot be driven; use gimbal or universal hinges",
    ),
    (one_rod(type="free", drive=["t"] * 6), "a free hinge cannot be driven"),
    (one_rod(type="elastic", drive=["t"] * 6), "an elastic hinge cannot be driven"),
    (one_rod(type="fixed", drive="t"), "expected 0 entries for a fixed hinge"),
    (one_rod(type="cylindrical", drive="t"), "displacement (m), angle (rad), found 1"),
    (
        one_rod(type="cylindrical", drive=["free", "1 + t"], initial={"q": [0, 0]}),
        "initial.q[1]: expected 1, the start of the drive, found 0",
    ),
    (
        one_rod(type="cylindrical", drive=["free", "1 + t"], initial={"u": [0, 0]}),
        "initial.u[1]: expected 1, the start of the drive, found 0",
    ),
    (one_rod(release="t >= 1"), "only a driven or fixed hinge can be released"),
    (one_rod(drive="t", release="t"), "release: expected a time in s or a comparison"),
    (one_rod(drive="t", release=NAN), "which is not finite"),
    (one_rod(drive="t", release=True), "release: expected a time in s or a comparison"),
    (one_rod(drive="t", release="rod2.x > 1"), "there is no body 'rod2'; did you mean \"rod1\"?"),
    # loads
    (arm(load=[{"force": [1, 0, 0]}]), "load number 1: on: missing"),
    (arm(load=[{"on": "ground"}]), "which does not move"),
    (arm(load=[{"on": "rod1.top"}]), 'body "rod1" has no end "top"; did you mean "tip"?'),
    (
        arm(load=[{"on": "rod1", "force": [1, 0]}]),
        "force: expected three numbers or expressions in N",
    ),
    (arm(load=[{"on": "rod1", "force": "t"}]), "force: expected three numbers or expressions in N"),
    (arm(load=[{"on": "rod1", "force": [0, 0, "q"]}]), "'q' needs the name of a hinge, as in"),
    (arm(load=[{"on": "rod1", "moment": [0, 0, "1/0"]}]), "moment[2]: division by zero"),
    (
        arm(load=[{"on": "rod1", "axes": "rod3"}]),
        'axes: there is no body "rod3"; did you mean "rod',
    ),
    (arm(load=[{"on": "rod1", "axes": "world"}]), "one of inertial, body, rod1, rod2"),
    (
        arm(load=[{"on": "rod1", "name": "a"}, {"on": "rod1", "name": "a"}]),
        "load number 1; rename one",
    ),
    # events
    (arm(event=[{"when": "t > 1"}]), 'do: missing; expected "stop" or "release"'),
    (arm(event=[{"when": "t > 1", "do": "explode"}]), 'do: expected "stop" or "release"'),
    (arm(event=[{"when": "t", "do": "stop"}]), "found 't', which is no comparison"),
    (
        arm(event=[{"when": 1.0, "do": "stop"}]),
        'when: expected a comparison such as "rod1.x < 0.1"',
    ),
    (arm(event=[{"when": "t > 1", "do": "release"}]), 'do = "release" needs the name of a hinge'),
    (arm(event=[{"when": "t > 1", "do": "stop", "hinge": "elbow"}]), "leave it out"),
    (arm(event=[{"when": "t > 1", "do": "release", "hinge": "elbw"}]), 'did you mean "elbow"?'),
    (arm(event=[{"when": "t > 1", "do": "release", "hinge": "elbow"}]), "neither driven nor fixed"),
    (arm(event=[{"when": "rod1.top.x > 1", "do": "stop"}]), "has no end 'top'"),
    (arm(event=[{"when": "rod1.tip.q > 1", "do": "stop"}]), "a body or end has x, y, z"),
    (arm(event=[{"when": "rod1.x[0] > 1", "do": "stop"}]), "is a scalar; leave out [0]"),
    (arm(event=[{"when": "t[0] > 1", "do": "stop"}]), "is a scalar; leave out [0]"),
    # springs
    (arm(spring=[{"to": "rod1"}]), "spring number 1: from: missing"),
    (arm(spring=[{"from": "rod1", "to": "rod1.tip"}]), 'both ends are on "rod1"'),
    (arm(spring=[{"from": "ground", "to": "ground"}]), 'both ends are on "ground"'),
    (arm(spring=[{"from": "rod1", "to": "rod2.tp"}]), 'has no end "tp"; did you mean "tip"?'),
    (
        arm(spring=[{"from": "rod1", "to": "rod2", "position": [1, 0, 0]}]),
        "only a spring on the ground",
    ),
    (arm(spring=[{"from": "rod1", "to": "rod2", "law": {"stiffness": -1}}]), "0 or more, found -1"),
    (arm(spring=[{"from": "rod1", "to": "rod2", "law": {"rest": -1}}]), "0 or more, found -1"),
    (
        arm(spring=[{"from": "rod1", "to": "rod2", "law": {"effort": "q[1]"}}]),
        "a spring has one length",
    ),
    (
        arm(spring=[{"from": "rod1", "to": "rod2", "parameters": {"k": 1}}]),
        "a spring has no parameters",
    ),
]


@pytest.mark.parametrize(("data", "fragment"), BAD)
def test_refused_with_file_element_key_and_way_out(data: Data, fragment: str) -> None:
    assert fragment in message_of(data)


def test_the_whole_line() -> None:
    line = message_of(in_hinge(axis=[0, 0, 0]))
    assert line == (
        'arm.toml: hinge "shoulder": axis: expected three numbers, not all zero (a direction), '
        "found [0, 0, 0]; write for example [0, 0, 1]"
    )


def test_problems_of_several_elements_are_reported_together() -> None:
    data = arm(grvity=1)
    data["body"][0]["mass"] = -1
    data["body"][1]["inertia"] = [1, 1]
    data["hinge"][1]["initial"] = {"q": [1, 2], "u": [1, 2]}
    lines = message_of(data).split("\n")
    assert len(lines) == 5
    for fragment in ("grvity", '"rod1": mass', '"rod2": inertia', "initial.q", "initial.u"):
        assert sum(fragment in line for line in lines) == 1


def test_at_most_ten_lines_and_a_count() -> None:
    data = arm(body=[body(f"rod{i}", mass=-1) for i in range(25)])
    lines = message_of(data).split("\n")
    assert len(lines) == 11
    assert lines[-1] == "arm.toml: and 15 more problems"


def test_a_file_in_which_everything_is_wrong_is_refused_soon() -> None:
    bodies = [body(f"rod{i}", ends={}) for i in range(3000)]
    hinges = [hinge(f"h{i}", inboard=f"rid{i}.tip", outboard=f"rad{i}") for i in range(3000)]
    assert message_of(arm(body=bodies, hinge=hinges)).endswith("and many more problems")


def test_in_python_the_scene_stands_for_the_file() -> None:
    with pytest.raises(SceneError, match=r'^scene: body "rod1": mass: expected a number in kg'):
        Scene(gravity=[0, 0, 0], body=[body(mass=-1)], hinge=[hinge()])
    for validate in (Scene.model_validate, Scene.from_data):
        with pytest.raises(SceneError, match=r"^scene: gravity: missing"):
            validate({"body": [body()], "hinge": [hinge()]})
    with pytest.raises(SceneError, match=r"^scene: gravity: expected"):
        Scene.model_validate_json('{"gravity": 1}')


def test_keys_that_are_words_of_python() -> None:
    assert "unknown key" in message_of(arm() | {"self": 1})
    assert "unknown key" in message_of(arm() | {"__class__": 1, "data": 2, "where": 3})


def test_an_end_beyond_what_numbers_hold_is_refused() -> None:
    """Its velocity would be infinite in a run that calls itself a success."""
    scene: Data = {
        "gravity": [0, 0, -9.81],
        "body": [
            {"name": "top", "mass": 1.0, "inertia": [1, 1, 1], "ends": {"head": [0, 0, 1.7e308]}}
        ],
        "hinge": [{"name": "point", "type": "ball", "inboard": "ground", "outboard": "top"}],
    }
    with pytest.raises(SceneError, match=r"head.*1e\+150 or less.*1.7e\+308"):
        Scene(**scene)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"drive": "sped*t"}, "'sped' is no constant of the scene: did you mean \"speed\"?"),
        ({"drive": "q*t"}, "use law.effort for feedback"),
        ({"law": {"effort": "sped*t"}}, "'sped' is unknown; did you mean \"speed\"?"),
        ({"damping": 0.1}, "unknown key; write it inside law, as in law = { damping = ... }"),
        ({"parent": "ground"}, 'parent: unknown key; did you mean "inboard"?'),
        ({"child": "rod"}, 'child: unknown key; did you mean "outboard"?'),
    ],
)
def test_slips_of_other_formats_get_the_way_out(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(SceneError) as raised:
        Scene(**one_rod(**changes), constants={"speed": 3.0})
    assert message in str(raised.value)


def test_units_of_their_own_are_refused() -> None:
    with pytest.raises(SceneError, match="units: unknown key; scenes are in m, kg, s"):
        Scene(**one_rod(), units="mm")
