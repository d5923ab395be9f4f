"""`mstmm stability`."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from mstmm.atlas import cases
from tests.support.commands import Command


def test_a_case_is_measured_told_and_drawn(mstmm: Command, folder: Path) -> None:
    done = mstmm("stability", "--case", "product-angle", "--out", "new/found")
    assert done.code == 0, done.err
    assert "product-angle" in done.out
    assert "Riccati sweep" in done.out
    assert "limit" in done.out and "1e-6" in done.out
    found = sorted(path.name for path in (folder / "new" / "found").iterdir())
    assert found == ["atlas.json", "atlas.md", "product-angle.png"]


def test_json_holds_what_the_folder_does(mstmm: Command, folder: Path) -> None:
    done = mstmm("stability", "--case", "product-angle", "--out", "found", "--json")
    data = json.loads(done.out)
    assert data["cases"] == json.loads((folder / "found/atlas.json").read_text())["cases"]
    assert [Path(name).name for name in data["files"]] == [
        "atlas.json", "atlas.md", "product-angle.png",
    ]  # fmt: skip


def test_the_list_computes_nothing(mstmm: Command, folder: Path) -> None:
    before = sorted(folder.iterdir())
    shown = mstmm("stability", "--list")
    assert shown.code == 0
    assert "product-length" in shown.out
    cases = json.loads(mstmm("stability", "--list", "--json").out)["cases"]
    assert {"name", "parameter", "remedy", "source"} <= set(cases[0])
    assert sorted(folder.iterdir()) == before


def test_bad_input_is_told_in_a_line(mstmm: Command, folder: Path) -> None:
    for arguments, says in (
        (("--case", "product-lenght", "--out", "x"), 'did you mean "product-length"'),
        (("--case", "product-angle"), "--out DIR"),
        (("--out", ""), "expected the name of a folder"),
        (("--out", "pendulum.toml"), "not a folder"),
        (("--list", "--case", "none"), "unknown case"),
    ):
        done = mstmm("stability", *arguments)
        assert (done.code, says in done.err) == (2, True), done.err
        assert "Traceback" not in done.err
    assert not (folder / "x").exists()


def test_what_packages_are_missing_for_is_named(
    mstmm: Command, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    definitions = cases.select_cases(["product-angle", "no-compression"])
    monkeypatch.setattr(cases, "select_cases", lambda wanted: definitions)
    monkeypatch.setattr("mstmm.atlas.case_definition.missing_packages", lambda extra: ["skfem"])
    done = mstmm("stability", "--out", "found")
    assert done.code == 0, done.err
    assert "no-compression needs skfem: pip install 'mstmm[fem]'" in done.out + done.err
    data = json.loads(mstmm("stability", "--out", "found", "--json").out)
    assert data["left_out"] == ["no-compression"]
    assert [case["name"] for case in data["cases"]] == ["product-angle"]
