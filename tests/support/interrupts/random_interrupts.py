"""Kill runs at random moments, as long as wanted: a program, not a test.

    python tests/support/interrupts/random_interrupts.py --kills 200 --signal SIGKILL --seed 1

Runs of about a second with a checkpoint every 10 ms are signalled after a random time and continued
with --resume, again and again, until one ends.  After every kill the checkpoint, if there ever was
one, reaches at least as far as before, or the whole result is there.  A result has the bytes of an
uninterrupted one, and nothing else lies about.  Ends with 1 at the first run where that is not so.
"""

from __future__ import annotations

import argparse
import random
import signal
import sys
import tempfile
import time
import zipfile
from collections import Counter
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[3]))

from tests.support.interrupts.interrupted_commands import CHECKPOINT, RESULT, Laboratory

PACE = 0.01


def checkpoint_time(laboratory: Laboratory) -> float:
    """Time of the checkpoint's last sample; -1 without one."""
    try:
        with np.load(laboratory.folder / CHECKPOINT) as file:
            return float(file["t"][-1])
    except FileNotFoundError:
        return -1.0
    except (ValueError, zipfile.BadZipFile) as error:
        raise AssertionError(f"the checkpoint is damaged: {error}") from error


def until_it_ends(
    laboratory: Laboratory, options: tuple[str, ...], which: signal.Signals,
    draw: random.Random, seconds: float, met: Counter[str],
) -> None:  # fmt: skip
    """One run, killed until it is through."""
    before = -1.0
    while True:
        more = ["--resume"] if before >= 0 else []
        after = draw.uniform(0.0, seconds)
        end = laboratory.command(*options, *more, which=which, after=after, pace=PACE)
        met["kills"] += end.code != 0
        met[f"exit code {end.code}"] += 1
        assert end.code in (0, 130, -which), end
        assert (end.code == 130) == ("mstmm: interrupted" in end.err), end
        now, names = checkpoint_time(laboratory), laboratory.names()
        met["leftovers"] += bool(names - {CHECKPOINT, RESULT})
        if now < 0 and RESULT in names:
            return
        assert now >= before, f"the checkpoint reached {before} s, then {now} s"
        before = now


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--signal", default="SIGKILL", choices=["SIGINT", "SIGTERM", "SIGKILL"])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--t-end", type=float, default=1000.0, help="of the run, s")
    asked = parser.parse_args()
    which, draw, met = signal.Signals[asked.signal], random.Random(asked.seed), Counter[str]()
    options = ("--t-end", f"{asked.t_end:g}", "--step", "0.002", "--times", "500")
    with tempfile.TemporaryDirectory() as name:
        laboratory = Laboratory(Path(name))
        try:
            begin = time.monotonic()
            assert laboratory.command(*options, pace=PACE).code == 0
            seconds = time.monotonic() - begin
            whole = (laboratory.folder / RESULT).read_bytes()
            print(f"an uninterrupted run takes {seconds:.1f} s", flush=True)
            while met["kills"] < asked.kills:
                laboratory.clear()
                until_it_ends(laboratory, options, which, draw, 0.6 * seconds, met)
                assert (laboratory.folder / RESULT).read_bytes() == whole, "another result"
                left = laboratory.names() - {RESULT}
                assert all(each.endswith(".lock") for each in left), left  # killed at the very end
                met["runs with the bytes of the whole"] += 1
        finally:
            laboratory.close()
    print(f"{asked.signal}: {dict(met)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
