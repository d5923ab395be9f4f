"""Mechanisms on their way to rest: past dead centres of what was independent, and not wound up."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

import mstmm
from mstmm.errors import NumericalFailure
from tests.support.models import compile_scene
from tests.support.scenes.linkages import COUPLER, CRANK, angles, four_bar, rod

GRAVITY, STIFFNESS = 9.81, 40.0
#: Of crank, coupler and rocker, kg.
MASSES = 0.7, 1.3, 0.9


def on_a_spring(start: float, rest: float) -> dict[str, Any]:
    """A four-bar with a spring on its crank, whose rocker is the first hinge of the scene."""
    scene = four_bar(start, laws={"foot": {"stiffness": STIFFNESS, "rest": rest}})
    scene["hinge"] = [scene["hinge"][-1], *scene["hinge"][:-1]]
    return scene


def energy(crank: float, rest: float) -> float:
    """Of the spring and of the weights, J."""
    coupler = angles(crank)[0]
    knee = CRANK * np.sin(crank)
    tip = knee + COUPLER * np.sin(coupler)
    heights = knee / 2, (knee + tip) / 2, tip / 2
    weights = GRAVITY * np.dot(MASSES, heights)
    return float(STIFFNESS * (crank - rest) ** 2 / 2 + weights)


@pytest.mark.parametrize("start, rest", [(1.5, 6.0), (0.9, 3.5)])
def test_the_rocker_turns_round_on_the_way(start: float, rest: float) -> None:
    """It is independent at the start, and tells nothing where crank and coupler are in line."""
    model = compile_scene(on_a_spring(start, rest))
    assert model.loops.independent_speeds == ("end.angle_rate",)
    found = model.equilibrium()
    names = list(model.coordinate_layout.hinges)
    crank, rocker = (float(found[names.index(name)]) for name in ("foot", "end"))
    wanted = minimize_scalar(energy, (crank - 0.1, crank + 0.1), args=(rest,), tol=1e-12).x
    assert abs(crank - wanted) < 1e-7
    assert abs(np.exp(1j * rocker) - np.exp(1j * angles(wanted)[1])) < 1e-7
    assert not found.unstable_speeds and max(map(abs, found.residuals.values())) < 1e-9


def five_bar(law: dict[str, float]) -> dict[str, Any]:
    """Two cranks of 0.5 m whose links of 1.2 m meet, one law for the second crank."""
    foot = [complex(0), complex(1)]
    cranks = [1.0, 1.0]
    knees = [x + 0.5 * np.exp(1j * q) for x, q in zip(foot, cranks, strict=True)]
    apart = knees[1] - knees[0]
    top = knees[0] + apart / 2 + 1j * apart / abs(apart) * np.sqrt(1.2**2 - abs(apart) ** 2 / 4)
    links = [float(np.angle(top - knee)) for knee in knees]
    hinges: list[dict[str, Any]] = []
    for k in range(2):
        hinges += [
            {"name": f"foot{k}", "type": "pin", "inboard": "ground", "outboard": f"crank{k}",
             "position": [foot[k].real, 0, 0], "initial": {"q": cranks[k]}},
            {"name": f"knee{k}", "type": "pin", "inboard": f"crank{k}.tip", "outboard": f"link{k}",
             "initial": {"q": links[k] - cranks[k]}},
        ]  # fmt: skip
    if law:
        hinges[2]["law"] = law
    top_pin = {"name": "top", "type": "pin", "inboard": "link0.tip", "outboard": "link1.tip",
               "initial": {"q": links[1] - links[0]}}  # fmt: skip
    bodies = [rod(f"{kind}{k}", length) for kind, length in (("crank", 0.5), ("link", 1.2))
              for k in range(2)]  # fmt: skip
    return {"gravity": [0, -GRAVITY, 0], "body": bodies, "hinge": [*hinges, top_pin]}


def test_hinges_come_to_rest_within_half_a_turn() -> None:
    """Its way down winds three hinges up, which nothing counts."""
    model = compile_scene(five_bar({}))
    start = model.initial_state()[0]
    found = model.equilibrium()
    assert np.abs(found - start).max() <= np.pi
    assert max(map(abs, found.residuals.values())) < 1e-9


def test_turns_that_something_counts_stay() -> None:
    """A spring of 1e-6 N m/rad moves next to nothing, and has a turn of its own."""
    model = compile_scene(five_bar({"stiffness": 1e-6}))
    free = compile_scene(five_bar({}))
    wound, found = model.equilibrium(), free.equilibrium()
    place = list(model.coordinate_layout.hinges).index("foot1")
    turns = (wound[place] - found[place]) / (2 * np.pi)
    assert abs(turns - round(turns)) < 1e-5 and abs(turns) > 0.5


def test_a_coordinate_alone_resonates_by_name() -> None:
    """One coordinate has no condition beside itself, but what cancels in it."""
    model = compile_scene(on_a_spring(0.9, 1.0))
    linear = model.linearize(inputs=["foot.effort"])
    omega = linear.modes().omega[0] * (1 + 2e-16 * np.arange(3))
    for one in omega:
        with pytest.raises(NumericalFailure, match="undamped resonance"):
            linear.frequency_response([one])
    near = linear.frequency_response([omega[0] * (1 + 1e-6)]).magnitude[0, 0, 0]
    assert 1e3 < near < 1e7


def test_bodies_alone_carry_a_motion() -> None:
    modes = compile_scene(on_a_spring(0.9, 1.0)).modes()
    assert set(modes.kinetic_energy_shares()) == {"crank", "coupler", "rocker"}


def test_a_saddle_is_told() -> None:
    """Two rods upright, and one upright on one that hangs."""
    scene = mstmm.Scene(
        gravity=[0, -GRAVITY, 0], body=[rod("upper", 1.0), rod("lower", 1.0)],
        hinge=[{"name": "shoulder", "type": "pin", "inboard": "ground", "outboard": "upper"},
               {"name": "elbow", "type": "pin", "inboard": "upper.tip", "outboard": "lower"}],
    )  # fmt: skip
    model = mstmm.compile(scene, engine="looped")
    hanging, upright = [-np.pi / 2, 0.0], [np.pi / 2, 0.0]
    assert model.equilibrium(hanging).unstable_speeds == ()
    assert model.equilibrium(upright).unstable_speeds == ("shoulder.angle_rate", "elbow.angle_rate")
    assert "elbow.angle_rate" in model.equilibrium([-np.pi / 2, np.pi]).unstable_speeds
