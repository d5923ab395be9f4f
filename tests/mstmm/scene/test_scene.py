"""What a good scene becomes: defaults filled in, values normalised, echo, schema."""

from __future__ import annotations

import json
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mstmm.ir.element_spec import element_from_json
from mstmm.ir.hinge_properties import builtin_hinges, effort_unit
from mstmm.numerics.rotations import norm
from mstmm.scene import Hinge, Scene, load_scene
from mstmm.scene.tables.law import SpringLaw
from tests.reference.random_scenes import random_scene
from tests.support.paths import ROOT
from tests.support.scenes.minimal import arm, body, change_value, hinge, one_rod
from tests.support.work import calls


def the_hinge(**changes: Any) -> Hinge:
    return Scene(**one_rod(**changes)).hinge[0]


# --- defaults and normal forms --------------------------------------------------------------------

NEEDED: dict[str, dict[str, Any]] = {"screw": {"lead": 0.1}, "universal": {"axis2": [0, 1, 0]}}


@pytest.mark.parametrize("kind", builtin_hinges())
def test_every_type_gets_start_values_and_a_law_per_speed(kind: str) -> None:
    joint = the_hinge(type=kind, **NEEDED.get(kind, {}))
    table = builtin_hinges()[kind]
    assert joint.builtin is table
    assert joint.initial is not None
    assert joint.initial.q == table.start
    assert joint.initial.u == (0.0,) * len(table.speeds)
    for values in (joint.law.stiffness, joint.law.effort, joint.law.friction, joint.law.limits):
        assert len(values) == len(table.speeds)


@pytest.mark.parametrize("kind", [k for k in builtin_hinges() if k != "elastic"])
def test_coordinates_are_those_of_the_generated_element(kind: str) -> None:
    spec = element_from_json((ROOT / "generated" / f"hinge_{kind}.json").read_text())
    for mine, theirs in (
        (builtin_hinges()[kind].coordinates, spec.coordinates),
        (builtin_hinges()[kind].speeds, spec.speeds),
    ):
        assert [(c.name, c.unit) for c in mine] == [(c.name, c.unit) for c in theirs]


def test_units_of_efforts() -> None:
    assert [effort_unit(u) for u in ("m/s", "rad/s", "1/s")] == ["N", "N*m", "J"]


def test_inertia_of_three_or_six_entries() -> None:
    short = Scene(**one_rod()).body[0]
    full = Scene(
        **change_value(one_rod(), "body", 0, "inertia", to=[3, 2, 2.5, 0.1, -0.2, 0.3])
    ).body[0]
    assert short.inertia == (0.001, 0.084, 0.084, 0.0, 0.0, 0.0)
    assert full.inertia_matrix == ((3, 0.1, -0.2), (0.1, 2, 0.3), (-0.2, 0.3, 2.5))


@pytest.mark.parametrize(
    "inertia", [[0, 0, 0], [1, 1, 2], [0, 1 / 12, 1 / 12], [1e-9, 1e-9, 2e-9], [1, 1.2, 2.2000001]]
)
def test_limiting_inertias_are_accepted(inertia: list[float]) -> None:
    assert Scene(**change_value(one_rod(), "body", 0, "inertia", to=inertia)).warnings == ()


@pytest.mark.parametrize("at", ["scene", "body"])
def test_unphysical_inertia_is_accepted_when_asked_and_warned_about(at: str) -> None:
    data = change_value(one_rod(), "body", 0, "inertia", to=[1, 1, 3])
    allowed = data | {"allow_unphysical_inertia": True}
    if at == "body":
        allowed = change_value(data, "body", 0, "allow_unphysical_inertia", to=True)
    (warning,) = Scene(**allowed).warnings
    assert warning.startswith('body "rod1": inertia: the principal moments [1, 1, 3] kg m^2')


