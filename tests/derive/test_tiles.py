"""Passes that go tile by tile: which, and what is asked for from memory."""

from __future__ import annotations

import re

import pytest

from mstmm.cli import stored
from mstmm.derive.print.fetched import fetching
from mstmm.derive.print.sweep import sweep_files
from mstmm.derive.print.tiles import Tiled, tiled
from mstmm.derive.schedule.laws_alone import LAWS_ALONE, LAWS_FACTORISE, LAWS_OWN
from mstmm.derive.schedule.solve import COLUMN
from mstmm.derive.schedule.steps import TIPS_TO_ROOT, Copy, Pass, Run, Sweep
from mstmm.derive.schedule.sweeps import ACCELERATIONS
from mstmm.derive.schedule.tangent import TANGENT_SOLUTION

SWEPT = Pass("swept", "body", "", (Copy(to="parent.e", source="body.e"),), order=TIPS_TO_ROOT)
BEGUN = Pass("begun", "body", "", (Copy(to="body.e"),))


def groups(*runs: Run) -> list[Tiled]:
    return [part for part in tiled(Sweep("sweep", "", runs)) if isinstance(part, Tiled)]


def test_bodies_are_begun_with_their_laws() -> None:
    (group,) = (part for part in tiled(LAWS_ALONE) if isinstance(part, Tiled))
    assert [run.whole.name for run in group.begun if run.whole] == [
        "laws_own", "laws_rates", "laws_own_slopes"
    ]  # fmt: skip
    assert group.swept is LAWS_FACTORISE and not group.singly


def test_what_fits_into_no_tile_is_asked_for_first() -> None:
    (group,) = (part for part in tiled(TANGENT_SOLUTION) if isinstance(part, Tiled))
    assert group.singly == "state->tangents->unit"


def test_accelerations_have_nothing_to_begin() -> None:
    assert tiled(ACCELERATIONS) == list(ACCELERATIONS.runs)


@pytest.mark.parametrize(
    "slot", ["parent.e", "on.e", "inboard.S", "sums.power", "d:parent.motion"]
)  # fmt: skip
def test_what_reads_others_is_not_begun(slot: str) -> None:
    other = Pass("other", "body", "", (Copy(to="body.e", source=slot),))
    assert groups(Run(whole=BEGUN), Run(whole=SWEPT))
    assert not groups(Run(whole=BEGUN), Run(whole=other), Run(whole=SWEPT))
    assert not groups(Run(whole=BEGUN), Run(hook="drive_values"), Run(whole=SWEPT))
    assert not groups(Run(whole=BEGUN, when="posed"), Run(whole=SWEPT))
    assert groups(Run(whole=BEGUN), Run(whole=other, when="posed"), Run(whole=SWEPT))


def test_what_is_asked_for_is_what_is_used() -> None:
    text = fetching("some", [COLUMN, LAWS_OWN])
    assert re.findall(r"mstmm_fetch\((\w+\([^)]*\)|\w+ \+ \w+(?:\([^)]*\))?),", text) == [
        "block + MSTMM_BLOCK_S",
        "mstmm_of_speeds(block, nu, MSTMM_SPEED_TAU)",
        "tangent + MSTMM_TANGENT_S(body->nu, body->nq)",
        "tangent + MSTMM_TANGENT_LAWS(body->nu, body->nq)",
    ]
    assert fetching("none", [Pass("none", "load", "", ())]) == ""


def test_every_tile_is_printed_once() -> None:
    text = sweep_files(stored.specs())["sweep_steps.c"]
    made = re.findall(r"static int (mstmm_tiles_\w+)\(", text)
    assert len(made) == len(set(made)) and all(f"code = {name}(state)" in text for name in made)
