"""Error and cost of advised models, compared with the cheapest model.

    python -m benchmarks.advice [--tuning] [--each N] [--seed N] [--rounds N] [--jobs N]

Four scenes of a hub with a beam, and random scenes (`--tuning`: with the seed used to set the
rules).  Minimum CPU time of whole warm calls in alternating rounds, looped engine.
"""

from __future__ import annotations

from argparse import ArgumentParser
from pathlib import Path
from typing import Any

from ..common import measure
from ..common.random_trials import run_and_store
from ..error_control.scenes import draw_scenes
from . import scenes, trials
from .report import table

HERE = Path(__file__).resolve().parent

#: Seeds of the scenes used to set and to test the rules.
_TUNING_SEED, _TEST_SEED = 7, 2029


def main() -> None:
    """Run all; print, and write result.json and result.md, after every scene."""
    parser = ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--tuning", action="store_true", help="scenes used to set the rules")
    parser.add_argument("--each", type=int, default=4, help="scenes of each family")
    parser.add_argument("--seed", type=int, default=None)
    parser.add_argument("--rounds", type=int, default=7, help="alternating rounds of times")
    parser.add_argument("--jobs", type=int, default=1, help="scenes at a time")
    parser.add_argument("--out", type=Path, default=HERE, help="folder of result.json, result.md")
    options = parser.parse_args()
    seed = options.seed
    if seed is None:
        seed = _TUNING_SEED if options.tuning else _TEST_SEED
    random_scenes = draw_scenes(scenes.FAMILIES, options.each, seed)
    tasks = [
        (name, trial, options.rounds)
        for name, trial in {**scenes.hub_scenes(), **random_scenes}.items()
    ]
    data: dict[str, Any] = {
        "machine": measure.machine(), "set": "tuning" if options.tuning else "test",
        "each": options.each, "seed": seed, "rounds": options.rounds, "jobs": options.jobs,
        "scenes_drawn": len(random_scenes),
    }  # fmt: skip
    run_and_store(trials.run_scene, tasks, options.jobs, data, table, options.out)


if __name__ == "__main__":
    main()
