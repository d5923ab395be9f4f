"""Long chains: CPU time of one evaluation, memory, and failures.

    python benchmarks/long_chains/run.py [--quick] [--plot]

Each program runs in its own process with 8 GiB and a time limit; after a failure larger sizes are
skipped.  "run" is CPU time per simulated second from rest, extrapolated: mstmm from 0.02 s with
error control at 1e-6, Exudyn's sparse form from three implicit steps of 1 ms.
"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

from common import measure  # noqa: E402

SIZES = {"pins": (100, 1000, 10_000, 100_000), "balls": (100, 1000, 10_000, 33_334)}
TOOLS = ("mstmm", "Pinocchio", "MuJoCo", "Drake", "Exudyn, tree", "Exudyn, sparse")
COLUMNS = {
    "build_s": "build, CPU s", "evaluation_ms": "evaluation, CPU ms",
    "run_s_per_s": "run, CPU s per s", "memory_mib": "memory, MiB",
}  # fmt: skip


def run_worker(tool: str, kind: str, bodies: int, seconds: float) -> dict[str, Any]:
    """Cost of a program, or its failure."""
    command = [sys.executable, str(HERE / "worker.py"), tool, kind, str(bodies)]
    try:
        process = subprocess.run(command, capture_output=True, text=True, timeout=seconds)
    except subprocess.TimeoutExpired:
        return {"failure": f"not done after {seconds:g} s"}
    if process.returncode == 0:
        return dict(json.loads(process.stdout.strip().splitlines()[-1]))
    if process.returncode < 0:
        return {"failure": f"killed by signal {-process.returncode} (8 GiB allowed)"}
    lines = [line for line in process.stderr.strip().splitlines() if line.strip()]
    return {"failure": (lines[-1] if lines else f"exit status {process.returncode}")[:160]}


def measure_tools(quick: bool, seconds: float) -> list[dict[str, Any]]:
    """All programs on all sizes up to their first failure."""
    results = []
    for kind, sizes in SIZES.items():
        for tool in TOOLS:
            for bodies in sizes[:2] if quick else sizes:
                outcome = run_worker(tool, kind, bodies, seconds)
                results.append({"tool": tool, "kind": kind, "bodies": bodies, **outcome})
                print(results[-1], flush=True)
                if "failure" in outcome:
                    break
    return results


def table(results: list[dict[str, Any]]) -> str:
    """Markdown."""
    lines = [f"| chain | bodies | tool | {' | '.join(COLUMNS.values())} |",
             "|---" * (len(COLUMNS) + 3) + "|"]  # fmt: skip
    for r in sorted(results, key=lambda r: (r["kind"] == "balls", r["bodies"])):
        prefix = f"| {r['kind']} | {r['bodies']} | {r['tool']} | "
        if "failure" in r:
            lines.append(f"{prefix}fails: {r['failure']} | | | |")
        else:
            lines.append(
                prefix + " | ".join(f"{r[c]:.3g}" if c in r else "" for c in COLUMNS) + " |"
            )
    return "\n".join(lines)


def main() -> None:
    """Measure, print the table, draw."""
    parser = measure.option_parser(str(__doc__).splitlines()[0], HERE)
    parser.add_argument("--seconds", type=float, default=40.0, help="limit for one tool and size")
    options = parser.parse_args()
    if not options.plot:
        measure.save_record(options.json, measure_tools(options.quick, options.seconds))
    record = measure.write_table(options.json, table)
    from picture import draw

    draw(record, options.picture)


if __name__ == "__main__":
    main()
