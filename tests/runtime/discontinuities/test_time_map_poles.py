"""Poles of forces over time: runs end there by name, unless the integral of the force is finite."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.expression.expression import parse
from mstmm.runtime.discontinuities.active_expressions import ActiveExpression
from mstmm.runtime.discontinuities.time_map import TimeMap, time_map
from mstmm.runtime.integrate.c_loop import Status
from tests.support.scenes.results import motor

METHODS: list[tuple[str, dict[str, Any]]] = [
    ("pirk13", {}), ("pirk13", {"rtol": 1e-4}), ("dop853", {"rtol": 1e-3}), ("rk4", {"step": 0.01}),
    ("rodas5p", {"rtol": 1e-4}), ("genalpha", {"step": 0.01}), ("scipy-RK45", {"rtol": 1e-2}),
    ("scipy-BDF", {"rtol": 1e-2}), ("auto", {"rtol": 1e-3}),
]  # fmt: skip


def map_expression(text: str) -> TimeMap:
    return time_map([ActiveExpression(parse(text), "load")], 0.0, 1.0)


@pytest.mark.parametrize(("method", "options"), METHODS)
def test_no_method_passes_a_pole(method: str, options: dict[str, Any]) -> None:
    """The speed behind it would be -log(cos(pi t))/pi for t < 1/2, which has no limit."""
    run = mstmm.compile(motor("tan(pi*t)"), engine="looped").simulate(1.0, method, **options)
    assert not run.success and not run.trusted
    assert run.last_state[0] == pytest.approx(0.5, abs=1e-9) and run.last_state[0] < 0.5
    if run.status is Status.POLE:
        assert "hinge \"motor\" ('tan(pi*t)') is unbounded" in run.message


@pytest.mark.parametrize("engine", ["looped", "fused"])
def test_a_batch_ends_at_a_pole(engine: str) -> None:
    model = mstmm.compile(motor("tan(pi*t)"), engine=engine)
    start = np.zeros((3, 1)), np.array([[0.0], [1.0], [2.0]])
    batch = model.simulate_batch(start, t_end=1.0, rtol=1e-3, atol=1e-3, threads=1)
    assert not batch.success.any()
    assert all("is unbounded" in message for message in batch.messages)
    assert model.simulate_batch(start, t_end=0.3, threads=1).success.all()


def test_a_session_ends_at_a_pole() -> None:
    session = mstmm.compile(motor("tan(pi*t)"), engine="looped").session(method="rk4", step=0.01)
    session.advance(0.3)
    with pytest.raises(mstmm.errors.NumericalFailure, match="is unbounded"):
        session.advance(0.3)


@pytest.mark.parametrize("method", ["dop853", "pirk13"])
def test_a_force_whose_integral_is_finite_is_passed(method: str) -> None:
    scene = motor("1/sqrt(abs(t - 0.5))")
    run = mstmm.compile(scene, engine="looped").simulate(1.0, method, rtol=1e-6, atol=1e-6)
    inertia = 1 / 3
    assert run.success
    assert run.u[-1, 0] == pytest.approx(4 * np.sqrt(0.5) / inertia, rel=1e-4)


@pytest.mark.parametrize(
    ("text", "pole"),
    [
        ("tan(pi*t)", 0.5), ("1/(t - 0.3)", 0.3), ("1/(t - 0.3)^2", 0.3), ("(t - 0.3)^(-1)", 0.3),
        ("1/sin(5*t - 1)", 0.2), ("where(t < 0.5, 0, 1/(t - 0.5))", 0.5), ("t/(t - 0.25)", 0.25),
        ("abs(t - 0.5)^(-1.5)", 0.5),
    ],
)  # fmt: skip
def test_poles_are_found(text: str, pole: float) -> None:
    known = map_expression(text)
    assert known.pole is not None and known.pole[0] == pytest.approx(pole, abs=1e-9)
    assert known.pole[0] in known.breaks


@pytest.mark.parametrize(
    "text",
    [
        "1/sqrt(abs(t - 0.5))", "abs(t - 0.4)^(-2/3)", "sin(t - 0.5)/(t - 0.5)",
        "where(t < 0.4, tan(pi*t), 0)", "max(min(1/(t - 0.5), 5), -5)", "tan(pi*t)*cos(pi*t)",
        "1/(t^2 + 1e-9)", "where(t < 0.5, 0, 1e8)/(2 - t)", "1/(1e-4 + (t - 0.5)^2)",
        "atan(1/(t - 0.5))", "(t - 0.5)/abs(t - 0.5)", "log(abs(t - 0.5))",
    ],
)  # fmt: skip
def test_what_can_be_passed_is_no_pole(text: str) -> None:
    known = map_expression(text)
    assert known.pole is None and not known.notes


def test_a_pole_beside_the_motion_is_a_doubt() -> None:
    (note,) = map_expression("q*tan(pi*t)").notes
    assert note.name == "pole" and note.invalidates and "t = 0.5 s" in note.description
