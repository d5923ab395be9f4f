"""The Jacobian that SciPy's implicit methods get: exact where it can be, finite in any case."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

import mstmm
from mstmm.runtime.engine import jacobian
from mstmm.runtime.run.event_location import Equations
from tests.support.scenes.results import motor, pins, tree

Array = NDArray[np.float64]


def equations(scene: mstmm.Scene) -> tuple[Equations, Array]:
    """The equations of a scene and a state with every speed different from zero."""
    model = mstmm.compile(scene)
    found = Equations(model)
    q, u = model.initial_state()
    return found, found.scene.start(0.0, q, u + 0.1 * np.arange(1, model.nu + 1))


def with_spring(scene: mstmm.Scene, stiffness: float) -> mstmm.Scene:
    """Two pins without gravity, a spring from the first rod's foot to the tip of the second."""
    data = scene.model_dump(by_alias=True, exclude_unset=True) | {"gravity": (0, 0, 0)}
    data["hinge"][0]["initial"] = {"q": [0.0], "u": [1.0]}
    data["hinge"][1]["initial"] = {"q": [0.6], "u": [3.0]}
    law = {"stiffness": stiffness, "rest": 1.0}
    data["spring"] = [{"name": "band", "from": "rod0", "to": "rod1.tip", "law": law}]
    return mstmm.Scene.from_data(data)


SCENES = {
    "pins": pins(3, [0.3, 0.4, 0.5]),
    "springs, dampers, a ball": tree(),
    "a spring": with_spring(pins(2, [0.0, 0.6]), 100.0),
    "an effort of time and state": motor("sin(3*t) - u[0]^2 + cos(q[0])"),
}


@pytest.mark.parametrize("name", SCENES)
def test_the_exact_jacobian_is_the_differenced_one(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Along every component of q, u and the work, quaternions off the sphere included."""
    exact, y = equations(SCENES[name])
    found = exact.jacobian(0.2, y)
    monkeypatch.setattr(jacobian, "MAX_BODIES", 0)
    differenced, _ = equations(SCENES[name])
    expected = differenced.jacobian(0.2, y)
    assert found.shape == (len(y), len(y)) and np.abs(found).max() > 0.1
    np.testing.assert_allclose(found, expected, atol=3e-8 * np.abs(expected).max())
    assert exact.evaluations == 0 and differenced.evaluations == 2 * len(y)


def test_releases_are_differenced_with_the_memory_of_the_moment() -> None:
    hinge = {"name": "lock", "type": "pin", "inboard": "ground", "outboard": "rod0",
             "drive": "0.5*sin(3*t)", "release": "t >= 1"}  # fmt: skip
    data = pins(1, [0.3]).model_dump(by_alias=True, exclude_unset=True) | {"hinge": [hinge]}
    found, y = equations(mstmm.Scene.from_data(data))
    y[0] = 0.5
    driven = found.jacobian(2.0, y)
    found.scene.memory[0] = 1.0
    assert not driven[:2].any() and found.jacobian(2.0, y)[1, 0] != 0.0


def test_where_a_derivative_does_not_exist_it_is_differenced() -> None:
    """The square root's slope at 0 is infinite."""
    found, y = equations(motor("sqrt(abs(q[0]))"))
    y[0] = 0.0
    assert np.isfinite(found.jacobian(0.0, y)).all() and found.evaluations > 0


def test_hundreds_of_jacobians_along_a_coordinate_that_does_not_matter() -> None:
    """Nothing depends on the first angle: increments that grow until a difference shows overflow
    after some 300 Jacobians."""
    model = mstmm.compile(with_spring(pins(2, [0.0, 0.6]), 100.0))
    expected = model.simulate(20.0, output_times=[20.0], rtol=1e-11)
    run = model.simulate(20.0, method="scipy-Radau", output_times=[20.0], rtol=1e-5, atol=1e-8)
    assert run.success, run.message
    np.testing.assert_allclose(run.q, expected.q, atol=0.5)
