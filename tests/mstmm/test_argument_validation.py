"""Arguments of a wrong kind are told by our messages, never by a traceback of Python's."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.errors import ElementError, SceneError

ROD = {"mass": 1.0, "center_of_mass": [0.5, 0, 0], "inertia": [0.01, 0.1, 0.1]}


@pytest.fixture(scope="module")
def result() -> Any:
    scene = mstmm.Scene(
        gravity=[0, -9.81, 0],
        body=[{"name": "rod", **ROD, "ends": {"tip": [1, 0, 0]}}],
        hinge=[{"name": "pivot", "type": "pin", "inboard": "ground", "outboard": "rod"}],
    )
    return mstmm.compile(scene, engine="looped").simulate(t_end=0.1)


THREE: Any = 3
OF_RESULTS: dict[str, tuple[Callable[[Any], Any], str]] = {
    "picture": (lambda r: r.plot("rod.x", path=3), "picture 3: expected the name of a file"),
    "title": (lambda r: r.plot("rod.x", title=3), "title = 3: expected a text"),
    "beside": (lambda r: r.plot("rod.x", beside=3), "beside: expected runs by their names"),
    "a run beside": (lambda r: r.plot("rod.x", beside={"a": 3}), '"a" = 3: expected a result'),
    "axes": (lambda r: r.plot("rod.x", ax=3), "ax = 3: expected axes of matplotlib"),
    "trails": (lambda r: r.view(trails=3), r"trails = 3: expected a list of names"),
    "report": (lambda r: r.report(3), "report 3: expected the name of a file"),
    "quantities": (lambda r: r.report("r.html", quantities=3), "quantities = 3: expected a list"),
    "file": (lambda r: r.save(3), "result file 3: expected the name of a file"),
    "simplify": (lambda r: mstmm.compile(r.model.scene, simplify=THREE), "simplify = 3: expected"),
    "certify": (lambda r: r.model.simulate(0.1, certify="yes"), "expected True or False"),
}

#: Where a word is expected, and what of it is said of anything else.
WORDS: dict[str, tuple[Callable[[Any, Any], Any], str]] = {
    "engine": (lambda r, x: mstmm.compile(r.model.scene, engine=x), "expected one of auto, fused"),
    "sweep": (lambda r, x: mstmm.compile(r.model.scene, sweep=x), "expected one of auto"),
    "accuracy": (lambda r, x: mstmm.compile(r.model.scene, accuracy=x), "a positive number"),
    "bake": (lambda r, x: mstmm.compile(r.model.scene, bake=x), "expected True or False"),
    "flexibility": (
        lambda r, x: mstmm.compile(r.model.scene, flexibility=x), "one of coupled, one-way, rigid",
    ),
    "method": (lambda r, x: r.model.simulate(0.1, x), "expected a name such as dop853"),
    "scheme": (
        lambda r, x: r.model.simulate(0.1, mstmm.methods.ClassicalDiscreteTime(scheme=x)),
        "scheme = .*: expected a name such as hht",
    ),
    "iterations": (
        lambda r, x: r.model.simulate(0.1, mstmm.methods.ClassicalDiscreteTime(iterations=x)),
        "iterations = .*: expected a whole number of iterations",
    ),
    "radius": (
        lambda r, x: r.model.simulate(0.1, mstmm.methods.GeneralizedAlpha(radius=x)),
        "radius = .*: expected a spectral radius from 0 to 1",
    ),
    "name of a method": (
        lambda r, x: r.model.simulate(0.1, mstmm.methods.Method(x)),
        "expected a name such as dop853",
    ),
    "tangent": (
        lambda r, x: r.model.simulate(0.1, mstmm.methods.Implicit(tangent=x)),
        "expected one of auto, exact, laws",
    ),
    "max_step": (
        lambda r, x: r.model.simulate(0.1, mstmm.methods.Method(max_step=x)),
        "max_step = .*: expected a time above zero",
    ),
    "max_steps": (
        lambda r, x: r.model.simulate(0.1, mstmm.methods.Method(max_steps=x)),
        "max_steps = .*: expected a whole number of steps",
    ),
    "error": (
        lambda r, x: r.model.simulate(0.1, error=mstmm.ErrorRequest(x)), "an error above zero"
    ),
    "of a target error": (
        lambda r, x: r.model.simulate(0.1, error=mstmm.ErrorRequest(1e-3, of=x)),
        "of = .*: expected a list of names",
    ),
    "execution": (lambda r, x: r.model.simulate(0.1, execution=x), "execution = .*: expected"),
    "on_risk": (
        lambda r, x: r.model.simulate(0.1, execution=mstmm.Execution(on_risk=x)),
        "expected one of warn, refuse",
    ),
    "progress": (
        lambda r, x: r.model.simulate(
            0.1, execution=mstmm.Execution(progress=3 if callable(x) else x)  # type: ignore[arg-type]
        ),
        "progress = .*: expected",
    ),
    "resume": (
        lambda r, x: r.model.simulate(0.1, execution=mstmm.Execution(resume=x)),
        "expected True or False",
    ),
    "checkpoint": (
        lambda r, x: r.model.simulate(0.1, execution=mstmm.Execution(checkpoint=x)),
        "expected the name of a file",
    ),
    "method of a session": (lambda r, x: r.model.session(method=x), "expected a name such as"),
    "tangent of a session": (
        lambda r, x: r.model.session(method=mstmm.methods.Implicit(tangent=x)),
        "expected one of auto",
    ),
    "damped": (lambda r, x: r.model.modes(damped=x), "expected True, False or None"),
    "parameters": (
        lambda r, x: r.model.derivatives([0.1], [0.0], parameters=x), "expected a list of names"
    ),
    "of": (lambda r, x: r.model.positions([0.1], x), "of = .*: expected a list of names"),
    "body": (lambda r, x: r.position(x), "expected the name of a body or an end"),
    "hinge": (lambda r, x: r.force(x), "expected the name of a hinge"),
    "hinge of efforts": (lambda r, x: r.effort(x), "expected the name of a hinge"),
    "kind": (lambda r, x: r.plot("rod.x", kind=x), "kind = .*: expected one of time"),
    "label": (lambda r, x: r.plot("rod.x", label=x), "label = .*: expected a text"),
    "keep": (lambda r, x: mstmm.equations(r.model.scene, keep=x), "keep = .*: expected a list"),
    "base": (lambda r, x: mstmm.import_robot("a.urdf", base=x), 'expected "fixed" or "free"'),
    "mimics": (lambda r, x: mstmm.import_robot("a.urdf", mimics=x), 'expected "coupled" or "held"'),
}  # fmt: skip


@pytest.mark.parametrize("name", OF_RESULTS)
def test_of_results_and_models(result: Any, name: str) -> None:
    call, message = OF_RESULTS[name]
    with pytest.raises(SceneError, match=message):
        call(result)


@pytest.mark.parametrize("given", [np.array([1.0, 2.0]), {"a": 1}, [3], object], ids=repr)
@pytest.mark.parametrize("name", WORDS)
def test_of_words(result: Any, name: str, given: Any) -> None:
    call, message = WORDS[name]
    with pytest.raises(SceneError, match=message):
        call(result, given)


def test_of_the_public_functions() -> None:
    for call, message in (
        (mstmm.load_result, "result file 3: expected the name of a file"),
        (mstmm.stability, "cases = 3: expected a list of names"),
        (mstmm.export_robot, "3: expected a Scene"),
        (mstmm.generate_file, "elements 3: expected the name of a file"),
    ):
        with pytest.raises(SceneError, match=message):
            call(THREE)
    with pytest.raises(ElementError, match=r"equations: expected .* found 3"):
        mstmm.equations(THREE)


def test_names_are_guessed_where_they_differ(result: Any) -> None:
    """What two names share, an owner or a file's ending, makes them no nearer."""
    with pytest.raises(SceneError, match=r'"rod.tipp".* did you mean "rod.tip.[xyz]"'):
        result.quantity("rod.tipp")
    with pytest.raises(SceneError, match=r'"rod.zzzz": .*; for example'):
        result.quantity("rod.zzzz")
    with pytest.raises(SceneError, match=r'did you mean "rod.mass"'):
        result.model.with_parameters({"rod.mas": 2.0})
