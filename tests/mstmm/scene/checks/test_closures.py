"""Couplings: which names they take, and the rows that they cannot be."""

from __future__ import annotations

from typing import Any

import pytest

from mstmm.errors import SceneError
from mstmm.scene import Scene
from mstmm.scene.checks.connectivity import resolve_coordinate
from tests.support.scenes.minimal import arm, beam, body, hinge


def coupled_rods(*couplings: dict[str, Any], **hinges: dict[str, Any]) -> dict[str, Any]:
    """Three rods in a row, the last on a ball; `hinges` are changes by the hinge's name."""
    joints = {"shoulder": ("ground", "rod1", "pin"), "elbow": ("rod1.tip", "rod2", "cylindrical"),
              "wrist": ("rod2.tip", "rod3", "ball")}  # fmt: skip
    return arm(
        body=[body(), body("rod2"), body("rod3")],
        hinge=[hinge(name, inboard=inboard, outboard=outboard, type=kind) | hinges.get(name, {})
               for name, (inboard, outboard, kind) in joints.items()],
        coupling=list(couplings),
    )  # fmt: skip


def test_coordinates_go_by_number_or_by_their_own_name() -> None:
    text = "shoulder.angle + 2*elbow.displacement*elbow.q[1] + shoulder.q"
    scene = Scene(**coupled_rods({"expression": text}))
    assert [resolve_coordinate(scene, name) for name in scene.coupling[0].names] == [
        (0, "q", 0), (1, "q", 0), (1, "q", 1), (0, "q", 0),
    ]  # fmt: skip


def test_speeds_may_have_factors_that_depend_on_coordinates() -> None:
    rolling = {"speeds": "cos(shoulder.q)*wrist.u[2] - elbow.u[0]/(2 + elbow.q[0])", "equals": "t"}
    others = ("shoulder.u - 2*elbow.u[1]", "wrist.q[0]*wrist.u[0]")
    scene = Scene(**coupled_rods(rolling, *({"speeds": row} for row in others)))
    assert scene.coupling[0].equals is not None
    assert resolve_coordinate(scene, scene.coupling[0].names[1]) == (2, "u", 2)


@pytest.mark.parametrize(
    ("row", "message"),
    [
        ({}, "expression: missing; give expression or speeds"),
        ({"expression": "elbow.q[0]", "speeds": "shoulder.u"}, "speeds: expected expression or"),
        ({"expression": "2"}, "found '2', which is constant"),
        ({"expression": "shoulder.q + t"},
         "'t' is no coordinate of a hinge; write functions of time in equals"),
        ({"expression": "q"}, "'q' is no coordinate; write the name of a hinge and .q or .u"),
        ({"expression": "knee.q"}, "there is no hinge 'knee'"),
        ({"expression": "shoulder.u"}, "'shoulder.u' is a speed; use speeds in place of"),
        ({"expression": "shoulder.length"},
         "'shoulder.length' is unknown; this hinge has shoulder.q, shoulder.angle"),
        ({"expression": "elbow.q[2]"}, "the last entry of hinge \"elbow\" is [1]"),
        ({"expression": "wrist.q[0]"}, "'wrist.q[0]' is an entry of a quaternion, not an"),
        ({"expression": "rod1.x"}, "there is no hinge 'rod1'"),
        ({"expression": "abs(shoulder.q) - elbow.q[0]"},
         "no derivative where 'abs(shoulder.q)' switches; use a smooth"),
        ({"expression": "where(elbow.q[0] > 1, shoulder.q, 0)"}, "no derivative where"),
        ({"expression": "sqrt(shoulder.q)"},
         "the expression or one of its derivatives is not finite at the start (shoulder.q = 0)"),
        ({"expression": "shoulder.q^2", "equals": "1 + t"},
         "all derivatives are 0 at the start (shoulder.q = 0), so the direction of motion"),
        ({"name": "energy", "expression": "shoulder.q"},
         '"energy" is reserved for a quantity of results; choose another name'),
        ({"expression": "shoulder.q - shoulder.q + elbow.q[0]"},
         "'shoulder.q' has no effect; leave it out"),
        ({"speeds": "shoulder.q"}, "has no speed, as in cart.u; use expression in place of"),
        ({"speeds": "shoulder.u*elbow.u[0]"}, "not linear in the speeds; write a sum"),
        ({"speeds": "shoulder.u - 1"}, "a term has no speed; move it to equals"),
        ({"expression": "elbow.q[0]", "equals": "shoulder.q"},
         "equals: expected a function of t only, found 'shoulder.q'; move it to the coupling"),
        ({"expression": "elbow.q[0]", "equals": "sqrt(t)"},
         "equals: 'sqrt(t)' or one of its first two derivatives is not finite at t = 0"),
    ],
)  # fmt: skip
def test_refused_with_key_and_way_out(row: dict[str, Any], message: str) -> None:
    with pytest.raises(SceneError) as caught:
        Scene(**coupled_rods(row))
    assert message in str(caught.value)
    assert "coupling" in str(caught.value)


def test_modal_coordinates_are_not_coupled() -> None:
    held = hinge("root", type="fixed", inboard="ground", outboard="blade")
    data = {"gravity": [0, 0, 0], "beam": [beam()], "hinge": [held],
            "coupling": [{"expression": "blade.q[0]"}]}  # fmt: skip
    with pytest.raises(SceneError, match="couplings accept only those of hinges"):
        Scene(**data)


def test_a_coupling_written_twice_is_refused() -> None:
    with pytest.raises(SceneError, match="repeats coupling number 1; leave one out"):
        Scene(**coupled_rods({"name": "gear", "expression": "shoulder.q-2*elbow.q[1]"},
                        {"expression": "shoulder.q - 2*elbow.q[1]", "equals": 1}))  # fmt: skip


def test_a_drive_and_a_coupling_cannot_both_say_how_a_coordinate_goes() -> None:
    driven = {"shoulder": {"drive": "sin(t)"}}
    with pytest.raises(SceneError, match=r"drives already prescribe shoulder\.q"):
        Scene(**coupled_rods({"expression": "2*shoulder.q", "equals": "t"}, **driven))
    Scene(**coupled_rods({"expression": "2*shoulder.q - elbow.q[1]"}, **driven))
    let_go = {"shoulder": driven["shoulder"] | {"release": 1.0}}
    Scene(**coupled_rods({"expression": "2*shoulder.q", "equals": "t"}, **let_go))
