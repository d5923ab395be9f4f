"""CPU time of compilation over the number of bodies, as Markdown on the standard output.

CPU seconds (user and system) of a fresh process with an empty cache: mstmm + gcc.
`python benchmarks/startup/compile_time.py [KIND ...]`.
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
#: Wall time, s; sufficient for a busy machine.
TIMEOUT = "3600"


def tree(n: int) -> dict[str, Any]:
    """Pins; every body carries two others."""
    scene = scenes.pins(n)
    for i, hinge in enumerate(scene["hinge"][1:]):
        hinge["inboard"] = f"rod{i // 2}.tip"
    return scene


KINDS: dict[str, Callable[[int], dict[str, Any]]] = {
    "pins": scenes.pins, "branched pins": tree, "arm": scenes.arm, "balls": scenes.balls,
    "strips, 1 shape": lambda n: Strip.chain(n, 1), "strips, 4 shapes": lambda n: Strip.chain(n, 4),
}  # fmt: skip


def cpu_seconds(usage_kind: int) -> float:
    """CPU seconds so far."""
    usage = getrusage(usage_kind)
    return usage.ru_utime + usage.ru_stime


def print_cost(kind: str, count: int) -> None:
    """Print the CPU seconds of mstmm and of gcc, in a separate process."""
    import mstmm

    scene = mstmm.Scene(**KINDS[kind](count))
    mstmm.compile(scene, engine="looped")
    before = cpu_seconds(RUSAGE_SELF)
    mstmm.compile(scene, engine="fused")
    print(f"{cpu_seconds(RUSAGE_SELF) - before:.2f} {cpu_seconds(RUSAGE_CHILDREN):.2f}")


def table_cell(kind: str, count: int) -> str:
    """A cell: both seconds."""
    with tempfile.TemporaryDirectory(prefix="growth-") as cache:
        environment = os.environ | {"MSTMM_CACHE": cache, "MSTMM_COMPILE_TIMEOUT": TIMEOUT}
        command = [sys.executable, __file__, "--one", kind, str(count)]
        process = subprocess.run(
            command, env=environment, capture_output=True, text=True, check=True
        )
    return " + ".join(process.stdout.split()[-2:])


def main() -> None:
    """All of the table, or the rows of some kinds."""
    if sys.argv[1:2] == ["--one"]:
        print_cost(sys.argv[2], int(sys.argv[3]))
        return
    print(f"| CPU s, ours + gcc's | {' | '.join(map(str, COUNTS))} |")
    print("|---" * (1 + len(COUNTS)) + "|")
    for kind in sys.argv[1:] or KINDS:
        cells = (table_cell(kind, count) for count in COUNTS)
        print(f"| {kind} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
