"""Arguments of the wrong kind get one clear message, never a raw error."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import mstmm

ROD = {"name": "r", "mass": 1.0, "center_of_mass": [0.5, 0, 0], "inertia": [0.001, 0.08, 0.08]}
PIN = {"name": "p", "type": "pin", "inboard": "ground", "outboard": "r"}


@pytest.fixture(scope="module")
def model() -> mstmm.Model:
    return mstmm.compile(mstmm.Scene(gravity=(0, -9.81, 0), body=[ROD], hinge=[PIN]), "looped")


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda _: mstmm.Scene.from_data([1], "x"), "x: expected a table of scene keys"),  # type: ignore[arg-type]
        (lambda _: mstmm.Scene.from_data(None), "scene: expected a table of scene keys"),  # type: ignore[arg-type]
        (lambda _: mstmm.Scene.from_data({1: 2}), "expected a table of scene keys"),  # type: ignore[dict-item]
        (lambda model: model.scene.check_types(3), "known_types: expected a table"),
        (lambda model: model.linearize().symbolic(3), "keep = 3: expected a list of names"),
        (lambda model: model.simulate(0.0).certificate.verdict("a"), "accuracy = 'a'"),
        (lambda model: model.simulate(0.0).certificate.verdict(0.1, "a"), "balance = 'a'"),
        (lambda _: mstmm.write_report(None, "x.html"), "report: expected a result"),  # type: ignore[arg-type]
    ],
)  # fmt: skip
def test_wrong_kinds_are_refused(
    model: mstmm.Model, call: Callable[[mstmm.Model], object], message: str
) -> None:
    with pytest.raises(mstmm.SceneError) as raised:
        call(model)
    assert message in str(raised.value)


def test_batches_of_no_states_have_no_derivatives(model: mstmm.Model) -> None:
    found = model.derivatives(np.zeros((0, 1)), np.zeros((0, 1)), parameters=["r.mass"])
    assert found.udot.shape == (0, 1) and found.q.shape == (0, 1, 1)
    assert found.parameters["r.mass"].shape == (0, 1)


@pytest.mark.parametrize(
    "body", [{"mass": 1e300}, {"mass": 1e100, "center_of_mass": [1e100, 0, 0]},
             {"inertia": [1e200, 1e200, 1e200]}],
)  # fmt: skip
def test_masses_whose_products_overflow_are_not_taken_for_none(body: dict[str, object]) -> None:
    with pytest.raises(mstmm.SceneError, match="above which products overflow"):
        mstmm.Scene(gravity=(0, 0, 0), body=[ROD | body], hinge=[PIN])
