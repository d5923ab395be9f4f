"""The comparison of scenes with few settings: mstmm, and the methods of SciPy."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mstmm
from benchmarks.scene_suite import peers
from benchmarks.scene_suite.__main__ import DOCS, main
from benchmarks.scene_suite.cases import CASES, TREES
from benchmarks.scene_suite.comparison import (
    OWN,
    TARGET_ERRORS,
    Limits,
    compare,
    evaluate_curve,
    recommended_points,
    time_fronts,
)
from benchmarks.scene_suite.mstmm_runs import OwnRuns, survey_case
from benchmarks.scene_suite.report import page
from benchmarks.stiff.programs import Curve
from mstmm.errors import MstmmError
from mstmm.runtime.experiments.chart.chart_record import Point, Reference, bound_errors
from mstmm.runtime.experiments.trial import Setting
from tests.support.paths import ROOT

FOLDER = ROOT / "benchmarks" / "scene_suite"
REFERENCE = Reference(1e-12, "two runs", "looped", "a place", "m", "none")


def ignore_message(_: str) -> None:
    """Drop a message."""


@cache
def arm() -> dict[str, Any]:
    """Comparison of the arm by mstmm and SciPy with few settings."""
    result: dict[str, Any] = compare(
        CASES["arm"], Limits(300.0, 300.0, 1, 8, ("dop853", "rodas4p2")), True, ignore_message
    )
    return result


def test_the_eight_scenes_run_and_end_where_they_are_watched() -> None:
    assert list(CASES) == [
        "arm", "balls", "chain", "bushings", "springs", "pendulum", "spin-up", "satellite",
    ]  # fmt: skip
    assert set(TREES) < set(CASES)
    for case in CASES.values():
        model = mstmm.compile(mstmm.Scene(**case.scene()), engine="looped")
        result = model.simulate(1e-3 * case.t_end, rtol=1e-4, atol=1e-6)
        assert result.success, case.name
        assert np.isfinite(result.position(case.end_names[-1])).all()


def test_a_scene_beside_scipy() -> None:
    result = arm()
    assert {OWN, "SciPy Radau", "SciPy DOP853"} <= set(result["fronts"])
    assert result["reference"]["error"] < 1e-9
    best = result["recommended"][f"{TARGET_ERRORS[0]:g}"]
    own = best["tools"][OWN]
    assert own["error_bound_m"] <= TARGET_ERRORS[0]
    assert own["error_m"] <= own["error_bound_m"]
    met = {tool: p for tool, p in best["tools"].items() if tool != OWN and "cpu_ms" in p}
    assert best["best_peer"] == min(met, key=lambda tool: met[tool]["cpu_ms"])
    assert best["ratio"] == pytest.approx(own["cpu_ms"] / met[best["best_peer"]]["cpu_ms"])


def test_errors_of_a_peer_are_distances_from_the_reference() -> None:
    """Positions at the end of a run are compared with those of the reference of mstmm."""
    exact = np.array([1.0, 2.0, 3.0])
    own_runs = OwnRuns({}, REFERENCE, exact, [], [])

    def run(off: float) -> Any:
        return lambda: (lambda: (exact + np.array([0.0, off, 0.0]))[None], {})

    offs = (1e-2, 1e-5, 1e-9, 1e-9, 1e-9)
    curve = Curve("tool", "manner", [(10.0**-i, run(off)) for i, off in enumerate(offs)])
    points = [point for _, (point, _) in evaluate_curve(curve, own_runs, Limits())]
    assert [p.error for p in points] == pytest.approx(offs[:4])  # the second that nobody asks for

    def gives_up() -> Any:
        raise RuntimeError("too stiff")

    ((_, (failed, _)),) = evaluate_curve(Curve("tool", "", [(1.0, gives_up)]), own_runs, Limits())
    assert failed.failure == "too stiff"


def test_the_best_peer_is_the_cheapest_that_is_as_accurate() -> None:
    def front(tool: str, *points: tuple[float, float]) -> list[Point]:
        points_of_tool = [
            Point(Setting(tool, "m", 10.0**-i), error, spent, 1)
            for i, (error, spent) in enumerate(points)
        ]
        return list(bound_errors(points_of_tool, REFERENCE))

    fronts = {
        OWN: front("dop853", (1e-5, 2e-3)), "quick": front("quick", (1e-3, 1e-4)),
        "good": front("good", (1e-2, 1e-3), (1e-6, 4e-3)), "slow": front("slow", (1e-7, 1.0)),
    }  # fmt: skip
    recommended = recommended_points(fronts, 1e-4, REFERENCE)
    assert (recommended["best_peer"], recommended["ratio"]) == ("good", 0.5)
    assert "missed" in recommended["tools"]["quick"]
    none = recommended_points({OWN: fronts[OWN]}, 1e-4, REFERENCE)
    assert none["best_peer"] is None and none["ratio"] is None


def test_everybody_is_timed_once_in_every_round() -> None:
    points = [Point(Setting(name, "m", 1.0), 1e-3, 5.0, 1) for name in ("a", "b")]
    order: list[str] = []

    def call(name: str) -> Any:
        return lambda: order.append(name)

    calls = {p.setting: call(p.method) for p in points}
    timed = time_fronts({"A": points[:1], "B": points[1:]}, calls, 3)
    firsts = [name for i, name in enumerate(order) if not i or order[i - 1] != name]
    assert firsts == ["a", "b"] * 4  # and one round to warm up
    assert all(p.repeats == 3 and (p.cpu_s or 9) < 5 for some in timed.values() for p in some)


def test_who_has_no_such_scene_is_told() -> None:
    messages: list[str] = []
    case = CASES["springs"]
    model = mstmm.compile(mstmm.Scene(**case.scene()), engine="looped")
    tools = {curve.tool for curve in peers.case_curves(model, case, messages.append)}
    assert {"SciPy Radau", "SciPy DOP853"} <= tools
    assert any("springs in six directions" in text for text in messages)


def test_the_command_writes_its_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("benchmarks.scene_suite.__main__.compare", lambda *_: arm())
    main(["arm", "--quick", "--out", str(tmp_path)])
    assert {path.name for path in tmp_path.iterdir()} == {"result.json", "result.md", "result.png"}
    text = (tmp_path / "result.md").read_text()
    assert "| arm | 1e-04 m |" in text
    stored = json.loads((tmp_path / "result.json").read_text())
    assert stored["results"][0]["case"] == "arm"
    with pytest.raises(SystemExit):
        main(["leg"])


def test_no_reference_within_the_time_is_an_error() -> None:
    with pytest.raises(MstmmError, match="no reference was found"):
        survey_case(CASES["arm"], 1e-6, ignore_message)


def test_the_kept_results_are_whole() -> None:
    """All eight scenes, each with a setting and a ratio for both errors; the pages say the same."""
    record = json.loads((FOLDER / "result.json").read_text())
    assert (FOLDER / "result.md").read_text() == page(record, "result.png")
    assert (DOCS / "benchmarks" / "scene-comparison.md").read_text() == page(
        record, "../images/standing.png"
    )
    stored = record["results"]
    assert [result["case"] for result in stored] == list(CASES)
    for result in stored:
        for target_error in TARGET_ERRORS:
            recommended = result["recommended"][f"{target_error:g}"]
            assert recommended["tools"][OWN]["error_bound_m"] <= target_error
            assert recommended["best_peer"] is None or recommended["ratio"] > 0
