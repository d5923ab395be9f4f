"""Loads of constraints and couplings as results: what the bodies and speeds behind them need."""

from __future__ import annotations

import numpy as np
import pytest

import mstmm
from tests.reference.compare import worst
from tests.reference.jets import Array
from tests.support.models import compile_scene
from tests.support.scenes.constraints import GRAVITY, MASS, cycloid, disc, governor
from tests.support.scenes.gears import pair

TIMES = np.linspace(0.0, 0.3, 4)
UP = np.array([0.0, 0.0, GRAVITY])


def quantity(result: mstmm.Result, name: str) -> Array:
    return np.asarray(result.quantity(name).values)


def test_a_disc() -> None:
    """By Newton's law for its centre; load and friction lie along and across the normal."""
    result = disc().simulate(0.3, output_times=TIMES)
    wanted = MASS * (result.acceleration("disc") + UP)
    force = quantity(result, "road.force")
    assert worst(force, wanted) < 1e-11
    assert worst(quantity(result, "road.load"), wanted[:, 2]) < 1e-11
    assert worst(quantity(result, "road.friction"), np.linalg.norm(wanted[:, :2], axis=1)) < 1e-11
    assert worst(quantity(result, "road.force.x"), force[:, 0]) == 0


def test_a_bead() -> None:
    """Of a curve there are the force and the parameter."""
    result = compile_scene(cycloid(1.0)).simulate(0.3, output_times=TIMES)
    wanted = 0.3 * (result.acceleration("bead") + UP)
    assert worst(quantity(result, "wire.force"), wanted) < 1e-11
    assert worst(quantity(result, "wire.s"), result.q[:, 7]) == 0
    assert "wire.load" not in result.quantity_names()


def test_a_rod() -> None:
    """What a pair of rods puts on the sleeve of a governor, as a stiff spring in their place."""
    rigid, soft = (compile_scene(governor(rods)).simulate(0.3, rtol=1e-7, output_times=TIMES)
                   for rods in ("constraint", "spring"))  # fmt: skip
    rod, spring = quantity(rigid, "constraint1.load"), quantity(soft, "spring1.effort")
    weight = 2.0 * (rigid.acceleration("sleeve")[:, 2] + GRAVITY)
    both = quantity(rigid, "constraint1.force.z") + quantity(rigid, "constraint2.force.z")
    assert worst(both, weight) < 1e-10
    assert rod[0] < 0  # the rod pulls its ends together
    assert spring[0] == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("ratio", [3.0, -0.5])
def test_a_gear(ratio: float) -> None:
    """A torque on one wheel: what is left of it behind that wheel's own inertia goes through."""
    model = pair({"name": "mesh", "expression": f"A.q - {ratio!r}*B.q"}, a={"law": {"effort": 0.6}})
    result = model.simulate(0.3, output_times=TIMES)
    load = quantity(result, "mesh.load")
    of_a = quantity(result, "A.angle_acceleration")
    assert worst(load, 0.02 * of_a - 0.6) < 1e-12
    assert worst(-ratio * load, 0.3 * quantity(result, "B.angle_acceleration")) < 1e-12
    assert result.quantity("mesh.load").unit == ""
