"""Whether `simulate(error=...)` keeps what it says, and what that costs.

    python -m benchmarks.error_control [--tuning] [--each N] [--seed N] [--rounds N]

Scenes are drawn afresh from families that the rule was not set on (`--tuning`: from those that it
was).  Each is asked for three errors, and compared with a reference and with the cheapest single
run among all adaptive methods and tolerances that errs by no more than what was asked: found by
trying all, which nobody could know beforehand, lucky hits included.  Processor time of whole warm
calls, the least of alternating rounds, on the looped engine.
"""

from __future__ import annotations

import json
from argparse import ArgumentParser, Namespace
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

import mstmm

from ..common import measure
from . import best, scenes, trials
from .report import table

HERE = Path(__file__).resolve().parent

#: A reference that is off by more than this part of the smallest error asked for is none.
_GOOD = 0.1


def drawn(options: Namespace) -> Iterator[tuple[str, list[trials.Outcome], float]]:
    """Every scene with its outcomes and the error of its reference; none where that is no good."""
    families = scenes.TUNING if options.tuning else scenes.JUDGED
    for name, (tables, t_end) in scenes.draw(families, options.each, options.seed).items():
        model = mstmm.compile(mstmm.Scene(**tables), engine="looped")
        truth = best.reference(model, t_end)
        if truth is None or truth.error > _GOOD * min(trials.ASKED):
            yield name, [], float("inf") if truth is None else truth.error
            continue
        found = best.singles(model, t_end, truth, min(trials.ASKED) / 10, options.rounds)
        yield name, [
            trials.outcome(name, model, t_end, truth, found, asked, options.rounds)
            for asked in trials.ASKED
        ], truth.error  # fmt: skip


def main() -> None:
    """Run all, print on the way, write result.json and result.md."""
    parser = ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--tuning", action="store_true", help="families on which the rule was set")
    parser.add_argument("--each", type=int, default=7, help="scenes of each of eight families")
    parser.add_argument("--seed", type=int, default=2027)
    parser.add_argument("--rounds", type=int, default=5, help="alternating rounds of times")
    parser.add_argument("--out", type=Path, default=HERE, help="folder of result.json, result.md")
    options = parser.parse_args()
    outcomes, without = [], {}
    for name, found, floor in drawn(options):
        if not found:
            without[name] = floor
        for one in found:
            print(one.line(), flush=True)
        outcomes += found
    data: dict[str, Any] = {
        "machine": measure.machine(), "families": "tuning" if options.tuning else "judged",
        "each": options.each, "seed": options.seed, "rounds": options.rounds,
        "without_reference": without, "outcomes": [asdict(one) for one in outcomes],
    }  # fmt: skip
    (options.out / "result.json").write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")
    text = table(outcomes, data)
    (options.out / "result.md").write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
