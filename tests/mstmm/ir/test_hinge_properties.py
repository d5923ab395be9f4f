"""What is read off the kernel of a hinge, beside what its motion is known to be."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from mstmm.ir import KernelIR, Port
from mstmm.ir.hinge_properties import (
    HingeProperties,
    Param,
    builtin_hinges,
    hinge_properties,
    hinge_properties_from_data,
    hinge_properties_to_data,
)
from mstmm.ir.statements import Assign, Constant, Element, Store, Temporary
from mstmm.scene.tables.hinge import Hinge
from mstmm.scene.tables.hinge_frames import initial_motion_axes

#: Name -> turns, slides, steady, axial, keeps z, straight, place of a quaternion.
KNOWN: dict[str, tuple[tuple[int, ...], tuple[int, ...], bool, bool, bool, bool, int | None]] = {
    "fixed": ((), (), True, False, True, True, None),
    "pin": ((0,), (), True, True, True, True, None),
    "prismatic": ((), (0,), True, True, False, True, None),
    "screw": ((0,), (0,), True, True, False, True, None),
    "cylindrical": ((1,), (0,), True, True, False, True, None),
    "universal": ((0, 1), (), False, False, False, True, None),
    "ball": ((0, 1, 2), (), True, False, False, False, 0),
    "planar": ((2,), (0, 1), False, False, True, True, None),
    "free": ((3, 4, 5), (0, 1, 2), True, False, False, False, 3),
    "gimbal": ((0, 1, 2), (), False, False, False, True, None),
    "elastic": ((3, 4, 5), (0, 1, 2), True, False, False, False, 3),
}


def test_facts_of_the_built_in_hinges() -> None:
    found = {
        name: (f.turns, f.slides, f.constant_subspace, f.axial, f.keeps_z, f.straight, f.quaternion)
        for name, f in builtin_hinges().items()
    }
    assert found == KNOWN
    assert all(facts.in_place for facts in builtin_hinges().values())
    assert [name for name, f in builtin_hinges().items() if f.welds] == ["fixed"]
    assert [name for name, f in builtin_hinges().items() if f.free_body] == ["elastic", "free"]
    assert [name for name, f in builtin_hinges().items() if f.is_free] == [
        "planar", "elastic", "free",
    ]  # fmt: skip


def test_motion_at_the_start() -> None:
    alpha, lead = 1.1, 0.2
    first, second = (r for _, r in builtin_hinges()["universal"].start_motion_columns([alpha]))
    assert first == pytest.approx((0, math.sin(alpha), math.cos(alpha)))
    assert second == (0, 0, 1)
    ((along, about),) = builtin_hinges()["screw"].start_motion_columns([lead])
    assert along == pytest.approx((0, 0, lead / (2 * math.pi))) and about == (0, 0, 1)
    with pytest.raises(ValueError, match="expected 1 parameters"):
        builtin_hinges()["screw"].start_motion_columns()


def test_stored_form() -> None:
    for facts in builtin_hinges().values():
        assert hinge_properties_from_data(hinge_properties_to_data(facts)) == facts


def odd(value: tuple[Assign, ...]) -> HingeProperties:
    """A hinge that slides along x by the last value per unit of its speed."""
    q, u, p = Port("q", (1,)), Port("u", (1,)), Port("p", (0,))
    stores = (
        Store("H", (0,), Temporary(value[-1].number)), Store("qdot", (0,), Element("u", (0,))),
    )  # fmt: skip
    outputs = (Port("H", (6,)), Port("qdot", (1,)), Port("R", (3, 3)), Port("d", (3,)))
    kernel = KernelIR("hinge", (p, q, u), outputs, (*value, *stores))
    return hinge_properties(kernel, "odd", (Param("a", "m"),), (Param("a_rate", "m/s"),), ())


def test_coordinates_that_fail_at_their_start() -> None:
    """Nothing is known there, and what asks says so instead of computing with it."""
    facts = odd((Assign(0, "div", (Constant("1"), Element("q", (0,)))),))
    assert facts.varies == ("q00000",) and not facts.constant_subspace and facts.straight
    assert facts.start_motion_columns()[0][0][0] == math.inf
    hinge = Hinge(name="h", type="odd", inboard="ground", outboard="b")
    assert initial_motion_axes(hinge) is None  # not known yet
    vars(hinge)["facts"] = facts
    assert initial_motion_axes(hinge) is None
    fine = odd((Assign(0, "cos", (Element("q", (0,)),)),))
    vars(hinge)["facts"] = replace(fine, frame="own")
    assert initial_motion_axes(hinge) == [((1.0, 0.0, 0.0), (0.0, 0.0, 0.0))]
