"""Achieved error, estimate and cost of `simulate(error=...)` on random scenes.

    python -m benchmarks.error_control [--tuning] [--each N] [--seed N] [--rounds N] [--jobs N]

Random scenes of families that were not used to set the rule (`--tuning`: of those that were).  Each
runs with three target errors, and is compared with a reference and with the cheapest single run
that meets the target: the best of all adaptive methods and tolerances, including accidentally
accurate ones.  Minimum CPU time of whole warm calls in alternating rounds, looped engine.
"""

from __future__ import annotations

from argparse import ArgumentParser
from pathlib import Path
from typing import Any

from ..common import measure
from ..common.random_trials import run_and_store
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
    data: dict[str, Any] = {
        "machine": measure.machine(), "families": "tuning" if options.tuning else "test",
        "each": options.each, "seed": options.seed, "rounds": options.rounds,
        "jobs": options.jobs, "scenes_drawn": len(tasks),
    }  # fmt: skip
    run_and_store(trials.run_scene, tasks, options.jobs, data, table, options.out)


if __name__ == "__main__":
    main()
