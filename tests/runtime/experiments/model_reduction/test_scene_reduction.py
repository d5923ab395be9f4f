"""Hinges that may be rigid, and springs that may be left out."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

import mstmm
from mstmm.runtime.experiments.model_reduction import (
    advice_summary,
    advise,
    scene_reduction,
    tables,
)
from mstmm.runtime.experiments.model_reduction.advice import BodyAdvice
from mstmm.runtime.experiments.model_reduction.body_models import RIGID, BodyModel
from mstmm.runtime.experiments.tuning import REDUCTION
from tests.support.scenes.advice import sprung_rods, tip

OF = "d.tip.position"


def error(made: mstmm.Advice, scene: mstmm.Scene) -> float:
    truth = tip(scene, 1.0, OF, method="rodas5p", rtol=1e-9, atol=1e-11)
    return float(
        np.linalg.norm(
            tip(made.scene, 1.0, made.reduced_name(OF), **made.options) - truth, axis=1
        ).max()
    )


def test_stiff_hinges_become_rigid() -> None:
    """Where they stand, not where they were drawn: the sprung pin rests at 0.4 rad."""
    scene = sprung_rods(3e5)
    made = mstmm.advise(scene, 1.0, error=1e-2, of=OF, rounds=1, budget=600)
    told = " ".join(made.other_changes)
    assert all(f'hinge "{name}": rigid' in told for name in ("spring", "bushing", "slide"))
    assert 'hinge "pivot": without its damper' in told
    for name in ("spring", "bushing", "slide"):
        (one,) = (text for text in made.other_changes if text.startswith(f'hinge "{name}": rigid'))
        found = re.search(r"this change alone: error (\S+), (\S+) of the time before", one)
        assert found and float(found[1]) <= 1e-2 and float(found[2]) > 0
    assert any("with these 3 changes: error" in text for text in made.other_changes)
    assert mstmm.compile(made.scene, engine="looped").nu == 1
    assert made.is_reduced
    assert made.model_saving is not None
    assert error(made, scene) <= 1e-2


def test_a_model_that_takes_longer_and_errs_more_is_not_advised(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Then the scene stays as it is, and a note tells what was found."""
    scene = sprung_rods(3e5)
    monkeypatch.setattr(advice_summary, "compare_cpu_times", lambda *_: (0.89, 1.0))
    made = mstmm.advise(scene, 1.0, error=1e-2, of=OF, rounds=0, budget=600)
    assert not made.is_reduced and made.other_changes == () and made.model_saving == 1.0
    assert mstmm.compile(made.scene, engine="looped").nu == mstmm.compile(scene).nu
    assert any("1.12 times the time of the scene as given" in note for note in made.notes)
    assert made.error <= 1e-2 and error(made, scene) <= 1e-2


def test_soft_ones_stay() -> None:
    """50 N m/rad under rods of 1 kg: it swings by more than a rad; a damper of 5 N m s brakes."""
    scene = sprung_rods(50.0, damping=5.0)
    made = mstmm.advise(scene, 1.0, error=1e-3, of=OF, rounds=0, budget=600)
    told = " ".join(made.other_changes)
    assert "pivot" not in told
    assert '"spring"' not in told
    assert 'hinge "slide": rigid' in told
    assert made.scene.hinge[0].law.damping == (5.0,)
    assert error(made, scene) <= 1e-3


def test_springs_between_bodies_that_do_nothing() -> None:
    springs = [
        {"name": "slack", "from": "ground", "to": "a.tip", "position": [1, 1, 0],
         "law": {"stiffness": 1e-9}},
        {"name": "taut", "from": "ground", "to": "a.tip", "position": [1, 1, 0],
         "law": {"stiffness": 100.0}},
    ]  # fmt: skip
    scene = mstmm.Scene(**{**sprung_rods(1e5).model_dump(by_alias=True), "spring": springs})
    made = mstmm.advise(scene, 0.5, error=1e-2, of=OF, rounds=0, budget=600)
    assert [one.name for one in made.scene.spring] == ["taut"]
    assert any('spring "slack": left out' in text for text in made.other_changes)


@pytest.mark.parametrize("by_event", [True, False])
def test_what_is_released_stays(by_event: bool) -> None:
    data = sprung_rods(3e5).model_dump(by_alias=True)
    *others, slide = data["hinge"]
    slide |= {"law": {}, "drive": "0", "initial": None}
    if by_event:
        data["event"] = [{"name": "go", "when": "t > 0.3", "do": "release", "hinge": "slide"}]
    else:
        slide |= {"release": "t >= 0.3"}
    scene = mstmm.Scene(**data | {"hinge": [*others, slide]})
    made = mstmm.advise(scene, 0.5, error=1e-2, of=OF, rounds=0, budget=600)
    assert '"slide"' not in " ".join(made.other_changes)
    assert made.scene.hinge[-1].type == "prismatic"


def test_what_the_budget_leaves_no_time_for_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without time for a search the scene stays, and the advice says what was not examined; two
    budgets with time enough give the same scene."""
    scene = sprung_rods(3e5)
    small, large = (
        mstmm.advise(scene, 1.0, error=1e-2, of=OF, rounds=0, budget=seconds)
        for seconds in (600, 1200)
    )
    assert small.scene == large.scene
    assert not any("limits this advice" in note for note in (*small.notes, *large.notes))
    for module in (advise, scene_reduction):
        monkeypatch.setattr(module, "TUNING", replace(REDUCTION, search_budget=0.0))
    made = mstmm.advise(scene, 1.0, error=1e-2, of=OF, rounds=0, budget=600)
    note = next(note for note in made.notes if "limits this advice" in note)
    assert "600 s" in note and "spring" in note and "not examined" in note


@pytest.mark.parametrize(
    ("saving", "words"),
    [(4.0, "saves a factor of 4"), (0.8, "costs a factor of 1.2"), (1.0, "the same")],
)
def test_what_takes_longer_saves_nothing(saving: float, words: str) -> None:
    class One:
        bodies = (BodyAdvice("arm", BodyModel(RIGID), BodyModel(RIGID), 0.0, saving, ""),)

    head, _, rows = tables.body_table(One())  # type: ignore[arg-type]
    assert rows[0][-1] == words and "saves" not in head[-1]
