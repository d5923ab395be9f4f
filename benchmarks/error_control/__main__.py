"""Achieved error, estimate and cost of `simulate(error=...)` on random scenes.

    python -m benchmarks.error_control [--tuning] [--each N] [--seed N] [--rounds N] [--jobs N]

Random scenes of families that were not used to set the rule (`--tuning`: of those that were).  Each
runs with three target errors, and is compared with a reference and with the cheapest single run
that meets the target: the best of all adaptive methods and tolerances, including accidentally
accurate ones.  Minimum CPU time of whole warm calls in alternating rounds, looped engine.
"""

from __future__ import annotations

import json
from argparse import ArgumentParser
from dataclasses import asdict
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from ..common import measure
from . import scenes, trials
from .report import table

HERE = Path(__file__).resolve().parent


def main() -> None:
    """Run all; print, and write result.json and result.md, after every scene."""
    parser = ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--tuning", action="store_true", help="families used to set the rule")
    parser.add_argument("--each", type=int, default=7, help="scenes of each of eight families")
    parser.add_argument("--seed", type=int, default=2027)
    parser.add_argument("--rounds", type=int, default=5, help="alternating rounds of times")
    parser.add_argument("--jobs", type=int, default=1, help="scenes at a time")
    parser.add_argument("--out", type=Path, default=HERE, help="folder of result.json, result.md")
    options = parser.parse_args()
    families = scenes.TUNING_FAMILIES if options.tuning else scenes.TEST_FAMILIES
    random_scenes = scenes.draw_scenes(families, options.each, options.seed)
    tasks = [(name, trial, options.rounds) for name, trial in random_scenes.items()]
    outcomes: list[trials.Outcome] = []
    scenes_without_reference: dict[str, float] = {}
    data: dict[str, Any] = {
        "machine": measure.machine(), "families": "tuning" if options.tuning else "test",
        "each": options.each, "seed": options.seed, "rounds": options.rounds,
        "jobs": options.jobs, "scenes_drawn": len(tasks),
    }  # fmt: skip
    with get_context("spawn").Pool(options.jobs) as pool:
        for name, new_outcomes, floor in pool.imap_unordered(trials.run_scene, tasks):
            if not new_outcomes:
                scenes_without_reference[name] = floor
            outcomes += new_outcomes
            print(*(trial.text() for trial in new_outcomes), sep="\n", flush=True)
            data |= {
                "without_reference": scenes_without_reference,
                "outcomes": [asdict(trial) for trial in outcomes],
            }
            text = json.dumps(data, indent=1) + "\n"
            (options.out / "result.json").write_text(text, encoding="utf-8")
            (options.out / "result.md").write_text(table(outcomes, data), encoding="utf-8")


if __name__ == "__main__":
    main()
