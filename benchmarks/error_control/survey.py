"""How often `simulate(error=...)` says that an error is met which is not: on unseen scenes.

    python -m benchmarks.error_control.survey [--each N] [--seed N]

Every scene is asked for several errors and compared with a much tighter run, which a tighter run of
another method confirms.  What it costs is not looked at.
"""

from __future__ import annotations

from argparse import ArgumentParser
from dataclasses import dataclass

import mstmm

from .cheapest_setting import Reference, compute_reference, run_timed
from .scenes import draw_scenes
from .unseen_scenes import UNSEEN_FAMILIES

#: Errors that are asked for, and how far one that is met may be above what was asked.
TARGET_ERRORS, TOLERATED_FACTOR = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8), 1.5

#: A reference that is off by more than this part of what was asked for judges nothing.
_MAX_REFERENCE_ERROR_RATIO = 0.1


@dataclass
class Count:
    """What the errors that were asked for became."""

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
    """Print every miss, and the counts over all."""
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
    """Ask a scene for an error and count; print what is not met or not kept."""
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
