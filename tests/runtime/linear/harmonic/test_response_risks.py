"""Frequency responses of beams without shapes in a direction that the response excites."""

from __future__ import annotations

import numpy as np
import pytest

import mstmm

#: Bending stiffness (N m^2) of a beam of 1 m.
EI = 100.0


def bar(modes: dict[str, int], hinge: str = "fixed") -> mstmm.Scene:
    beam = {"name": "bar", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": EI,
            "damping": 0.05, "modes": modes}  # fmt: skip
    wall: dict[str, object] = {"name": "wall", "type": hinge, "inboard": "ground",
                               "outboard": "bar"}  # fmt: skip
    if hinge == "pin":
        wall |= {"axis": [0, 1, 0], "law": {"stiffness": 1.0, "damping": 0.1}}
    return mstmm.Scene(gravity=(0, 0, 0), beam=[beam], hinge=[wall])


@pytest.mark.parametrize(
    ("hinge", "inputs", "outputs", "omega"),
    [
        ("fixed", ["bar.tip.fz"], ["bar.tip.z"], 1.0),
        ("fixed", ["ground.acceleration.z"], ["bar.tip.vz"], 10.0),
        ("pin", ["wall.effort"], ["wall.angle"], 150.0),  # first bending, 15.4 sqrt(EI): 154
    ],
)
def test_a_response_across_the_plane_of_the_shapes_is_an_objection(
    hinge: str, inputs: list[str], outputs: list[str], omega: float
) -> None:
    lacking = mstmm.compile(bar({"y": 2}, hinge)).frequency_response([omega], inputs, outputs)
    assert [risk.name for risk in lacking.risks if risk.invalidates] == ["shapes"]
    assert not lacking.trusted
    assert "add z = 2 to its modes" in lacking.warnings[0]
    assert (
        mstmm.compile(bar({"y": 2, "z": 2}, hinge))
        .frequency_response([omega], inputs, outputs)
        .trusted
    )


def test_the_static_compliance_is_missed_and_found_with_shapes() -> None:
    """L^3 / 3 EI of a cantilever."""
    found = [
        mstmm.compile(bar(modes)).frequency_response([1e-3], ["bar.tip.fz"], ["bar.tip.z"])
        for modes in ({"y": 2}, {"y": 2, "z": 4})
    ]
    assert abs(found[0].response[0, 0, 0]) < 1e-15
    assert not found[0].trusted
    assert np.abs(found[1].response[0, 0, 0]) == pytest.approx(1 / (3 * EI), rel=0.01)
    assert found[1].trusted


@pytest.mark.parametrize(
    ("hinge", "inputs", "outputs", "omega"),
    [
        ("fixed", ["bar.tip.fy"], ["bar.tip.y"], 1.0),
        ("fixed", ["bar.tip.fy", "bar.tip.fz"], ["bar.tip.y"], 10.0),
        ("fixed", ["bar.tip.fy"], ["bar.tip.z"], 10.0),  # zero with and without
        ("fixed", None, None, 10.0),  # the ground moves along all axes, coordinates of y answer
        ("pin", ["bar.tip.fz"], ["bar.tip.z"], 3.0),  # far below the first bending
    ],
)
def test_a_response_that_shapes_would_not_change_is_trusted(
    hinge: str, inputs: list[str] | None, outputs: list[str] | None, omega: float
) -> None:
    model = mstmm.compile(bar({"y": 2}, hinge))
    found = model.frequency_response([omega], inputs, outputs)
    assert found.trusted, found.warnings
