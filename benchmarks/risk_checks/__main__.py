"""False-alarm and miss rates of the risk checks.

    python -m benchmarks.risk_checks [--tuning] [--each N] [--seed N] [--only FAMILY]

Random scenes, with a parameter on both sides of the value at which a method fails.  Each run is
compared with an accurate one: it is wrong if its error exceeds the bound in the table.  The limits
of the checks were set on the seed of `--tuning`.  No time is measured.
"""

from __future__ import annotations

import json
import math
import warnings
from argparse import ArgumentParser
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from . import bodies, motions
from .report import CheckCase, counts, table
from .trials import Trial

HERE = Path(__file__).resolve().parent

#: Seeds on which the limits were set and tested.
TUNING_SEED, TEST_SEED = 1, 2028

FAMILIES: dict[str, Callable[[np.random.Generator], Trial]] = {
    family.__name__.replace("_", " "): family
    for family in (
        motions.explicit_step, motions.implicit_step, motions.pulse_in_angle,
        motions.pulse_in_time, motions.heavy_tip, motions.gimbal_top, motions.loose_balls,
        bodies.spinning_linear_beam, bodies.light_hub, bodies.strongly_bent_beam,
        bodies.shaken_beam,
    )
}  # fmt: skip

_MOTION_ERROR = "0.1 rad or of the motion"

CHECK_CASES = (
    CheckCase("step-stability", True, "explicit step", "step times fastest motion, 0.2 to 20",
           f"error above {_MOTION_ERROR}"),
    CheckCase("step-accuracy", False, "implicit step", "step, 2 ms to 1 s, of swinging rods",
           f"error above {_MOTION_ERROR}"),
    CheckCase("energy-drift", False, "implicit step", "the same", f"error above {_MOTION_ERROR}"),
    CheckCase("narrow-load", False, "pulse in angle", "width, 0.1 mrad to 1 rad",
           "error above 1e-3 and 100 rtol"),
    CheckCase("narrow-load", True, "pulse in time", "width in steps, 0.02 to 20",
    "error above 1e-3"),
    CheckCase("pivot-loss", True, "heavy tip", "mass in others', 1e2 to 1e13",
           "accelerations off by 1e-8"),
    CheckCase("pivot-loss", False, "heavy tip", "the same", "accelerations off by 1e-8"),
    CheckCase("gimbal", False, "gimbal top", "distance from the lock, 1e-6 to 0.5 rad",
           "attitude off by 1e-5 (fixed steps), 10 rtol"),
    CheckCase("quaternion-length", False, "loose balls", "rtol, 1e-8 to 0.03", "error above 0.01"),
    CheckCase("energy-drift", False, "loose balls", "the same", "error above 0.01"),
    CheckCase("stiffening", True, "spinning linear beam", "spin in first frequencies, 0.03 to 2",
           "deflection off by 10 %"),
    CheckCase("stiffening", False, "spinning linear beam", "the same", "deflection off by 10 %"),
    CheckCase("one-way-coupling", False, "light hub", "hub in the beam's inertia, 0.03 to 300",
           "tip off by 30 % of its deflection"),
    CheckCase("slope", False, "strongly bent beam", "force at the tip, 0.02 to 2 EI/L²",
           "tip off by 2 % of the length"),
    CheckCase("shapes", True, "shaken beam", "frequency in the last shape's, 0.05 to 8",
           "deflection off by 10 %"),
    CheckCase("shapes", False, "shaken beam", "the same", "deflection off by 10 %"),
)  # fmt: skip


def main() -> None:
    """Run all; write result.json and result.md."""
    parser = ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--tuning", action="store_true", help="the seed on which limits were set")
    parser.add_argument("--each", type=int, default=100, help="scenes of each family")
    parser.add_argument("--seed", type=int, default=None)
    parser.add_argument("--only", default=None, help="only this family; nothing is written")
    parser.add_argument("--out", type=Path, default=HERE, help="folder of result.json, result.md")
    options = parser.parse_args()
    seed = (TUNING_SEED if options.tuning else TEST_SEED) if options.seed is None else options.seed
    warnings.simplefilter("ignore", RuntimeWarning)  # of runs that go to infinity
    trials: dict[str, list[Trial]] = {}
    for index, (name, family) in enumerate(FAMILIES.items()):
        if options.only in (None, name):
            rngs = (np.random.default_rng([seed, index, i]) for i in range(options.each))
            trials[name] = [family(rng) for rng in rngs]
            for case in CHECK_CASES:
                if case.family == name:
                    print(case.risk, case.before_run, name, counts(case, trials[name]), flush=True)
    data = {"each": options.each, "seed": seed, "tuning": options.tuning}
    if options.only is None:
        text = table(CHECK_CASES, trials, data)
        print(text)
        rows_by_family = {name: [_row(trial) for trial in rows] for name, rows in trials.items()}
        lines = (
            json.dumps(data | rows_by_family, allow_nan=False).replace(
                '{"drawn_value"', '\n{"drawn_value"'
            )
            + "\n"
        )
        (options.out / "result.json").write_text(lines, encoding="utf-8")
        (options.out / "result.md").write_text(text, encoding="utf-8")


def _row(trial: Trial) -> dict[str, Any]:
    """Plain data with three digits; an error without a number is null."""
    row = asdict(trial)
    for key in ("drawn_value", "error"):
        row[key] = float(f"{row[key]:.3g}") if math.isfinite(row[key]) else None
    return row


if __name__ == "__main__":
    main()
