"""The atlas as data, as files and as pictures, and what it refuses."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import pytest

import mstmm
from mstmm.atlas import cases
from mstmm.atlas.page import format_number
from mstmm.errors import EnvironmentFailure, SceneError


@pytest.mark.parametrize(
    ("value", "shown"),
    [(2.6735e6, "2.67e6"), (1e5, "1e5"), (90.0, "90"), (12, "12"), (0.06543, "0.0654"),
     (3.4e-5, "3.4e-5"), (1e-10, "1e-10"), (8.0, "8"), (1234.5, "1.23e3"), (0.0, "0")],
)  # fmt: skip
def test_numbers_as_one_writes_them(value: float, shown: str) -> None:
    assert format_number(value) == shown


@pytest.fixture(scope="module")
def atlas() -> mstmm.Atlas:
    return mstmm.stability(["product-pivot", "product-angle"], points=3, tolerance=0.3)


def test_cases_come_in_the_order_in_which_they_are_asked_for(atlas: mstmm.Atlas) -> None:
    assert [case.name for case in atlas.cases] == ["product-pivot", "product-angle"]


def test_plain_data(atlas: mstmm.Atlas) -> None:
    data = json.loads(json.dumps(atlas.to_dict(), allow_nan=False))
    first = data["cases"][0]
    assert {"name", "parameter", "fails_at", "remedy", "remedy_holds_to", "source"} <= set(first)
    assert first["fails_at"] == atlas.cases[0].fails_at
    assert [1e-10, None] in first["points"]


def test_what_is_saved(atlas: mstmm.Atlas, tmp_path: Path) -> None:
    folder = tmp_path / "found"
    files = atlas.save(folder)
    assert sorted(path.name for path in files) == sorted(path.name for path in folder.iterdir())
    assert json.loads((folder / "atlas.json").read_text()) == atlas.to_dict()
    page = (folder / "atlas.md").read_text()
    for case in atlas.cases:
        picture = folder / f"{case.name}.png"
        assert picture.read_bytes().startswith(b"\x89PNG")
        assert 5_000 < picture.stat().st_size < 60_000
        assert f"]({picture.name})" in page
        assert f"| {case.remedy} |" in page


def test_without_pictures_the_page_names_none(atlas: mstmm.Atlas, tmp_path: Path) -> None:
    files = atlas.save(tmp_path, pictures=False)
    assert [path.name for path in files] == ["atlas.json", "atlas.md"]
    assert ".png" not in files[1].read_text()


def test_a_picture_shows_both_methods_and_the_frontier(atlas: mstmm.Atlas) -> None:
    case = atlas.cases[0]
    figure = case.plot()
    (axes,) = figure.axes
    labels = [text.get_text() for legend in figure.legends for text in legend.get_texts()]
    assert labels == [case.method, case.remedy, "no answer, or far above"]
    assert f"fails at {format_number(case.fails_at)}" in [text.get_text() for text in axes.texts]
    assert axes.get_title(loc="left") == case.title


def test_marks_that_stop_part_way_say_so() -> None:
    """The method was tried to 1e-3, the remedy a thousand times farther."""
    (case,) = mstmm.stability(["product-masses"], points=5, tolerance=0.3).cases
    words = [text.get_text() for text in case.plot().axes[0].texts]
    assert f"tried to {format_number(min(at for at, _ in case.points))}" in words
    assert min(case.remedy_points)[0] < min(case.points)[0]


def test_no_word_where_both_were_tried_as_far(atlas: mstmm.Atlas) -> None:
    case = atlas.cases[0]
    assert min(case.points)[0] == min(case.remedy_points)[0]
    words = [text.get_text() for text in case.plot().axes[0].texts]
    assert not [word for word in words if word.startswith("tried to")]


def test_a_folder_is_made_with_its_parents(atlas: mstmm.Atlas, tmp_path: Path) -> None:
    assert atlas.save(tmp_path / "new" / "folder", pictures=False)[0].exists()
    (tmp_path / "file").write_text("")
    with pytest.raises(EnvironmentFailure, match="cannot be created"):
        atlas.save(tmp_path / "file")


def test_a_picture_of_another_kind_is_refused(atlas: mstmm.Atlas, tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"ends in \.png, \.svg or \.pdf"):
        atlas.cases[0].plot(tmp_path / "picture.txt")


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ({"cases": ["product-lenght"]}, 'did you mean "product-length"'),
        ({"cases": "product-length"}, "expected a list of names"),
        ({"points": 2}, "points = 2"),
        ({"points": 3.5}, "points = 3.5"),
        ({"tolerance": 0.0}, "tolerance = 0"),
        ({"tolerance": float("nan")}, "tolerance = nan"),
    ],
)
def test_what_makes_no_sense_is_refused(arguments: dict[str, Any], says: str) -> None:
    with pytest.raises(SceneError, match=says):
        mstmm.stability(**arguments)


def test_progress_is_told() -> None:
    seen: list[tuple[str, int, int]] = []
    mstmm.stability(
        ["product-angle"], points=3, tolerance=0.3, progress=lambda *one: seen.append(one)
    )
    assert seen == [("product-angle", 0, 1)]


def test_cases_without_their_packages_are_left_out_of_all(monkeypatch: pytest.MonkeyPatch) -> None:
    """And refused, with the way to get these, where they are asked for by name."""
    definitions = {
        one.name: one for one in cases.select_cases(["product-angle", "linear-elements"])
    }
    monkeypatch.setattr(cases, "select_cases", lambda wanted: tuple(definitions.values()))
    monkeypatch.setattr("mstmm.atlas.case_definition.missing_packages", lambda extra: ["skfem"])
    found = mstmm.stability(points=3, tolerance=0.3).cases
    assert [case.name for case in found] == ["product-angle"]
    del definitions["product-angle"]
    monkeypatch.setitem(sys.modules, "skfem", None)
    with pytest.raises(EnvironmentFailure, match=r"pip install 'mstmm\[fem\]'"):
        mstmm.stability(["linear-elements"])