@pytest.mark.parametrize("inertia", [[1, 1, -1], [1, 1, 1, 2, 0, 0]])
def test_negative_moments_are_accepted_when_asked_and_warned_about(inertia: list[float]) -> None:
    data = change_value(one_rod(), "body", 0, "inertia", to=inertia)
    (warning,) = Scene(**data, allow_unphysical_inertia=True).warnings
    assert warning.startswith('body "rod1": inertia: the principal moments [-1, 1, ')
    assert warning.count(
        "kg m^2 are not all positive; accepted because of allow_unphysical_inertia; correct it"
    )


def test_rounding_below_zero_counts_as_zero_and_is_said_once() -> None:
    """As programs for drawing write the inertia of thin parts."""
    dusty = [{**one_rod()["body"][0], "name": f"rod{k}", "inertia": [-5e-20, 1e-3, 1e-3]}
             for k in range(3)]  # fmt: skip
    hinges = [{"name": f"pin{k}", "type": "pin", "inboard": "ground", "outboard": f"rod{k}"}
              for k in range(3)]  # fmt: skip
    scene = Scene(gravity=(0, 0, 0), body=dusty, hinge=hinges)
    assert scene.warnings == (
        'body "rod0": inertia: -5e-20 kg m^2 is rounding and is treated as zero (and 2 more); '
        "write 0",
    )
    assert scene.body[0].inertia_matrix[0][0] == 0.0
    (small,) = Scene(**change_value(one_rod(), "body", 0, "inertia", to=[-5e-20] * 3)).warnings
    assert "is treated as zero" in small


def test_an_inertia_is_judged_free_of_its_axes(rng: np.random.Generator) -> None:
    for _ in range(20):
        basis = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        for moments, good in (([1, 2, 2.9], True), ([1, 2, 3.1], False)):
            j = basis @ np.diag(moments) @ basis.T
            entries = [j[0, 0], j[1, 1], j[2, 2], j[0, 1], j[0, 2], j[1, 2]]
            data = change_value(one_rod(), "body", 0, "inertia", to=entries)
            scene = Scene(**data, allow_unphysical_inertia=True)
            assert (scene.warnings == ()) is good


@pytest.mark.parametrize(
    "q", [[2, 0, 0, 0], [1, 1, 1, 1], [1e-3, 2e-3, 0, 0], [1e200, 1e200, 0, 0]]
)
def test_quaternions_are_normalised(q: list[float]) -> None:
    joint = the_hinge(type="ball", orientation=q, initial={"q": q})
    assert joint.initial is not None and joint.initial.q is not None
    for unit in (joint.orientation, joint.initial.q):
        assert norm(unit) == pytest.approx(1, abs=3e-16)
        assert np.allclose(
            np.array(unit) * np.linalg.norm(np.array(q) / max(q)), np.array(q) / max(q)
        )
    again = the_hinge(type="ball", orientation=joint.orientation, initial={"q": joint.initial.q})
    assert (again.orientation, again.initial) == (joint.orientation, joint.initial)


def test_free_hinge_normalises_its_quaternion_only() -> None:
    joint = the_hinge(type="free", initial={"q": [5, 6, 7, 0, 0, 2, 0]})
    assert joint.initial is not None
    assert joint.initial.q == (5, 6, 7, 0, 0, 1, 0)


def test_one_law_for_all_coordinates_of_one_unit() -> None:
    law = the_hinge(type="gimbal", law={"damping": 2, "effort": "t", "stiffness": [1, 2, 3]}).law
    assert law.damping == (2, 2, 2)
    assert [e.text for e in law.effort] == ["t", "t", "t"]
    assert law.entry(2).stiffness == 3
    assert the_hinge(type="cylindrical", law={"stiffness": 0}).law.stiffness == (0, 0)


def test_friction_and_limits() -> None:
    law = the_hinge(law={"friction": {"coulomb": 2}, "limits": {"upper": 1, "stiffness": 10}}).law
    assert law.friction[0].acts and law.friction[0].static == 2
    assert law.limits[0].acts and law.limits[0].lower is None
    two = the_hinge(
        type="cylindrical",
        law={
            "friction": [{}, {"coulomb": 1, "static": 2}],
            "limits": [{"lower": 0, "stiffness": 1}, {}],
        },
    ).law
    assert [f.acts for f in two.friction] == [False, True]
    assert [s.acts for s in two.limits] == [True, False]


