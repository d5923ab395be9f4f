"""What runs warn of: kept with their points, told with what is recommended, and heeded."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import pytest

import mstmm
from mstmm.errors import NumericalFailure, SceneError
from mstmm.runtime.experiments.chart.chart import Chart
from mstmm.runtime.experiments.chart.chart_record import (
    Point,
    bound_errors,
    pareto_front,
    recommend,
    split_warnings,
)
from mstmm.runtime.experiments.chart.tables import point_table, recommendation
from mstmm.runtime.experiments.trial import Setting
from tests.runtime.experiments.chart.test_chart_record import REFERENCE
from tests.support.paths import EXAMPLES
from tests.support.scenes.chart import pendulum, stiff_rods

#: Fastest motion of the damped bushing, 1/s, and a run of which a thousandth is a step of rk4 that
#: is just stable (h times it is 2.6 of 2.785) and a 316th one that is not.
FASTEST = 5e5
T_END = 2.6 * 1000 / FASTEST
STABLE = 2.785 / FASTEST


@cache
def bushing_chart() -> Chart:
    """Chart of a bushing so damped that most of rk4's steps are too long."""
    return mstmm.chart(stiff_rods(1e4), T_END, methods=["rk4", "rodas4p2"], rounds=0, budget=300)


def test_warnings_are_those_of_the_run() -> None:
    model = mstmm.compile(stiff_rods(1e4), engine="looped")
    ran = [point for point in bushing_chart().points if point.error is not None]
    for point in ran:
        result = model.simulate(T_END, output_times=[0.0, T_END], **point.setting.options)
        step = result.certificate.step_stability
        assert point.is_too_coarse == (step is not None and step.risk is not None)
        assert not point.is_too_coarse or "too long for the fastest motion" in " ".join(
            point.warnings
        )
    rk4 = [p for p in ran if p.method == "rk4"]
    assert [p.setting.value for p in rk4 if p.is_too_coarse]
    assert pytest.approx(5.2e-6) in [p.setting.value for p in rk4 if not p.is_too_coarse]
    assert all(p.is_too_coarse == (p.setting.value > STABLE) for p in rk4)
    assert not [point for point in bushing_chart().pareto_front if point.is_too_coarse]


def test_warnings_stand_beside_their_points() -> None:
    chart = bushing_chart()
    warned = next(p for p in chart.points if p.warnings and p.error)
    assert (
        f"warning: {warned.warnings[0]}"
        in [row[-1] for row in point_table(chart)[2]][chart.points.index(warned)]
    )
    page = chart.to_html()
    assert page.count("warning: ") > len(
        [p for p in chart.points if p.warnings]
    )  # pointer and table


def test_a_step_that_is_too_long_is_never_recommended() -> None:
    """However near the run came."""
    lucky = Point(Setting("rk4", "m", 0.1, True), 1e-6, 1e-4, 1, is_too_coarse=True)
    slow = Point(Setting("dop853", "m", 1e-6), 1e-6, 1e-3, 1)
    found = bound_errors([lucky, slow], REFERENCE)
    assert [p.method for p in pareto_front(found)] == ["dop853"]
    assert recommend(found, 1e-3, REFERENCE).method == "dop853"
    with pytest.raises(NumericalFailure, match="fixed step too long for the fastest motion"):
        recommend(found[:1], 1e-3, REFERENCE)


def test_what_is_recommended_is_told_with_its_warnings() -> None:
    chart = mstmm.chart(pendulum(), 1.0, methods=["dop853"], samples=11, rounds=0, budget=300)
    best = chart.recommend()
    other = replace(best, warnings=("beware",))
    shown = [other if p is best else p for p in chart.points]
    changed = replace(chart, points=tuple(shown))
    assert recommendation(changed).endswith("; warning: beware")
    assert "warning: beware" in changed.to_html()


def test_what_the_scene_warns_of_is_told_once() -> None:
    chart = replace(bushing_chart(), warnings=("a body is hollow",))
    assert chart.to_html().count("a body is hollow") == 1
    assert chart.to_dict()["warnings"] == ["a body is hollow"]


def test_what_every_run_warns_of_is_told_once() -> None:
    """Of a panel whose highest shape is too short for a beam no setting is to blame."""
    scene = mstmm.load_scene(EXAMPLES / "satellite_panels" / "scene.toml")
    made = mstmm.chart(scene, 0.05, methods=["dop853"], samples=3, rounds=0, budget=300)
    assert len([text for text in made.warnings if "too short for a beam" in text]) == 1
    assert not [text for p in made.points for text in p.warnings if "too short" in text]
    assert len(made.points) > 1


def test_what_some_runs_warn_of_stays_with_them() -> None:
    some = [
        Point(Setting("a", "m", 10.0**-i), 1e-3, 1.0, 1, warnings=texts)
        for i, texts in enumerate((("x", "all"), ("all", "y"), ("all",)))
    ]
    found, common = split_warnings([*some, Point(Setting("a", "m", 1.0), failure="no")])
    assert common == ("all",)
    assert [p.warnings for p in found] == [("x",), ("y",), (), ()]
    assert split_warnings(some[:1]) == ((some[0],), ())


def test_a_run_that_an_event_ends_is_told() -> None:
    scene = pendulum()
    stop = mstmm.Scene(
        gravity=scene.gravity, body=[b.model_dump(by_alias=True) for b in scene.body],
        hinge=[{"name": "pivot", "type": "pin", "inboard": "ground", "outboard": "bob",
                "initial": {"q": [0.0]}}],
        event=[{"name": "low", "when": "bob.tip.y < -0.5", "do": "stop"}],
    )  # fmt: skip
    said: list[str] = []
    made = mstmm.chart(
        stop, 3.0, methods=["dop853", "rk4"], rounds=0, budget=300, state=said.append
    )
    assert 'stopped by event "low" at t = 0.328' in made.reference.stop_event
    assert any("runs end before 3 s" in text for text in said)
    assert "Runs end before 3 s: stopped by event" in made.to_html()
    assert made.to_dict()["reference"]["ended"] == made.reference.stop_event
    assert made.sampling_text.startswith("101 equidistant times up to 0.328")
    assert all(p.error is not None for p in made.points if p.method == "dop853")


def test_arguments_that_say_nothing() -> None:
    with pytest.raises(SceneError, match=r"methods = \[\]: expected one or more names"):
        mstmm.chart(pendulum(), 1.0, methods=[])
    for error in ("a", True, float("inf"), [1e-3]):
        with pytest.raises(SceneError, match=r"error = .*: expected a number above 0"):
            bushing_chart().recommend(error)  # type: ignore[arg-type]


def test_no_reference_for_other_reasons_than_time() -> None:
    """A pendulum whose support is pulled away at a speed beyond all numbers."""
    scene = mstmm.Scene(
        gravity=[0, -9.81, 0], body=[b.model_dump(by_alias=True) for b in pendulum().body],
        hinge=[{"name": "pivot", "type": "pin", "inboard": "ground", "outboard": "bob",
                "law": {"effort": "1/(0.5 - t)"}}],
    )  # fmt: skip
    with pytest.raises(NumericalFailure, match="no reference was found: ") as failure:
        mstmm.chart(scene, 1.0, methods=["dop853"], rounds=0, budget=300)
    assert "budget" not in str(failure.value)
