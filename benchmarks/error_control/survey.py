"""How often `simulate(error=...)` wrongly reports that a target is met, on further scenes.

    python -m benchmarks.error_control.survey [--each N] [--seed N]

Each scene runs with several target errors and is compared with a much tighter run, which a run of
another method confirms.
"""

from __future__ import annotations

from argparse import ArgumentParser
from dataclasses import dataclass

import mstmm

from .cheapest_setting import Reference, compute_reference, run_timed
from .scenes import draw_scenes
from .unseen_scenes import UNSEEN_FAMILIES

#: Target errors, and the tolerated ratio of error and target.
TARGET_ERRORS, TOLERATED_FACTOR = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8), 1.5

#: Largest error of a reference relative to the target.
_MAX_REFERENCE_ERROR_RATIO = 0.1


@dataclass
class Count:
    """Counts of requests and outcomes."""

    requests: int = 0
    reported_met: int = 0
    within_factor: int = 0
    runs: int = 0
    cpu_s: float = 0.0

    def __str__(self) -> str:
        share = 100.0 * self.within_factor / max(self.reported_met, 1)
        return (
            f"{self.requests} requests, {self.reported_met} met, {self.within_factor} of them "
            f"within {TOLERATED_FACTOR:g} times the target ({share:.1f} %), "
            f"{self.runs} runs, {self.cpu_s:.1f} s"
        )


def main() -> None:
    """Print all misses and the counts."""
    parser = ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--each", type=int, default=5, help="scenes of each of twelve families")
    parser.add_argument("--seed", type=int, default=39)
    parser.add_argument("--only", default="", help="names of families, separated by commas")
    options = parser.parse_args()
    families = {
        key: family
        for key, family in UNSEEN_FAMILIES.items()
        if not options.only or key in options.only.split(",")
    }
    count = Count()
    for name, (tables, t_end) in draw_scenes(families, options.each, options.seed).items():
        model = mstmm.compile(mstmm.Scene(**tables), engine="looped")
        reference = compute_reference(model, t_end)
        if reference is None:
            print(f"{name}: no reference", flush=True)
            continue
        for target in TARGET_ERRORS:
            if reference.error <= _MAX_REFERENCE_ERROR_RATIO * target:
                check_target_error(name, model, t_end, reference, target, count)
    print(count)


def check_target_error(
    name: str, model: mstmm.Model, t_end: float, reference: Reference, target: float, count: Count
) -> None:
    """Run a scene with a target error and count; print failures."""
    result, seconds = run_timed(model, t_end, error=target)
    achieved = result.achieved_error
    assert achieved is not None
    count.requests += 1
    count.runs += len(achieved.runs)
    count.cpu_s += seconds
    if not achieved.is_met:
        print(f"{name}: target {target:.0e}, not met: {achieved.reason}", flush=True)
        return
    error = float(reference.measure.distance(reference.numbers, result.q).max())
    count.reported_met += 1
    count.within_factor += error <= TOLERATED_FACTOR * target
    if error > TOLERATED_FACTOR * target:
        runs = ", ".join(f"{run.method} {run.rtol:.1e}" for run in achieved.runs)
        print(
            f"{name}: target {target:.0e}, estimate {achieved.estimate:.1e}, true {error:.1e}; "
            f"{runs}"
        )


if __name__ == "__main__":
    main()
