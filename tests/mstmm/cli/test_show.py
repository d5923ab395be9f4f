"""`mstmm list` and `mstmm show`."""

from __future__ import annotations

import json
import re
from pathlib import Path
from xml.etree import ElementTree

import pytest

from mstmm.derive.classical.catalogue import CLASSICAL
from mstmm.ir.hinge_properties import builtin_hinges
from tests.support.commands import Command
from tests.support.paths import ROOT


def test_list_has_everything(mstmm: Command) -> None:
    done = mstmm("list")
    assert done.code == 0
    for name in (
        *builtin_hinges(),
        "rigid",
        "spring",
        "classical_ball",
        "rk4",
        "dop853",
        "friction",
    ):
        assert re.search(rf"\b{name}\b", done.out), name
    assert max(map(len, done.out.splitlines())) <= 80


def test_list_as_json_has_coordinates_with_units(mstmm: Command) -> None:
    data = json.loads(mstmm("list", "hinges", "methods", "--json").out)
    assert set(data) == {"hinges", "methods"}
    pin = next(hinge for hinge in data["hinges"] if hinge["name"] == "pin")
    assert pin["coordinates"] == ["angle [rad]"] and pin["speeds"] == ["angle_rate [rad/s]"]
    assert [hinge["name"] for hinge in data["hinges"]] == list(builtin_hinges())


def test_list_of_something_unknown(mstmm: Command) -> None:
    done = mstmm("list", "doors")
    assert done.code == 2 and "hinges" in done.err


@pytest.mark.parametrize("at", ["equations", "matrix", "ir", "c"])
def test_pin_at_every_stage(mstmm: Command, at: str) -> None:
    done = mstmm("show", "pin", "--at", at)
    assert done.code == 0 and "Rui, Wang, Zhang" in done.out
    assert "rad/s" in done.out


def test_stage_c_is_the_generated_file(mstmm: Command) -> None:
    shown = mstmm("show", "pin", "--at", "c").out
    source = ROOT / "generated" / "hinge_pin.c"
    assert source.read_text().strip() in shown


def test_stage_c_of_a_matrix_that_no_run_needs_is_derived(mstmm: Command) -> None:
    name = "classical_elastic_planar_discrete"
    assert f"mstmm_{name}_transfer(" in mstmm("show", name, "--at", "c").out
    assert not (ROOT / "generated" / f"{name}.c").exists()


def test_html_is_well_formed_and_complete(mstmm: Command, folder: Path) -> None:
    done = mstmm("show", "pin", "--format", "html", "--output", "pin.html")
    assert done.code == 0 and done.out == ""
    page = (folder / "pin.html").read_text(encoding="utf-8")
    tree = ElementTree.fromstring(page.split("\n", 1)[1] if page.startswith("<!") else page)
    assert tree.tag == "html" and "<script" not in page


def test_short_and_full_names_mean_the_same(mstmm: Command) -> None:
    assert mstmm("show", "spring").out == mstmm("show", "force_spring").out
    hinge, matrix = (mstmm("show", name, "--at", "ir").out for name in ("ball", "classical_ball"))
    assert hinge != matrix


def test_listed_matrices_can_be_shown(mstmm: Command) -> None:
    listed = json.loads(mstmm("list", "matrices", "--json").out)["matrices"]
    assert [entry["name"] for entry in listed] == sorted(f"classical_{name}" for name in CLASSICAL)
    for entry in listed[::8]:  # stored ones and derived ones; other tests show all of them
        page = json.loads(mstmm("show", entry["name"], "--at", "ir", "--json").out)
        assert page["pages"][entry["name"]]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("pni",), "did you mean"),
        (("",), "no such element"),
        (("x" * 5000,), "no such element"),
        (("../../etc/passwd",), "no such element"),
        (("none.py",), "none.py"),
        (("pin", "--at", "home"), "equations"),
        (("pin", "--format", "doc"), "latex"),
        (("sweep_screw", "--at", "c"), "mstmm show sweep_screw --at ir"),
        (("pin", "-o", "away/x.txt"), "away"),
        ((), "ELEMENT"),
    ],
)
def test_refused(mstmm: Command, arguments: tuple[str, ...], said: str) -> None:
    done = mstmm("show", *arguments)
    assert done.code == 2 and said in done.err


def test_the_schedule_of_the_sweep(mstmm: Command) -> None:
    done = mstmm("show", "sweep")
    assert done.code == 0
    for heading in ("sweep accelerations", "sweep solution", "pass forward", "Conditions", "Slots"):
        assert f"\n{heading}\n{'-' * len(heading)}\n" in done.out
    assert "for every body, tips to root, passing by where idle" in done.out
    assert "frames.pose(A_I=parent.A, x_I=parent.x, Rc=body.R, r=body.r) -> A=body.A" in done.out
    assert max(map(len, done.out.splitlines())) <= 102


def test_the_sweep_is_told_before_its_schedule(mstmm: Command) -> None:
    text = mstmm("show", "sweep").out
    told = [text.index(said) for said in (
        "⎡ w + w_Q", "bias = ⎡ M ω̃² r_IC ⎤", "S_Q = S − U G", "B_I = B − A r̃",
        "δ = H u̇ + δ_Q", "The schedule", "generic{free}.condense(", "generic{free}.recover(",
    )]  # fmt: skip
    assert told == sorted(told)


def test_a_hinge_in_both_forms(mstmm: Command) -> None:
    text = mstmm("show", "ball", "--beside").out
    both, matrix, subspace = (text.index(said) for said in (
        "classical and by motion subspace", "Classical transfer matrix", "Motion subspace",
    ))  # fmt: skip
    assert both < matrix < text.index("U_h = ") < subspace < text.index("H = ")
    assert r"\begin{align*}" in mstmm("show", "pin", "--beside", "--format", "latex").out
    done = mstmm("show", "screw", "--beside")
    assert done.code == 2 and "expected one of ball, pin" in done.err


def test_the_schedule_in_other_formats(mstmm: Command) -> None:
    page = mstmm("show", "sweep", "--format", "html").out
    ElementTree.fromstring(page.partition("\n")[2] if page.startswith("<!") else page)
    assert r"\begin{verbatim}" in mstmm("show", "sweep", "--format", "latex").out
    pages = json.loads(mstmm("show", "sweep", "--json").out)["pages"]
    assert list(pages) == ["sweep"]


def test_the_c_that_is_printed_from_the_schedule(mstmm: Command) -> None:
    shown = mstmm("show", "sweep", "--at", "c").out
    source = ROOT / "generated" / "sweep_steps.c"
    assert source.read_text().strip() in shown
    done = mstmm("show", "sweep", "--at", "ir")
    assert done.code == 2 and "sweep_generic2" in done.err
