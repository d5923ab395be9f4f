"""Long chains: CPU time of one evaluation, memory, and who gives up where and how.

    python benchmarks/long_chains/run.py [--quick] [--plot]

Every tool gets a process of its own, 8 GiB and a limit on time; the next size is asked for only
where the one before was mastered.  "run" is CPU time per simulated second from rest: mstmm with
error control at 1e-6, Exudyn's sparse form in implicit steps of 1 ms.
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


def asked(tool: str, kind: str, bodies: int, seconds: float) -> dict[str, Any]:
    """What a tool cost, or how it failed."""
    command = [sys.executable, str(HERE / "worker.py"), tool, kind, str(bodies)]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=seconds)
    except subprocess.TimeoutExpired:
        return {"failure": f"not done after {seconds:g} s"}
    if done.returncode == 0:
        return dict(json.loads(done.stdout.strip().splitlines()[-1]))
    if done.returncode < 0:
        return {"failure": f"killed by signal {-done.returncode} (8 GiB allowed)"}
    lines = [line for line in done.stderr.strip().splitlines() if line.strip()]
    return {"failure": (lines[-1] if lines else f"exit status {done.returncode}")[:160]}


def measured(quick: bool, seconds: float) -> list[dict[str, Any]]:
    """Every tool on every size that it may reach."""
    results = []
    for kind, sizes in SIZES.items():
        for tool in TOOLS:
            for bodies in sizes[:2] if quick else sizes:
                found = asked(tool, kind, bodies, seconds)
                results.append({"tool": tool, "kind": kind, "bodies": bodies, **found})
                print(results[-1], flush=True)
                if "failure" in found:
                    break
    return results


def table(results: list[dict[str, Any]]) -> str:
    """Markdown."""
    lines = [f"| chain | bodies | tool | {' | '.join(COLUMNS.values())} |",
             "|---" * (len(COLUMNS) + 3) + "|"]  # fmt: skip
    for r in sorted(results, key=lambda r: (r["kind"] == "balls", r["bodies"])):
        start = f"| {r['kind']} | {r['bodies']} | {r['tool']} | "
        if "failure" in r:
            lines.append(f"{start}fails: {r['failure']} | | | |")
        else:
            lines.append(
                start + " | ".join(f"{r[c]:.3g}" if c in r else "" for c in COLUMNS) + " |"
            )
    return "\n".join(lines)


def main() -> None:
    """Measure, print the table, draw."""
    parser = measure.options(str(__doc__).splitlines()[0], HERE)
    parser.add_argument("--seconds", type=float, default=40.0, help="limit for one tool and size")
    options = parser.parse_args()
    if not options.plot:
        measure.save(options.json, measured(options.quick, options.seconds))
    record = json.loads(options.json.read_text())
    text = table(record["results"])
    print(text)
    options.json.with_suffix(".md").write_text(text + "\n")
    from picture import draw

    draw(record, options.picture)


if __name__ == "__main__":
    main()
