"""The page of the documentation is what the committed data say, and those lie where expected."""

from __future__ import annotations

import json
from typing import Any

import pytest

from mstmm.atlas.case_definition import CaseResult
from mstmm.atlas.page import markdown_page
from mstmm.plain_data import from_plain
from tests.mstmm.atlas.cases.test_cases import EXPECTED
from tests.support.paths import ROOT

FOLDER = ROOT / "docs" / "explanation" / "failures"
AGAIN = "mstmm stability --out docs/explanation/failures writes it anew"


@pytest.fixture(scope="module")
def stored_cases() -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = json.loads((FOLDER / "atlas.json").read_text())["cases"]
    return found


def test_every_case_is_on_the_page(stored_cases: list[dict[str, Any]]) -> None:
    assert sorted(case["name"] for case in stored_cases) == sorted(EXPECTED), AGAIN
    assert {path.stem for path in FOLDER.glob("*.png")} == set(EXPECTED), AGAIN


def test_the_page_says_what_the_data_do(stored_cases: list[dict[str, Any]]) -> None:
    text = markdown_page([from_plain(CaseResult, case) for case in stored_cases], pictures=True)
    assert (FOLDER / "atlas.md").read_text() == text, AGAIN


def test_its_frontiers_lie_where_they_are_expected(stored_cases: list[dict[str, Any]]) -> None:
    for case in stored_cases:
        (low, high), reach = EXPECTED[case["name"]]
        assert low <= case["fails_at"] <= high, AGAIN
        beyond = case["remedy_holds_to"] >= reach
        assert beyond if case["fails"] == "above" else case["remedy_holds_to"] <= reach, AGAIN


def test_pictures_are_small() -> None:
    assert max(path.stat().st_size for path in FOLDER.glob("*.png")) < 60_000
