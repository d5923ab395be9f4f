"""A bounded piece of the fuzzer, always the same mutants; and inputs that once broke something."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

import mstmm

from .campaign import Campaign, smaller
from .mutate import mutant, places
from .seeds import Data, seeds
from .trial import BAD, CRASH, HANG, RAN, REFUSED, T_END, TRACEBACK, Outcome
from .worker import Limits, Worker

FOUND = sorted((Path(__file__).parent / "found").glob("*.json"))


@pytest.mark.parametrize("count", [25, pytest.param(40, marks=pytest.mark.soak)])
def test_no_mutant_does_worse_than_a_refusal_or_a_run(count: int) -> None:
    campaign = Campaign(seed=9, limits=Limits(), engine="looped", keep=None)
    campaign.run(first=43, count=count, jobs=2)
    assert not campaign.failures, campaign.table()
    refused = campaign.outcomes[REFUSED]
    # Mutants that are all refused try no run, mutants that all run try no message.
    assert min(refused, count - refused) >= count / 8, campaign.table()


def test_mutants_that_bounce_on_code_of_their_own() -> None:
    campaign = Campaign(seed=2, limits=Limits(), engine="fused", keep=None, of="bouncing")
    campaign.run(first=0, count=10, jobs=2)
    assert not campaign.failures, campaign.table()
    assert campaign.outcomes[REFUSED] <= 7, campaign.table()


@pytest.fixture(scope="module")
def worker(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Worker]:
    one = Worker(Limits(), "looped", tmp_path_factory.mktemp("fuzz"), 0)
    yield one
    one.close()


@pytest.mark.parametrize("path", FOUND, ids=lambda path: path.stem)
def test_what_once_broke(worker: Worker, path: Path) -> None:
    record = json.loads(path.read_text("utf-8"))
    worker.ask(record["scene"], record["turn"])
    outcome = worker.answer()
    assert outcome.kind not in BAD, outcome


@pytest.mark.parametrize("name", ["beams", "boxes"])
def test_the_scenes_of_many_tables_are_lawful(name: str) -> None:
    model = mstmm.compile(mstmm.Scene.from_data(seeds()[name], name), engine="looped")
    assert model.simulate(1e-3).success


@pytest.mark.parametrize("name", [name for name in seeds() if "bouncing" in name])
def test_what_bounces_does_so_within_a_trial(name: str) -> None:
    model = mstmm.compile(mstmm.Scene.from_data(seeds()[name], name), engine="fused")
    run = model.simulate(T_END)
    assert run.success and (run.trajectory.event > 0).any(), run.message


def test_a_mutant_is_always_the_same_scene() -> None:
    assert repr(mutant(3, 4)) == repr(mutant(3, 4))
    assert repr(mutant(3, 4)) != repr(mutant(3, 5))


# --- the fuzzer sees what it is made for ---------------------------------------------------------


@pytest.fixture
def outcome_of_defect(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> Iterator[Callable[[str, Limits], Outcome]]:
    """Outcome of a valid scene in an mstmm with a defect where scenes are compiled."""
    workers = []

    def tell(defect: str, limits: Limits) -> Outcome:
        monkeypatch.setattr("mstmm.compile", lambda *_, **__: exec(defect), raising=False)
        workers.append(Worker(limits, "looped", tmp_path, 0))
        workers[-1].ask(seeds()["simple_pendulum"])
        return workers[-1].answer()

    yield tell
    for worker in workers:
        worker.close()


DEFECTS = {
    "1 / 0": (TRACEBACK, "ZeroDivisionError", Limits()),
    "import os; os.abort()": (CRASH, "SIGABRT", Limits()),
    "while True: pass": (HANG, "compile", Limits(cpu=0.2)),
    "import time; time.sleep(1000)": (HANG, "waits", Limits(wall=0.2)),
    "[0] * 10**10": (TRACEBACK, "MemoryError", Limits()),
}


@pytest.mark.parametrize("defect", DEFECTS)
def test_a_defect_is_told(outcome_of_defect: Callable[[str, Limits], Outcome], defect: str) -> None:
    kind, detail, limits = DEFECTS[defect]
    outcome = outcome_of_defect(defect, limits)
    assert outcome.kind == kind and detail in outcome.detail


def test_a_failing_scene_is_made_small() -> None:
    def fails_with_inertia(data: Data) -> Outcome:
        return Outcome(TRACEBACK, "x") if "'inertia'" in str(data) else Outcome(RAN)

    small = smaller(seeds()["simple_pendulum"], fails_with_inertia, TRACEBACK, "x", 100)
    assert [place[-1] for place in places(small)] == ["body", 0, "inertia"]
