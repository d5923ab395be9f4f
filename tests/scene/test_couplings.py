"""Couplings: which names they take, and the rows that they cannot be."""

from __future__ import annotations

from typing import Any

import pytest

from mstmm.errors import SceneError
from mstmm.scene import Scene
from mstmm.scene.checks.closures import coordinate
from scene.scenes import arm, beam, body, hinge


def coupled(*couplings: dict[str, Any], **hinges: dict[str, Any]) -> dict[str, Any]:
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
    scene = Scene(**coupled({"expression": text}))
    assert [coordinate(scene, name) for name in scene.coupling[0].names] == [
        (0, "q", 0), (1, "q", 0), (1, "q", 1), (0, "q", 0),
    ]  # fmt: skip


def test_speeds_may_have_factors_that_depend_on_coordinates() -> None:
    rolling = {"speeds": "cos(shoulder.q)*wrist.u[2] - elbow.u[0]/(2 + elbow.q[0])", "equals": "t"}
    others = ("shoulder.u - 2*elbow.u[1]", "wrist.q[0]*wrist.u[0]")
    scene = Scene(**coupled(rolling, *({"speeds": row} for row in others)))
    assert scene.coupling[0].equals is not None
    assert coordinate(scene, scene.coupling[0].names[1]) == (2, "u", 2)


@pytest.mark.parametrize(
    ("row", "message"),
    [
        ({}, "expression: missing; give an expression of coordinates, or speeds"),
        ({"expression": "elbow.q[0]", "speeds": "shoulder.u"}, "speeds: a coupling has one row"),
        ({"expression": "2"}, "found '2', which is one number"),
        ({"expression": "shoulder.q + t"},
         "'t' is no coordinate of a hinge; what goes by time belongs to equals"),
        ({"expression": "q"}, "'q' is no coordinate; write the name of a hinge and .q or .u"),
        ({"expression": "knee.q"}, "there is no hinge 'knee'"),
        ({"expression": "shoulder.u"}, "'shoulder.u' is a speed; write speeds in place of"),
        ({"expression": "shoulder.length"},
         "'shoulder.length' is unknown; of this hinge there is shoulder.q, shoulder.angle"),
        ({"expression": "elbow.q[2]"}, "the last entry of hinge \"elbow\" is [1]"),
        ({"expression": "wrist.q[0]"}, "'wrist.q[0]' is an entry of a quaternion, which is no"),
        ({"expression": "rod1.x"}, "there is no hinge 'rod1'"),
        ({"expression": "abs(shoulder.q) - elbow.q[0]"},
         "it has no slope where 'abs(shoulder.q)' switches; write it without"),
        ({"expression": "where(elbow.q[0] > 1, shoulder.q, 0)"}, "it has no slope where"),
        ({"expression": "sqrt(shoulder.q)"},
         "it or one of its slopes is not finite at the start (shoulder.q = 0); start elsewhere"),
        ({"expression": "shoulder.q^2", "equals": "1 + t"},
         "all of its slopes are 0 at the start (shoulder.q = 0), so nothing tells which way"),
        ({"name": "energy", "expression": "shoulder.q"},
         '"energy" is a quantity of every result; choose another name'),
        ({"expression": "shoulder.q - shoulder.q + elbow.q[0]"},
         "it does not change with 'shoulder.q'; leave that out"),
        ({"speeds": "shoulder.q"}, "names no speed, as in cart.u; write expression in place of"),
        ({"speeds": "shoulder.u*elbow.u[0]"}, "it is not linear in the speeds"),
        ({"speeds": "shoulder.u - 1"}, "it has a part without speeds; write that in equals"),
        ({"expression": "elbow.q[0]", "equals": "shoulder.q"},
         "equals: it depends on t alone, found 'shoulder.q'; write that in the coupling"),
        ({"expression": "elbow.q[0]", "equals": "sqrt(t)"},
         "equals: 'sqrt(t)' or one of its first two derivatives is not finite at t = 0"),
    ],
)  # fmt: skip
def test_refused_with_key_and_way_out(row: dict[str, Any], message: str) -> None:
    with pytest.raises(SceneError) as caught:
        Scene(**coupled(row))
    assert message in str(caught.value)
    assert "coupling" in str(caught.value)


def test_modal_coordinates_are_not_coupled() -> None:
    held = hinge("root", type="fixed", inboard="ground", outboard="blade")
    data = {"gravity": [0, 0, 0], "beam": [beam()], "hinge": [held],
            "coupling": [{"expression": "blade.q[0]"}]}  # fmt: skip
    with pytest.raises(SceneError, match="couplings are of hinges alone"):
        Scene(**data)


def test_a_coupling_written_twice_is_refused() -> None:
    with pytest.raises(SceneError, match="coupling number 1 couples the same; leave one out"):
        Scene(**coupled({"name": "gear", "expression": "shoulder.q-2*elbow.q[1]"},
                        {"expression": "shoulder.q - 2*elbow.q[1]", "equals": 1}))  # fmt: skip


def test_a_drive_and_a_coupling_cannot_both_say_how_a_coordinate_goes() -> None:
    driven = {"shoulder": {"drive": "sin(t)"}}
    with pytest.raises(SceneError, match=r"a drive says already how shoulder\.q goes"):
        Scene(**coupled({"expression": "2*shoulder.q", "equals": "t"}, **driven))
    Scene(**coupled({"expression": "2*shoulder.q - elbow.q[1]"}, **driven))
    let_go = {"shoulder": driven["shoulder"] | {"release": 1.0}}
    Scene(**coupled({"expression": "2*shoulder.q", "equals": "t"}, **let_go))