def test_drive_of_one_and_of_several_coordinates() -> None:
    driven = the_hinge(drive="0.5*sin(3*t)", release=1.5)
    assert driven.drive is not None and driven.drive[0] is not None
    assert driven.drive[0].text == "0.5*sin(3*t)"
    assert driven.initial is None
    assert driven.release is not None and driven.release.text == "t >= 1.5"
    assert driven.release.time_breaks() == (1.5,)
    part = the_hinge(type="planar", drive=["free", "2 + 3*t", 1])
    assert part.drive is not None and part.drive[0] is None
    assert part.initial is not None
    assert (part.initial.q, part.initial.u) == ((0, 2, 1), (0, 3, 0))
    given = the_hinge(type="planar", drive=["free", "2 + 3*t", 1], initial={"q": [7, 2, 1]})
    assert given.initial is not None and given.initial.q == (7, 2, 1)
    assert the_hinge(drive="free").drive is None


def test_axes_of_the_planar_hinge() -> None:
    default = the_hinge(type="planar")
    assert (default.unit_axis, default.unit_axis2) == ((0, 0, 1), (1, 0, 0))
    by_normal = the_hinge(type="planar", normal=[0, 2, 0], axis2=[0, 1, 1])
    by_axis = the_hinge(type="planar", axis=[0, 2, 0], axis2=[0, 1, 1])
    assert by_normal == by_axis
    assert by_normal.unit_axis == (0, 1, 0)
    assert by_normal.unit_axis2 == pytest.approx((0, 0, 1))
    skew = the_hinge(type="planar", normal=[1, 2, 3])
    assert skew.axis2 is not None
    assert np.dot(skew.unit_axis, skew.axis2) == pytest.approx(0, abs=1e-15)


def test_axis_of_any_length() -> None:
    assert the_hinge(axis=[0, 3e-9, 0]).unit_axis == (0, 1, 0)
    assert the_hinge(axis=[1e300, 0, 1e300]).unit_axis == pytest.approx((0.5**0.5, 0, 0.5**0.5))


def test_elements_without_a_name_get_one() -> None:
    data = arm(load=[{"on": "rod1", "name": "load2"}, {"on": "rod1"}, {"on": "rod2"}])
    assert [load.name for load in Scene(**data).load] == ["load2", "load2_", "load3"]
    assert [e.name for e in Scene(**arm()).event + Scene(**arm()).spring] == ["event1", "spring1"]


def test_arrays_and_numbers_of_numpy() -> None:
    data = arm(gravity=np.array([0, -9.81, 0]))
    data["body"][0]["mass"] = np.float32(2)
    data["body"][0]["inertia"] = list(np.array([1, 1, 1]))
    data["hinge"][0]["initial"] = {"q": np.array([0.25])}
    scene = Scene(**data)
    assert scene.body[0].mass == 2 and type(scene.body[0].mass) is float
    assert scene.hinge[0].initial is not None and scene.hinge[0].initial.q == (0.25,)


def test_frozen() -> None:
    scene = Scene(**arm())
    changes = ((scene, "gravity"), (scene.body[0], "mass"), (scene.hinge[0].law, "rest"))
    for table, key in changes:
        with pytest.raises(ValueError, match="frozen"):
            setattr(table, key, getattr(table, key))


def test_where_things_are() -> None:
    data = one_rod(orientation=[0, 0, np.pi / 2])
    data["body"][0]["ends"]["tip"] = {"position": [1, 2, 3], "orientation": [1, 0, 0, 1]}
    scene = Scene(**change_value(data, "hinge", 0, "outboard", to="rod1.tip"))
    joint, rod = scene.hinge[0], scene.body[0]
    assert (joint.inboard_body, joint.inboard_end) == ("ground", "")
    assert (joint.outboard_body, joint.outboard_end) == ("rod1", "tip")
    assert rod.end_position("tip") == (1, 2, 3) and rod.end_position("") == (0, 0, 0)
    turn = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    assert joint.rotation == tuple(map(tuple, turn))
    assert np.allclose(rod.end_rotation("tip"), turn)
    assert np.allclose(rod.end_rotation(""), np.eye(3))


