"""Elements of users' own types against their definitions."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from mstmm.errors import SceneError
from mstmm.ir.element_spec import ElementSpec, Param
from mstmm.ir.hinge_properties import builtin_hinges
from mstmm.scene import Scene, load_scene
from mstmm.scene.checks.user_types import _HINGE_TYPES_BY_SYNONYM, _hinge_type_for
from tests.support.scenes.minimal import arm, body, change_value, hinge, one_rod

KNEE = ElementSpec(
    "hinge",
    "knee",
    "knee",
    (Param("roll", "rad"), Param("slide", "m")),
    (Param("roll_rate", "rad/s"), Param("slide_rate", "m/s")),
    (Param("radius", "m", "radius of the roll", minimum=0.0), Param("offset", "m", default=0.0)),
    (),
)
OWN_SPEEDS = ElementSpec("hinge", "cardan", "", (Param("a"), Param("b")), (Param("w"),), (), ())
FLYWHEEL = ElementSpec("body", "flywheel", "", (), (), (Param("spin", "rad/s", maximum=1e4),), ())
ROPE = ElementSpec("force", "rope", "", (), (), (Param("length", "m"),), ())
KNOWN = {(s.kind, s.name): s for s in (KNEE, OWN_SPEEDS, FLYWHEEL, ROPE)}


def knee(**changes: Any) -> dict[str, Any]:
    return one_rod(**({"type": "knee", "parameters": {"radius": 0.1}} | changes))


def test_a_user_type_is_kept_with_its_numbers() -> None:
    scene = Scene(**knee(initial={"q": [1, 2]}, law={"damping": [1, 2]}, axis=[1, 0, 0]))
    scene.check_types(KNOWN)
    scene.check_type(KNEE)
    joint = scene.hinge[0]
    assert joint.builtin is None
    assert joint.parameters == {"radius": 0.1}
    assert joint.initial is not None and (joint.initial.q, joint.initial.u) == ((1, 2), None)


def test_bodies_and_forces_of_user_types() -> None:
    data = arm(body=[body(), {"name": "rod2", "type": "flywheel", "parameters": {"spin": 5}}])
    data["load"], data["event"] = [], []
    data["spring"] = [{"from": "rod1", "to": "rod2", "type": "rope", "parameters": {"length": 1}}]
    Scene(**data).check_types(KNOWN)


BAD = [
    (
        knee(parameters={}),
        "parameters.radius: missing; expected a number in m (radius of the roll)",
    ),
    (knee(parameters={"radius": -1}), "parameters.radius: expected 0 m or more, found -1"),
    (knee(parameters={"radius": 1, "ofset": 1}), 'no parameter "ofset"; did you mean "offset"?'),
    (knee(initial={"q": [1]}), "initial.q: expected 2 entries for knee, found 1"),
    (knee(initial={"u": [1, 2, 3]}), "initial.u: expected 2 entries for knee, found 3"),
    (knee(drive=["t", "t", "t"]), "drive: expected 2 entries for knee, found 3"),
    (knee(law={"damping": [1, 2, 3]}), "law.damping: expected 2 entries for knee, found 3"),
    (knee(law={"damping": 1}), "one number cannot be used for efforts in N*m, N"),
    (knee(law={"effort": ["q[2]", 0]}), 'the last entry of hinge "shoulder" is [1]'),
    (knee(law={"effort": ["q", 0]}), "write q[0] to q[1]"),
    (one_rod(type="cardan", drive=["t", "t"]), "cardan cannot be driven: it has"),
    (one_rod(type="pinn"), 'unknown hinge type "pinn"; did you mean "pin"?'),
    (one_rod(type="kne"), 'unknown hinge type "kne"; did you mean "knee"?'),
    (one_rod(type="spring"), 'unknown hinge type "spring"'),
    (one_rod(type="Revolute"), 'unknown hinge type "Revolute"; use "pin"'),
    (one_rod(type="weld_joint"), 'unknown hinge type "weld_joint"; use "fixed"'),
    (
        change_value(one_rod(), "body", 0, "type", to="rigidd"),
        'unknown body type "rigidd"; did you mean "rigid"?',
    ),
    (
        one_rod() | {"spring": [{"from": "ground", "to": "rod1", "type": "sprong"}]},
        'spring "spring1": type: unknown force type "sprong"; did you mean "spring"?',
    ),
    (
        knee() | {"event": [{"when": "shoulder.u[2] > 1", "do": "stop"}]},
        "event \"event1\": when: 'shoulder.u[2]'",
    ),
]


def coupled_knee(expression: str) -> dict[str, Any]:
    return knee() | {"coupling": [{"expression": expression}]}


def test_coordinates_of_a_type_that_is_not_known_yet_may_be_coupled() -> None:
    Scene(**coupled_knee("shoulder.q[0] - 2*shoulder.roll")).check_types(KNOWN)
    with pytest.raises(SceneError, match="the last entry of hinge"):
        Scene(**coupled_knee("shoulder.q[2]")).check_types(KNOWN)


@pytest.mark.parametrize(("data", "fragment"), BAD)
def test_what_does_not_fit_the_definition(data: dict[str, Any], fragment: str) -> None:
    scene = Scene(**data)
    with pytest.raises(SceneError) as caught:
        scene.check_types(KNOWN, "arm.toml")
    assert fragment in str(caught.value)
    assert str(caught.value).startswith("arm.toml: ")


def chain_scene(**changes: Any) -> dict[str, Any]:
    """A chain whose second body and hinge are of users' types."""
    own = {"type": "knee", "parameters": {"radius": 0.1}} | changes
    flywheel = {"type": "flywheel", "parameters": {"spin": 5}, "ends": {"tip": [1, 0, 0]}}
    link = {"mass": 1.0, "inertia": [1, 1, 1], "ends": {"tip": [1, 0, 0]}}
    rope = {"name": "rope", "count": 6, "inboard": "ground", "body": [link, flywheel],
            "hinge": [{"type": "pin"}, own]}  # fmt: skip
    return {"gravity": [0, 0, 0], "chain": [rope]}


