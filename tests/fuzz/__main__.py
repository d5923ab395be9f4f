"""`python -m tests.fuzz`: many mutants, a table of what became of them, failures kept."""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
import time
from pathlib import Path


def main() -> int:
    """The command; 1 if something came out that must not."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument("--count", type=int, default=1000, help="mutants")
    parser.add_argument("--first", type=int, default=0, help="number of the first mutant")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--engine", default="looped", help='"auto" also uses compiled code')
    parser.add_argument("--of", default="", help="only mutants of scenes with this in their names")
    parser.add_argument("--keep", type=Path, default=Path("fuzz-found"), help="folder of failures")
    parser.add_argument("--cpu", type=float, default=20.0, help="processor time of a phase, s")
    parser.add_argument("--memory", type=float, default=6.0, help="GiB of a worker, 0: no limit")
    parser.add_argument("--replay", type=Path, nargs="+", help="recorded failures, again")
    options = parser.parse_args()
    for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    with tempfile.TemporaryDirectory(prefix="mstmm-cache-") as cache:
        os.environ.setdefault("MSTMM_CACHE", cache)
        return _replay(options) if options.replay else _campaign(options)


def _campaign(options: argparse.Namespace) -> int:
    from .campaign import Campaign
    from .trial import BAD
    from .worker import Limits

    limits = Limits(options.cpu, memory=int(options.memory * 2**30))
    campaign = Campaign(options.seed, limits, options.engine, options.keep, options.of)
    begin = last = time.monotonic()

    def tell(campaign: Campaign) -> None:
        nonlocal last
        if time.monotonic() - last > 30:
            last = time.monotonic()
            bad = sum(campaign.outcomes[kind] for kind in BAD)
            tried = sum(campaign.outcomes.values())
            print(f"{tried} tried, {bad} failed, {last - begin:.0f} s",
                  file=sys.stderr, flush=True)  # fmt: skip

    campaign.run(options.first, options.count, options.jobs, tell)
    print(campaign.table(), flush=True)
    if campaign.failures:
        print(f"kept in {options.keep}/; now made small", flush=True)
        campaign.make_small()
    return 1 if campaign.failures else 0


def _replay(options: argparse.Namespace) -> int:
    from .campaign import Campaign
    from .trial import BAD
    from .worker import Limits

    limits = Limits(options.cpu, memory=int(options.memory * 2**30))
    worst = 0
    for path in options.replay:
        record = json.loads(path.read_text("utf-8"))
        outcome = Campaign(0, limits, options.engine, None).scene_outcome(
            record.get("scene", record), record.get("turn")
        )
        print(f"{path.name}: {outcome.kind} {outcome.detail}")
        if outcome.kind in BAD:
            worst = 1
            print(outcome.text)
    return worst


if __name__ == "__main__":
    sys.exit(main())