# --- echo and schema ----------------------------------------------------------------------------


def complete_scene() -> dict[str, Any]:
    """One scene with every table, most keys, and a user's type of each kind."""
    names = ["b0", "b1", "b2", "b3", "b4", "b5", "wheel"]
    turned = {"position": [1, 1, 0], "orientation": [1, 1, 0, 0]}
    bodies = [body(n, ends={"tip": [1, 0, 0], "mid": turned}) for n in names[:-1]]
    bodies.append({"name": "wheel", "type": "flywheel", "parameters": {"spin": 3.0}})
    joints = [
        hinge("h0", type="free", outboard="b0", initial={"q": [1, 2, 3, 0, 1, 0, 1]}),
        hinge("h1", type="planar", inboard="b0.tip", outboard="b1", normal=[1, 0, 0],
              drive=["free", "t^2", "free"], release="t > 1"),
        hinge("h2", type="universal", inboard="b1.mid", outboard="b2", axis2=[1, 0, 0],
              law={"stiffness": [1, 2], "effort": ["sin(q[0])", "-b2joint.u"],
                   "limits": [{"lower": -1, "stiffness": 1e4}, {}], "friction": {"coulomb": 0.1}}),
        hinge("b2joint", type="screw", inboard="b2", outboard="b3.tip", lead=0.02, drive="sin(t)"),
        hinge("h4", type="fixed", inboard="b3", outboard="b4", release=2),
        hinge("h5", type="knee", inboard="b4", outboard="b5", parameters={"radius": 0.1},
              initial={"q": [0.1, 0.2]}, law={"damping": 3, "effort": "radius*q[1]"}),
        hinge("h6", type="elastic", inboard="b4.tip", outboard="wheel",
              law={"stiffness": [1, 1, 1, 2, 2, 2], "rest": [0.1, 0, 0, 0, 0, 0]}),
    ]  # fmt: skip
    link = {key: value for key, value in bodies[0].items() if key != "name"}
    return {
        "gravity": [0, 0, -9.81],
        "body": bodies,
        "hinge": joints,
        "chain": [
            {"name": "rope", "count": 9, "inboard": "b5.mid", "end": "tip",
             "body": [link, {"type": "flywheel", "ends": {"tip": [1, 1, 1]}}],
             "hinge": [{"type": "ball", "initial": {"q": [2, 0, 0, 0]}},
                       {"type": "planar", "normal": [1, 0, 0]},
                       {"type": "knee", "parameters": {"radius": 2.0}}]},
            {"name": "whip", "count": 3, "inboard": "rope[last]", "orientation": [0, 1, 0],
             "body": {"mass": 1.0, "ends": {"end": [1, 0, 0]}},
             "hinge": {"type": "pin", "law": {"effort": "q*rope[2].hinge.u[1]"}}},
        ],
        "load": [{"on": "whip[last].end", "axes": "rope[2]"},
                 {"on": "b1", "moment": ["h1.q[2]", 0, "where(t < 1, 1, 0)"], "axes": "b2"}],
        "event": [{"when": "b1.mid.vz >= h5.q[0]", "do": "release", "hinge": "h4"}],
        "spring": [{"from": "ground", "to": "b5", "position": [1, 2, 3], "law": {"effort": "q*u"}},
                   {"from": "b0", "to": "b5.tip", "type": "rope", "parameters": {"length": 2}}],
    }  # fmt: skip


def assert_round_trip(scene: Scene) -> None:
    text = scene.to_toml()
    again = Scene(**tomllib.loads(text))
    assert again == scene
    assert again.to_toml() == text
    assert Scene(**scene.model_dump()) == scene
    assert Scene(**json.loads(scene.model_dump_json(by_alias=True))) == scene


