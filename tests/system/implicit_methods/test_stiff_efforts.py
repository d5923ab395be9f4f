"""Efforts whose slope is infinite where a run begins: what implicit methods do, on both engines."""

from __future__ import annotations

import re
from functools import cache

import pytest

import mstmm
from mstmm.expression.derivatives import expression_derivatives
from mstmm.expression.expression import parse
from mstmm.runtime.integrate.c_loop import Status
from mstmm.runtime.integrate.steppers import IMPLICIT, get
from mstmm.runtime.model.model import Model

#: They linearise where a step begins; the others iterate, and do with the slopes of inertia there.
LINEAR = ["rodas4", "rodas4p2", "rodas5p", "ros34pw2", "rodas4pw", "exprb32"]
ITERATED = [
    "esdirk436", "kvaerno5", "genalpha", "hht", "newmark", "wilson", "houbolt", "genalpha-index3",
    "hht-index3",
]  # fmt: skip
ENGINES = ["looped", "fused"]


@cache
def carriage(effort: str, engine: str) -> Model:
    """1 kg at rest on a rail."""
    hinge = {"name": "rail", "type": "prismatic", "axis": [1, 0, 0], "inboard": "ground",
             "outboard": "mass", "law": {"effort": effort}}  # fmt: skip
    body = {"name": "mass", "mass": 1.0}
    return mstmm.compile(mstmm.Scene(gravity=(0, 0, 0), body=[body], hinge=[hinge]), engine=engine)


def step(method: str) -> float | None:
    return None if get(method).adaptive else 0.01


def test_every_implicit_method_is_asked() -> None:
    assert sorted([*LINEAR, *ITERATED, "dttmm"]) == sorted(IMPLICIT)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("method", [*LINEAR, "dttmm"])
@pytest.mark.parametrize("effort, name", [("-sqrt(abs(u))", "u"), ("q^0.5", "q")])
def test_the_expression_is_named(effort: str, name: str, method: str, engine: str) -> None:
    run = carriage(effort, engine).simulate(0.1, method)
    assert run.status is Status.TANGENT_FAILED and run.last_state[0] == 0.0
    words = (
        f'hinge "rail": law.effort[0] = "{effort}" has no finite derivative with respect to {name} '
        "at t = 0 s"
    )
    assert words in run.message and "between bodies" not in run.message


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("method", LINEAR)
def test_a_slope_in_time_is_named(method: str, engine: str) -> None:
    run = carriage("1 - sqrt(t)", engine).simulate(0.1, method)
    assert (
        not run.success
        and '"1 - sqrt(t)" has no finite derivative with respect to t' in run.message
    )


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("method", ITERATED)
@pytest.mark.parametrize("effort", ["-sqrt(abs(u))", "q^0.5", "1 - sqrt(abs(u))"])
def test_iterations_do_without_the_slope(effort: str, method: str, engine: str) -> None:
    """Left alone the carriage stays; pulled it goes as one that starts by 1 N, at no slope."""
    run = carriage(effort, engine).simulate(0.1, method, step(method), output_times=[0.1])
    assert run.success, run.message
    # u' = 1 - sqrt(u): t = -2 sqrt(u) - 2 log(1 - sqrt(u))
    expected = 0.0805484 if effort.startswith("1") else 0.0
    assert run.u[-1, 0] == pytest.approx(expected, abs=1e-3)


@pytest.mark.parametrize("method", ["dop853", "auto"])
def test_explicit_methods_ask_for_no_slope(method: str) -> None:
    run = carriage("1 - sqrt(abs(u))", "looped").simulate(0.1, method)
    assert run.success and run.u[-1, 0] == pytest.approx(0.0805484, abs=1e-6)


@pytest.mark.parametrize(
    "text, expected",
    [("sqrt(q)*2 + t", [0.25 * 2, 1.0]), ("q^2*t", [8.0 * 0.5, 16.0]), ("abs(t - q)", [1.0, -1.0])],
)
def test_slopes_are_those_of_the_mathematics(text: str, expected: list[float]) -> None:
    found = expression_derivatives(parse(text), lambda name: {"q": 4.0, "t": 0.5}[name.text])
    by_name = {name.text: slope for name, slope in found.items()}
    assert [by_name["q"], by_name["t"]] == pytest.approx(expected, rel=1e-15)


def test_a_spring_is_named() -> None:
    spring = {"name": "band", "from": "ground", "to": "mass", "law": {"effort": "sqrt(q - 1)"}}
    data = carriage("0", "looped").scene.model_dump(by_alias=True, exclude_unset=True)
    data["hinge"][0]["initial"] = {"q": [1.0]}
    model = mstmm.compile(mstmm.Scene.from_data(data | {"spring": [spring]}), engine="looped")
    run = model.simulate(0.1, "rodas4p2")
    assert re.search(r'spring "band": law.effort = "sqrt\(q - 1\)" has no finite derivative',
                     run.message)  # fmt: skip
