"""What it takes to compile for scenes of more and more bodies: Markdown, on the standard output.

CPU seconds (user and system) of one fresh process each, its cache empty: our own text and the
compiler's.  `python benchmarks/startup/growth.py [KIND ...]`.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from resource import RUSAGE_CHILDREN, RUSAGE_SELF, getrusage
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from common import scenes
from common.flexible_scenes import Strip

COUNTS = (25, 50, 100, 200)
#: Beyond what a busy machine needs, in s of wall time.
PATIENCE = "3600"


def tree(n: int) -> dict[str, Any]:
    """Pins; every body carries two others."""
    made = scenes.pins(n)
    for i, hinge in enumerate(made["hinge"][1:]):
        hinge["inboard"] = f"rod{i // 2}.tip"
    return made


KINDS: dict[str, Callable[[int], dict[str, Any]]] = {
    "pins": scenes.pins, "branched pins": tree, "arm": scenes.arm, "balls": scenes.balls,
    "strips, 1 shape": lambda n: Strip.chain(n, 1), "strips, 4 shapes": lambda n: Strip.chain(n, 4),
}  # fmt: skip


def spent(who: int) -> float:
    """CPU seconds so far."""
    usage = getrusage(who)
    return usage.ru_utime + usage.ru_stime


def measure(kind: str, count: int) -> None:
    """Print our seconds and the compiler's; in a process of its own."""
    import mstmm

    scene = mstmm.Scene(**KINDS[kind](count))
    mstmm.compile(scene, engine="looped")
    before = spent(RUSAGE_SELF)
    mstmm.compile(scene, engine="fused")
    print(f"{spent(RUSAGE_SELF) - before:.2f} {spent(RUSAGE_CHILDREN):.2f}")


def measured(kind: str, count: int) -> str:
    """A cell: both seconds."""
    with tempfile.TemporaryDirectory(prefix="growth-") as cache:
        environment = os.environ | {"MSTMM_CACHE": cache, "MSTMM_COMPILE_TIMEOUT": PATIENCE}
        command = [sys.executable, __file__, "--one", kind, str(count)]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    return " + ".join(done.stdout.split()[-2:])


def main() -> None:
    """All of the table, or the rows of some kinds."""
    if sys.argv[1:2] == ["--one"]:
        measure(sys.argv[2], int(sys.argv[3]))
        return
    print(f"| CPU s, ours + gcc's | {' | '.join(map(str, COUNTS))} |")
    print("|---" * (1 + len(COUNTS)) + "|")
    for kind in sys.argv[1:] or KINDS:
        cells = (measured(kind, count) for count in COUNTS)
        print(f"| {kind} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
