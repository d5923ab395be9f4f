"""What messages say of a method is true of it: its kind, its options, what may be taken instead."""

from __future__ import annotations

from functools import cache
from typing import Any

import pytest

import mstmm
from mstmm.errors import SceneError
from mstmm.runtime.integrate.c_loop import Failure, Status, failure_text
from mstmm.runtime.integrate.methods import ClassicalDiscreteTime, GeneralizedAlpha, Implicit
from mstmm.runtime.integrate.steppers import BUILT_IN, EXPLICIT, get
from mstmm.runtime.model.model import Model

ADAPTIVE = [method for method in BUILT_IN if get(method).adaptive]
FIXED = [method for method in BUILT_IN if not get(method).adaptive]


@cache
def runaway() -> Model:
    """u' = u^3 from u = 1 is infinite at t = 0.5 s."""
    hinge = {"name": "rail", "type": "prismatic", "axis": [1, 0, 0], "inboard": "ground",
             "outboard": "mass", "law": {"effort": "u^3"}, "initial": {"u": [1.0]}}  # fmt: skip
    body = {"name": "mass", "mass": 1.0}
    return mstmm.compile(
        mstmm.Scene(gravity=(0, 0, 0), body=[body], hinge=[hinge]), engine="looped"
    )


@pytest.mark.parametrize("method", ADAPTIVE)
def test_explicit_methods_alone_are_called_explicit(method: str) -> None:
    run = runaway().simulate(1.0, method)
    assert run.status is Status.STEP_TOO_SMALL and "the motion may be singular or" in run.message
    assert ("too stiff for an explicit method" in run.message) == (method in EXPLICIT)
    assert run.last_state[0] == pytest.approx(0.5, abs=1e-5)


@pytest.mark.parametrize("implicit", [False, True])
def test_no_end_in_sight(implicit: bool) -> None:
    text = failure_text(Failure(Status.TOO_MANY_STEPS, 1.0, None, None, 1), implicit=implicit)
    assert ("too stiff" in text) == (not implicit) and "sticks" in text


@pytest.mark.parametrize("method", FIXED)
def test_a_method_of_fixed_steps_names_one_of_its_kind(method: str) -> None:
    instead = "dopri5" if method in EXPLICIT else "genalpha"
    words = f'method "{method}" takes fixed steps: give step in s, or use {instead},'
    assert get(instead).adaptive
    with pytest.raises(SceneError, match=words):
        runaway().simulate(0.1, method)
    with pytest.raises(SceneError, match=words):
        runaway().simulate_batch(runaway().initial_state(), t_end=0.1, method=method)


WRONG: list[tuple[dict[str, Any], str]] = [
    ({"method": Implicit(tangent="foo")}, 'tangent = "foo": expected'),
    ({"method": Implicit("rodas4", tangent="laws")}, 'tangent = "laws": rodas4 has a low'),
    (
        {"method": Implicit("auto", tangent="exact")},
        'tangent = "exact": method "auto" has no tangent to choose',
    ),
    ({"method": "rodas6"}, 'method "rodas6" is not known'),
    ({"method": GeneralizedAlpha("rodas4", radius=0.5)}, 'method "rodas4" has no such parameter'),
    ({"method": "auto", "step": 0.1}, 'method "auto" chooses its steps'),
    ({"method": "scipy-RK45", "step": 0.1}, 'method "scipy-RK45" chooses its own steps'),
    ({"method": "dttmm-classical"}, 'method "dttmm-classical" takes fixed steps'),
    ({"method": ClassicalDiscreteTime(scheme="foo"), "step": 0.1}, 'scheme "foo" does not exist'),
]


@pytest.mark.parametrize("options, words", WRONG)
def test_options_are_quoted_in_one_way(options: dict[str, Any], words: str) -> None:
    with pytest.raises(SceneError) as refused:
        runaway().simulate(0.1, **options)
    assert words in str(refused.value) and " '" not in str(refused.value)


@pytest.mark.parametrize("option", ["engine", "sweep"])
def test_options_of_compile_are_quoted_alike(option: str) -> None:
    options: dict[str, Any] = {option: "foo"}
    with pytest.raises(SceneError, match=f'{option} "foo" is not known'):
        mstmm.compile(runaway().scene, **options)
