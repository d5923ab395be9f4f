"""Verdicts: what is trusted, what is not, what nobody has judged."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import mstmm
from mstmm.runtime.result.certificate import Verdict
from mstmm.runtime.result.result import Result
from tests.support.scenes.results import motor, pins, rod


def test_a_clean_certified_run_is_trusted() -> None:
    run = mstmm.compile(pins(1, [0.3])).simulate(3.0, certify=True)
    assert run.trusted
    assert str(run.certificate.verdict()).startswith("trusted: errors within 0.01 rad")
    assert str(run.certificate).splitlines()[0].split()[:2] == ["verdict", "trusted:"]


def test_without_a_second_run_nothing_is_trusted() -> None:
    run = mstmm.compile(pins(1, [0.3])).simulate(3.0)
    assert run.success
    assert not run.trusted
    assert "not verified: the error was not estimated" in str(run.certificate.verdict())


@pytest.mark.parametrize(
    ("sentence", "clause"),
    [
        ('loads soften "p" (gamma): it is at its load', 'loads soften "p" (gamma)'),
        ('bends to 0.6; above 0.3 split it', 'bends to 0.6'),
        ('rotates by 1.4 rad: split the body', 'rotates by 1.4 rad'),
        ('beam "p": modes: 1 is too few', 'beam "p": modes: 1 is too few'),
    ],
)  # fmt: skip
def test_the_first_clause_comes_first(sentence: str, clause: str) -> None:
    assert str(Verdict((sentence, "more"), (), "")) == (
        f"NOT trusted: {clause} (and 1 more, see below)"
    )


def test_bounds_that_are_asked_for_are_those_that_hold() -> None:
    run = mstmm.compile(pins(1, [0.3])).simulate(3.0, certify=True, rtol=1e-6)
    error = run.certificate.error
    assert error is not None
    size = error.difference()["rad"]
    assert run.certificate.verdict(accuracy=2 * size).trusted
    tight = run.certificate.verdict(accuracy=size / 2)
    assert not tight.trusted
    assert tight.objections[0].startswith("the estimated error of q is")
    drift = run.certificate.energy.relative
    assert any(
        "requested bound" in text for text in run.certificate.verdict(balance=drift / 2).objections
    )


def test_errors_of_lengths_are_judged_by_how_far_they_went() -> None:
    hinge = {"name": "rail", "type": "prismatic", "inboard": "ground", "outboard": "rod",
             "initial": {"q": [1e-4]}, "law": {"stiffness": 40.0}}  # fmt: skip
    scene = mstmm.Scene(gravity=(0, 0, 0), body=[rod("rod", 2.0)], hinge=[hinge])
    run = mstmm.compile(scene).simulate(40.0, method="rk4", step=0.15, certify=True)
    error = run.certificate.error
    assert error is not None
    assert error.excursion["m"] == pytest.approx(2e-4, rel=0.02)
    assert 1e-6 < error.difference()["m"] < 1e-3  # small in metres, but not beside the motion
    assert "with a motion of 0.0002 m" in str(run.certificate.verdict())


def test_a_chaotic_run_is_not_trusted_past_its_horizon() -> None:
    run = mstmm.compile(pins(2, [0.3, 0.5])).simulate(20.0, certify=True, rtol=1e-7)
    assert run.success
    assert not run.trusted
    assert "over the whole run" in str(run.certificate)


def test_a_run_that_is_wrong_from_its_first_sample_on_has_no_time_up_to_which_it_is_right() -> None:
    run = mstmm.compile(pins(1, [1.5])).simulate(5.0, method="genalpha", step=0.4, certify=True)
    text, error = str(run.certificate), run.certificate.error
    assert error is not None and error.divergence_time == 0.0
    assert "t = 0 s" not in text and "over the whole run" not in text
    assert "the start: from the first sample on the two runs differ" in text
    assert f"{error.difference()['rad']:.1e} rad (from a second run" in text
    assert "(not predictable from the start)" in str(run.certificate.verdict())


def test_a_failed_run_is_not_trusted_and_says_why_first() -> None:
    run = mstmm.compile(motor("1/(0.5 - t)")).simulate(1.0, certify=True)
    assert not run.success
    assert not run.trusted
    assert run.certificate.verdict().objections[0] == run.message


def test_energies_beyond_what_numbers_hold_are_no_success() -> None:
    """Speeds of 1e160 m/s are numbers; their squares are not."""
    run = mstmm.compile(motor("0")).simulate(1.0, initial=([0.0], [1.0]), certify=True)
    huge = replace(run.trajectory, u=run.u * 1e160)
    with np.errstate(all="ignore"):
        other = Result(run.model, huge)
        assert huge.success
        assert not other.success
        assert "but its energies or momenta overflow" in other.message
        assert "0 J of 0 J" not in str(other.certificate)
        assert any("is unknown: overflow" in text for text in other.warnings)
        assert not other.trusted


def test_what_a_verdict_was_stays_with_the_file(tmp_path: Path) -> None:
    run = mstmm.compile(pins(1, [0.3])).simulate(1.0, certify=True)
    back = mstmm.load_result(run.save(tmp_path / "run.nc"))
    assert back.trusted
    assert str(back.certificate.verdict()) == str(run.certificate.verdict())


def test_one_sample_tells_nothing_of_balances() -> None:
    run = mstmm.compile(pins(1, [0.3])).simulate(1.0, output_times=[1.0], certify=True)
    assert run.certificate.error is not None
    assert "only one sample" in str(run.certificate.verdict())
    assert not run.trusted