def test_user_types_in_chains() -> None:
    Scene(**chain_scene(law={"effort": ["q[1]", "radius"]})).check_types(KNOWN)


@pytest.mark.parametrize(
    ("data", "fragment"),
    [
        (
            chain_scene(parameters={}),
            'chain "rope": hinge[1].parameters.radius: missing; expected a num',
        ),
        (chain_scene(type="kne"), 'chain "rope": hinge[1].type: unknown hinge type "kne"; did you'),
        (
            chain_scene(initial={"q": [1]}),
            "hinge[1].initial.q: expected 2 entries for knee, found 1",
        ),
        (
            chain_scene(law={"effort": ["q[2]", 0]}),
            'the last entry of hinge "rope[1].hinge" is [1]',
        ),
        (
            chain_scene() | {"event": [{"when": "rope[3].hinge.u[2] > 1", "do": "stop"}]},
            "'rope[3].hinge.u[2]': the last entry of hinge \"rope[3].hinge\" is [1]",
        ),
        (
            chain_scene(law={"effort": ["rope[5].hinge.q", 0]}),
            "write rope[5].hinge.q[0] to rope[5].hinge.q[1]",
        ),
    ],
)
def test_what_does_not_fit_in_a_chain(data: dict[str, Any], fragment: str) -> None:
    scene = Scene(**data)
    with pytest.raises(SceneError) as caught:
        scene.check_types(KNOWN, "rope.toml")
    assert fragment in str(caught.value)
    Scene(**chain_scene()).check_types(KNOWN)


def test_check_against_looks_at_its_own_type_only() -> None:
    scene = Scene(**knee(initial={"q": [1]}))
    scene.check_type(FLYWHEEL)
    with pytest.raises(SceneError, match=r'^scene: hinge "shoulder": initial\.q'):
        scene.check_type(KNEE)


def test_keys_that_a_definition_does_not_read_are_refused() -> None:
    for key, value in (("lead", 1), ("axis2", [1, 0, 0]), ("normal", [1, 0, 0])):
        with pytest.raises(SceneError, match=f"{key}: a knee hinge has no {key}"):
            Scene(**knee(**{key: value})).check_types(KNOWN)
    with pytest.raises(SceneError, match=r'law: law belongs to type "spring"; use parameters'):
        rope = {"from": "ground", "to": "rod1", "type": "rope", "law": {"stiffness": 1}}
        Scene(**one_rod(), spring=[rope])


def test_loading_checks_types_when_they_are_known(tmp_path: Path) -> None:
    path = tmp_path / "arm.toml"
    path.write_text(Scene(**one_rod(type="pinn")).to_toml())
    assert load_scene(path).hinge[0].type == "pinn"
    with pytest.raises(SceneError, match=r'arm\.toml: hinge "shoulder": type: unknown hinge type'):
        load_scene(path, known_types={})
    pinn = ElementSpec("hinge", "pinn", "", (), (), (), ())
    assert load_scene(path, known_types={("hinge", "pinn"): pinn}).hinge[0].type == "pinn"


def test_parameters_are_names_in_expressions() -> None:
    Scene(**knee(law={"effort": ["radius*t", "offset2"]}, parameters={"radius": 1, "offset2": 2}))
    with pytest.raises(SceneError, match="'radios' is unknown; did you mean \"radius\""):
        Scene(**knee(law={"effort": ["radios*t", 0]}))
    assert hinge()["name"] == "shoulder"


def test_words_of_others_lead_to_hinges_that_there_are() -> None:
    assert set(_HINGE_TYPES_BY_SYNONYM.values()) <= set(builtin_hinges())
    assert not set(_HINGE_TYPES_BY_SYNONYM) & set(builtin_hinges())
    assert _hinge_type_for("Ball-and-socket joint") == "ball" and _hinge_type_for("elbow") is None
