"""Passes that go tile by tile: which, and what is asked for from memory."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest

from mstmm.cli import stored_elements
from mstmm.derive.codegen.cache_tiling import ChainedPasses, TiledRun, tile_sweep
from mstmm.derive.codegen.pass_loops import prefetch_function
from mstmm.derive.codegen.sweep_text import sweep_files
from mstmm.derive.schedule.approximate_tangent import APPROXIMATE_TANGENT, LAWS_FACTORISE, LAWS_OWN
from mstmm.derive.schedule.inverse_dynamics import COLUMN
from mstmm.derive.schedule.pass_steps import ROOT_TO_TIPS, TIPS_TO_ROOT, Copy, Pass, Run, Sweep
from mstmm.derive.schedule.sweeps import ACCELERATIONS
from mstmm.derive.schedule.tangent_sweep import TANGENT_SOLUTION

SWEPT = Pass("swept", "body", "", (Copy(to="parent.e", source="body.e"),), order=TIPS_TO_ROOT)
BEGUN = Pass("begun", "body", "", (Copy(to="body.e"),))


def groups(*runs: Run) -> list[TiledRun]:
    return [part for part in tile_sweep(Sweep("sweep", "", runs)) if isinstance(part, TiledRun)]


def test_bodies_are_begun_with_their_laws() -> None:
    (group,) = (part for part in tile_sweep(APPROXIMATE_TANGENT) if isinstance(part, TiledRun))
    assert [run.whole.name for run in group.begun if run.whole] == [
        "laws_own", "laws_rates", "laws_own_slopes"
    ]  # fmt: skip
    assert group.swept is LAWS_FACTORISE and not group.singly


def test_what_fits_into_no_tile_is_asked_for_first() -> None:
    (group,) = (part for part in tile_sweep(TANGENT_SOLUTION) if isinstance(part, TiledRun))
    assert group.singly == "state->tangents->unit"


def test_accelerations_have_nothing_to_begin() -> None:
    assert tile_sweep(ACCELERATIONS) == list(ACCELERATIONS.runs)


@pytest.mark.parametrize("slot", ["body.e", "parent.e", "inboard.S", "sums.power"])
def test_passes_from_root_to_tips_follow_one_another(slot: str) -> None:
    one = Pass("one", "body", "", (Copy(to="body.e", source="parent.e"),), order=ROOT_TO_TIPS)
    other = replace(one, name="other", steps=(Copy(to="body.S", source=slot),))
    (group,) = tile_sweep(Sweep("sweep", "", (Run(whole=one), Run(whole=other))))
    assert isinstance(group, ChainedPasses)
    assert group.passes == (one, other) and group.main is one and not group.singly


def test_what_cannot_follow_parts_a_chain() -> None:
    one = Pass("one", "body", "", (Copy(to="body.e", source="parent.e"),), order=ROOT_TO_TIPS)
    runs = Run(whole=one), Run(whole=replace(one, name="two"))
    reads_others = replace(one, name="three", steps=(Copy(to="body.e", source="on.e"),))
    spares = Run(whole=replace(one, name="four", spares_links="posed"))
    for between in Run(whole=reads_others), Run(hook="drive_values"), Run(whole=SWEPT):
        parted = (runs[0], between, runs[1])
        assert tile_sweep(Sweep("sweep", "", parted)) == list(parted)
    assert tile_sweep(Sweep("sweep", "", (spares, spares))) == [spares, spares]
    posed = Run(hook="drive_values", when="poses")
    first, group, last = tile_sweep(Sweep("sweep", "", (posed, runs[0], posed, runs[1], posed)))
    assert isinstance(group, ChainedPasses)
    assert first == last == posed and group.runs == (runs[0], posed, runs[1])
    assert "needs_pose" in group.singly


@pytest.mark.parametrize(
    "slot", ["parent.e", "on.e", "inboard.S", "sums.power", "d:parent.motion"]
)  # fmt: skip
def test_what_reads_others_is_not_begun(slot: str) -> None:
    other = Pass("other", "body", "", (Copy(to="body.e", source=slot),))
    assert groups(Run(whole=BEGUN), Run(whole=SWEPT))
    assert not groups(Run(whole=BEGUN), Run(whole=other), Run(whole=SWEPT))
    assert not groups(Run(whole=BEGUN), Run(hook="drive_values"), Run(whole=SWEPT))
    assert not groups(Run(whole=BEGUN, when="poses"), Run(whole=SWEPT))
    assert groups(Run(whole=BEGUN), Run(whole=other, when="poses"), Run(whole=SWEPT))


def test_what_is_asked_for_is_what_is_used() -> None:
    text = prefetch_function("some", [COLUMN, LAWS_OWN])
    assert re.findall(r"mstmm_fetch\((\w+\([^)]*\)|\w+ \+ \w+(?:\([^)]*\))?),", text) == [
        "block + MSTMM_BLOCK_FLOOR",
        "block + MSTMM_BLOCK_E",
        "mstmm_of_speeds(block, nu, MSTMM_SPEED_TAU)",
        "tangent + MSTMM_TANGENT_LAWS(body->nu, body->nq)",
    ]
    assert "mstmm_fetch(state->tangents->numbers + mstmm_carried_at(" in text
    assert "mstmm_fetch(body->body_p, body->body_p + MSTMM_RIGID_NUMBERS);" in text
    assert prefetch_function("none", [Pass("none", "load", "", ())]) == ""


def test_every_tile_is_printed_once() -> None:
    text = sweep_files(stored_elements.generated_specs())["sweep_steps.c"]
    made = re.findall(r"static int (mstmm_(?:tiles|chain)_\w+)\(", text)
    assert {name.split("_")[1] for name in made} == {"tiles", "chain"}
    assert len(made) == len(set(made)) and all(f"code = {name}(state)" in text for name in made)
