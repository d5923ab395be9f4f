"""Risks are rows of one kind, and a run does about them what it is asked to."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.risk import RUN, Risk, from_rows, order_risks, sentences, to_rows
from tests.support.scenes.results import motor, pins, rod

#: A fixed step at which the fastest motion is followed badly but stays bounded.
COARSE: dict[str, Any] = {"method": "rk4", "step": 0.2}


def damped_rod_model() -> mstmm.Model:
    """One rod whose damper a step of 0.02 s is too long for."""
    return mstmm.compile(motor("0", damping=100.0))


def swinging() -> mstmm.Model:
    return mstmm.compile(pins(1, [0.3]))


# --- rows -----------------------------------------------------------------------------------------


def test_a_row_reads_as_a_sentence_and_comes_back_from_plain_data() -> None:
    risk = Risk("gimbal", 'hinge "a"', "it is near", "use a ball", 1e-4, 1e-3)
    assert str(risk) == "it is near; use a ball"
    assert from_rows(to_rows([risk])) == (risk,)
    assert sentences([risk, risk]) == ("it is near; use a ball",)


def test_numbers_of_rows_are_plain() -> None:
    risk = Risk("a", RUN, "b", "c", np.float64(1.5), np.float32(1.0), "rad")  # type: ignore[arg-type]
    assert type(risk.value) is float and type(risk.limit) is float
    run = swinging().simulate(5.0, method="genalpha", step=0.3)
    assert {risk.name for risk in run.risks} == {"step-accuracy", "energy-drift"}
    for risk in run.risks:
        assert type(risk.value) is float and type(risk.limit) is float
        assert risk.element and risk.remedy and risk.unit == "1"


def test_what_a_body_s_model_lacks_has_its_way_out_apart() -> None:
    beam = {"name": "boom", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": 1e3,
            "basis": "static+fixed-interface", "modes": {"y": 1}}  # fmt: skip
    hold = {"name": "hold", "type": "fixed", "inboard": "ground", "outboard": "boom"}
    scene = mstmm.Scene(gravity=(0, -9.81, 0), beam=[beam], hinge=[hold])
    (risk,) = (r for r in mstmm.compile(scene).simulate(0.1).risks if r.name == "body-model")
    assert risk.remedy == "give 2 or more" and "cannot represent" in risk.description


@pytest.mark.parametrize("wrong", [{"name": 1}, {"figure": "much"}, {"colour": "red"}])
def test_rows_of_another_kind_are_not_taken(wrong: dict[str, Any]) -> None:
    with pytest.raises(TypeError):
        from_rows([{"name": "a", "element": "", "means": "b", "remedy": "c"} | wrong])


def test_what_the_run_has_seen_stands_for_what_was_seen_before() -> None:
    early = Risk("pivot-loss", 'hinge "a"', "soon", "mend it", seen_before_run=True)
    other = Risk("pivot-loss", 'hinge "b"', "soon", "mend it", seen_before_run=True)
    late = Risk("pivot-loss", 'hinge "a"', "now", "mend it")
    advice = Risk("stiff", RUN, "slow", "be patient", invalidates=False)
    assert order_risks([advice, early, other, late, late]) == (other, late, advice)


# --- what is done about them ----------------------------------------------------------------------


def test_a_run_is_refused_before_it_is_made(monkeypatch: pytest.MonkeyPatch) -> None:
    model = damped_rod_model()

    def refuse_run(*_: Any) -> None:
        raise AssertionError("a run was made")

    monkeypatch.setattr("mstmm.runtime.experiments.run_results.first_run", refuse_run)
    with pytest.raises(mstmm.RiskRefused, match=r"before the run:\n  step-stability: step") as seen:
        model.simulate(1.0, method="rk4", step=0.05, execution=mstmm.Execution(on_risk="refuse"))
    (risk,) = seen.value.risks
    assert (risk.name, risk.element, risk.seen_before_run) == (
        "step-stability",
        'hinge "motor"',
        True,
    )
    assert risk.value > risk.limit and "use a step below" in risk.remedy
    assert seen.value.result is None
    assert isinstance(seen.value, mstmm.NumericalFailure)


def test_a_run_that_is_refused_behind_its_end_is_kept() -> None:
    model = swinging()
    told = model.simulate(5.0, **COARSE)
    assert [risk.name for risk in told.risks] == ["energy-drift"]
    with pytest.raises(mstmm.RiskRefused, match=r"in the result:\n  energy-drift: ") as seen:
        model.simulate(5.0, **COARSE, execution=mstmm.Execution(on_risk="refuse"))
    kept = seen.value.result
    np.testing.assert_array_equal(kept.q, told.q)
    assert kept.risks == told.risks == seen.value.risks


def test_a_wanted_error_that_is_not_reached_is_refused() -> None:
    with pytest.raises(mstmm.RiskRefused, match="wanted-error") as seen:
        mstmm.compile(pins(3, [1.0, 2.0, -1.0])).simulate(
            60.0, error=1e-9, execution=mstmm.Execution(on_risk="refuse")
        )
    assert seen.value.result.achieved_error is not None


def test_what_is_only_worth_knowing_refuses_nothing() -> None:
    model = mstmm.compile(pins(1, [7.0]))
    run = model.simulate(1.0, execution=mstmm.Execution(on_risk="refuse"))
    (risk,) = run.risks
    assert (risk.name, risk.element, risk.invalidates) == ("degrees", 'hinge "pin0"', False)
    assert run.warnings == (str(risk),)


def test_a_scene_that_speaks_against_itself_is_refused() -> None:
    short = {"name": "b", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": 1e3,
             "axial_stiffness": 1e5}  # fmt: skip
    wall = {"name": "wall", "type": "fixed", "inboard": "ground", "outboard": "b"}
    model = mstmm.compile(mstmm.Scene(gravity=(0, 0, 0), beam=[short], hinge=[wall]))
    with pytest.raises(mstmm.RiskRefused, match="short-beam"):
        model.simulate(0.1, execution=mstmm.Execution(on_risk="refuse"))
    assert "short-beam" in {risk.name for risk in model.simulate(0.1).risks}


def test_ignored_risks_are_not_told_and_do_not_make_a_run_trusted(tmp_path: Path) -> None:
    run = swinging().simulate(
        5.0, **COARSE, certify=True, execution=mstmm.Execution(on_risk="ignore")
    )
    assert run.warnings == ()
    assert [risk.name for risk in run.risks] == ["energy-drift"]
    assert not run.trusted
    again = mstmm.load_result(run.save(tmp_path / "run.nc"))
    assert again.warnings == () and again.risks == run.risks


def test_a_failed_run_comes_back_whatever_its_risks() -> None:
    run = mstmm.compile(motor("exp(u[0])^3", speed=1.0)).simulate(
        1.0, execution=mstmm.Execution(on_risk="refuse")
    )
    assert not run.success


def test_another_word_is_named() -> None:
    with pytest.raises(mstmm.SceneError, match="on_risk = 'stop': expected one of warn, refuse"):
        swinging().simulate(1.0, execution=mstmm.Execution(on_risk="stop"))


def test_a_clean_run_has_none() -> None:
    run = swinging().simulate(2.0, execution=mstmm.Execution(on_risk="refuse"))
    assert run.risks == () and run.warnings == ()


def test_a_saved_result_has_the_same(tmp_path: Path) -> None:
    """What only the run knew, and what its file makes again."""
    pulse = {"on": "rod0", "force": [0, "exp(-((t - 0.5)/0.001)^2)", 0]}
    scene = mstmm.Scene(
        gravity=(0, -9.81, 0), body=[rod("rod0")], load=[pulse],
        hinge=[{"name": "pin", "type": "pin", "inboard": "ground", "outboard": "rod0"}],
    )  # fmt: skip
    run = mstmm.compile(scene).simulate(1.0, **COARSE)
    assert {risk.name for risk in run.risks} == {"narrow-load", "energy-drift", "idle-load"}
    again = mstmm.load_result(run.save(tmp_path / "run.nc"))
    assert again.risks == run.risks
    assert again.certificate.warnings == run.certificate.warnings


def test_a_look_that_is_interrupted_loses_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    def raise_interrupt(_: mstmm.Result) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(mstmm.Result, "risks", property(raise_interrupt))
    with pytest.raises(mstmm.RiskRefused, match="interrupted") as refused:
        swinging().simulate(0.5, execution=mstmm.Execution(on_risk="refuse"))
    assert refused.value.result.success and refused.value.result.t[-1] == 0.5


@pytest.mark.parametrize(("axial", "told"), [(-600.0, True), (-20.0, False)])
def test_a_one_way_response_knows_no_stiffening(axial: float, told: bool) -> None:
    """A clamped column: 1382 N buckle it, pi^2 EI / (4 L^2), and a response that does not know of
    the axial load is too small by its share of that."""
    beam = {"name": "column", "length": 5.0, "mass_per_length": 1.2, "bending_stiffness": 1.4e4,
            "damping": {"ratio": [0.3]}, "modes": {"z": 3}}  # fmt: skip
    scene = mstmm.Scene(
        gravity=[0, 0, 0],
        beam=[beam],
        hinge=[{"name": "foot", "type": "fixed", "inboard": "ground", "outboard": "column"}],
        load=[{"on": "column.tip", "force": [axial, 0, 5]}],
    )
    runs = [
        mstmm.compile(scene, engine="looped", flexibility=level).simulate(6.0, method="rodas4p2")
        for level in ("one-way", "coupled")
    ]
    ends = [run.deflection("column", "tip")[-1, 2] for run in runs]
    assert ends[0] / ends[1] == pytest.approx(1 + axial / 1382, abs=0.01)
    rows = [risk for risk in runs[0].risks if risk.name == "stiffening"]
    assert bool(rows) == told and not [r for r in runs[1].risks if r.name == "stiffening"]
    assert all("coupled" in risk.remedy for risk in rows)
    assert all(risk.value == pytest.approx(-axial / 1382, rel=0.02) for risk in rows)