def test_round_trip_of_everything() -> None:
    assert_round_trip(Scene(**complete_scene()))
    assert_round_trip(Scene(**arm()))


def test_round_trip_of_random_scenes(rng: np.random.Generator) -> None:
    seed = int(rng.integers(2**31))
    for i in range(5):
        data = random_scene(seed + i, laws=False)
        assert_round_trip(Scene(**data))


@pytest.mark.parametrize(
    "path", sorted((ROOT / "examples").glob("*/*.toml")), ids=lambda p: p.parent.name
)
def test_round_trip_of_the_examples(path: Path) -> None:
    assert_round_trip(load_scene(path))


def test_the_echo_says_every_default() -> None:
    text = Scene(**one_rod()).to_toml()
    for line in (
        "schema_version = 1",
        "gravity = [0.0, 0.0, -9.81]",
        'type = "rigid"',
        "inertia = [0.001, 0.084, 0.084, 0.0, 0.0, 0.0]",
        "axis = [0.0, 0.0, 1.0]",
        "orientation = [0.0, 0.0, 0.0]",
        "initial = { q = [0.0], u = [0.0] }",
        "stribeck_velocity = 0.01",
    ):
        assert line in text


def test_schema_is_published_with_units() -> None:
    schema = Scene.model_json_schema(by_alias=True)
    text = json.dumps(schema)
    assert schema["required"] == ["gravity"]
    assert set(schema["properties"]) == set(Scene.model_fields)
    assert schema["additionalProperties"] is False
    assert set(schema["$defs"]) >= {"Body", "Hinge", "Law", "Limits", "Load", "Event", "Spring"}
    assert "from" in schema["$defs"]["Spring"]["properties"]
    assert "a number in kg, 0 or more" in text and "three numbers in m/s^2" in text
    assert set(schema["$defs"]["Hinge"]["required"]) == {"name", "type", "inboard", "outboard"}
    assert schema["$defs"]["Load"]["properties"]["force"]["default"] == [0.0, 0.0, 0.0]
    assert SpringLaw.model_json_schema()["properties"]["effort"]["default"] == 0.0


def test_reading_a_scene_loads_neither_numpy_nor_sympy() -> None:
    code = (
        "import sys, mstmm.scene, mstmm.scene.checks.topology; "
        "print([m for m in ('numpy', 'sympy', 'scipy', 'cffi', 'jinja2') if m in sys.modules])"
    )
    path = [*sys.path, str(ROOT)]
    result = subprocess.run(
        [sys.executable, "-c", f"import sys; sys.path[:] = {path!r}; {code}"],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert result.stdout.strip() == "[]"


def long_chain(n: int) -> Scene:
    bodies = [body(f"b{i}") for i in range(n)]
    hinges = [
        hinge(f"h{i}", inboard=f"b{i - 1}.tip" if i else "ground", outboard=f"b{i}")
        for i in range(n)
    ]
    return Scene(gravity=[0, 0, 0], body=bodies, hinge=hinges)


def test_ten_thousand_bodies_are_as_much_work_each_as_a_few() -> None:
    assert len(long_chain(10_000).body) == 10_000
    assert calls(lambda: long_chain(1000)) < 2.2 * calls(lambda: long_chain(500))


def test_a_body_as_light_as_a_slip_of_units_is_warned_about() -> None:
    """1000 m with 1 kg: a rod of 1 m whose lengths were written in mm."""
    rod = {"mass": 1.0, "center_of_mass": [500, 0, 0], "inertia": [1.0, 84e3, 84e3]}
    rod = {"name": "rod1", **rod}
    (risk,) = Scene(**one_rod() | {"body": [rod]}).risks
    assert risk.name == "proportions" and "500 m with a mass of 1 kg" in risk.description
    assert not risk.invalidates
    assert not Scene(**one_rod() | {"body": [rod | {"mass": 500.0}]}).risks
