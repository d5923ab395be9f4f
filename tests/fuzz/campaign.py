"""Many trials by several workers: a table of outcomes; each kind of failure kept, made small."""

from __future__ import annotations

import copy
import json
import re
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from .mutate import Mutant, mutant, places, value_at
from .seeds import Data
from .trial import BAD, GOOD, HANG, Outcome
from .worker import Limits, Worker

#: Trials spent on making one failing scene smaller.
EFFORT = 150
EFFORT_FOR_HANGS = 8


class Campaign:
    """Trials of mutants of one seed; each kind of failure is kept in a folder as it is met.

    `of` stands in the names of the scenes that mutants are made from.
    """

    def __init__(
        self, seed: int, limits: Limits, engine: str, keep: Path | None, of: str = ""
    ) -> None:
        self.seed, self.limits, self.engine, self.keep, self.of = seed, limits, engine, keep, of
        self.outcomes: Counter[str] = Counter()
        self.failures: dict[tuple[str, str], list[int]] = {}

    def run(
        self, first: int, count: int, jobs: int, tell: Callable[[Campaign], None] = lambda _: None
    ) -> None:
        """The trials of the mutants from `first` on."""
        with self._workers(jobs) as workers, ThreadPoolExecutor(jobs) as pool:

            def strand(k: int) -> None:
                for index in range(first + k, first + count, jobs):
                    scene = mutant(self.seed, index, self.of)
                    self._note(index, scene, self._try(workers[k], scene.data, index))
                    tell(self)

            for future in [pool.submit(strand, k) for k in range(jobs)]:
                future.result()

    def make_small(self) -> None:
        """Of each kind of failure, the kept scene without what the failure does not need."""
        assert self.keep is not None
        with self._workers(1) as (worker,):
            for (kind, detail), found in self.failures.items():
                path = self.keep / file_name(kind, detail)
                record = json.loads(path.read_text("utf-8"))
                record["mutants"] = found

                def try_scene(data: Data, turn: int = found[0]) -> Outcome:
                    return self._try(worker, data, turn)

                effort = EFFORT if kind != HANG else EFFORT_FOR_HANGS
                record["scene"] = smaller(record["scene"], try_scene, kind, detail, effort)
                path.write_text(json.dumps(record, indent=1), "utf-8")

    @contextmanager
    def _workers(self, jobs: int) -> Iterator[list[Worker]]:
        with tempfile.TemporaryDirectory(prefix="mstmm-fuzz-") as folder:
            workers = [Worker(self.limits, self.engine, Path(folder), k) for k in range(jobs)]
            try:
                yield workers
            finally:
                for worker in workers:
                    worker.close()

    def scene_outcome(self, data: Any, turn: int | None = None) -> Outcome:
        """The outcome of one scene; `turn` as for `trial`."""
        with self._workers(1) as workers:
            return self._try(workers[0], data, turn)

    @staticmethod
    def _try(worker: Worker, data: Any, turn: int | None = None) -> Outcome:
        worker.ask(data, turn)
        return worker.answer()

    def _note(self, index: int, scene: Mutant, outcome: Outcome) -> None:
        self.outcomes[outcome.kind] += 1
        if outcome.kind not in BAD:
            return
        known = self.failures.setdefault((outcome.kind, outcome.detail), [])
        known.append(index)
        if self.keep is None or len(known) > 1:
            return
        self.keep.mkdir(parents=True, exist_ok=True)
        record = {
            "kind": outcome.kind, "detail": outcome.detail, "seed": self.seed, "turn": index,
            "origin": scene.origin, "changes": scene.changes, "text": outcome.text,
            "scene": scene.data,
        }  # fmt: skip
        path = self.keep / file_name(outcome.kind, outcome.detail)
        path.write_text(json.dumps(record, indent=1), "utf-8")

    def table(self) -> str:
        """The counts by outcome, then each kind of failure with the mutants that showed it."""
        lines = [f"{self.outcomes[kind]:8d}  {kind}" for kind in (*GOOD, *BAD)]
        for (kind, detail), found in sorted(self.failures.items(), key=lambda x: -len(x[1])):
            some = ", ".join(map(str, found[:4])) + (", ..." if len(found) > 4 else "")
            lines.append(f"{len(found):8d}  {kind}: {detail} (mutant {some})")
        return "\n".join(lines)


def file_name(kind: str, detail: str) -> str:
    """Where a kind of failure is kept."""
    return re.sub(r"[^\w.]+", "_", f"{kind}_{detail}")[:120] + ".json"


def smaller(data: Any, try_: Callable[[Any], Outcome], kind: str, detail: str, effort: int) -> Any:
    """The scene without what its failure does not need: parts are taken out, the large first."""
    begin, tried, shrunk = time.monotonic(), 0, True
    while shrunk:
        shrunk = False
        for place in sorted(places(data), key=len):
            attempt = copy.deepcopy(data)
            try:
                inside = value_at(attempt, place[:-1])
                del inside[place[-1]]
            except (KeyError, IndexError, TypeError):
                continue  # gone with a part that was taken out before
            if tried == effort or time.monotonic() - begin > effort:
                return data
            tried += 1
            outcome = try_(attempt)
            if (outcome.kind, outcome.detail) == (kind, detail):
                data, shrunk = attempt, True
    return data
