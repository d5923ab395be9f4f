"""10 s of a three-pin arm and of three balls: CPU time against achieved error.

    python benchmarks/work_precision/run.py [--quick] [--plot]

All programs start from the same state and run to t = 10 s over a range of tolerances or step sizes.
The error is the largest angle error of a hinge at the end, against CasADi's equations integrated
in long double.  CPU time of the whole process for one warm run without set-up; the minimum counts.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

import programs  # noqa: E402
from common import measure, reference, scenes  # noqa: E402
from common.links import COORDINATES, Tree, link_tree  # noqa: E402

T_END = 10.0
SCENES = {"arm": scenes.swinging_arm, "balls": scenes.swinging_balls}
TARGET_ERROR = 1e-9


def angle_error(tree: Tree, q: np.ndarray, exact: np.ndarray) -> float:
    """Largest error of a hinge angle, rad."""
    largest, offset = 0.0, 0
    for link in tree.links:
        size = COORDINATES[link.kind][0]
        a, b = q[offset : offset + size], exact[offset : offset + size]
        offset += size
        if link.kind == "pin":
            largest = max(largest, abs(float(a[0] - b[0])))
        else:
            a, b = a / np.linalg.norm(a), b / np.linalg.norm(b)
            chord = min(np.linalg.norm(a - b), np.linalg.norm(a + b))
            largest = max(largest, 4 * float(np.arcsin(min(1.0, chord / 2))))
    return largest


def measure_scene(name: str, rounds: int, quick: bool) -> dict[str, Any]:
    """Work-precision curves of all programs on one scene."""
    scene = SCENES[name]()
    tree = link_tree(scene)
    q, u = programs.initial_state(scene)
    exact = reference.end_state(tree, q, u, T_END, 400_000)
    coarse = reference.end_state(tree, q, u, T_END, 200_000)
    runs: dict[str, Callable[[], np.ndarray]] = {}
    for label, settings in programs.all_settings(scene, tree, q, u, T_END).items():
        all_runs = list(settings.items())
        for setting, run in all_runs[:: 3 if quick else 1]:
            runs[f"{label}|{setting}"] = run
    curves: dict[str, dict[str, Any]] = {}
    timed_runs: dict[str, Callable[[], float]] = {}
    for key, run in runs.items():
        label, _, setting = key.partition("|")
        try:
            end_q = run()
        except Exception as failure:  # a peer that gives up is a result too
            curves.setdefault(label, {})[setting] = {"failure": str(failure).splitlines()[0]}
            continue
        curves.setdefault(label, {})[setting] = {
            "error_rad": angle_error(tree, end_q[: len(q)], exact)
        }
        timed_runs[key] = lambda r=run: 1e3 * measure.call_time(r)
    for key, values in measure.sample_rounds(timed_runs, rounds).items():
        label, _, setting = key.partition("|")
        curves[label][setting]["cpu_ms"] = [round(v, 5) for v in values]
    return {"scene": name, "reference_change": angle_error(tree, coarse, exact), "curves": curves}


def cheapest(curve: dict[str, Any], target_error: float = TARGET_ERROR) -> tuple[str, float] | None:
    """Setting and CPU ms of the cheapest run whose error is small enough."""
    accurate = [
        (min(point["cpu_ms"]), setting)
        for setting, point in curve.items()
        if point.get("error_rad", 1.0) <= target_error and point.get("cpu_ms")
    ]
    return (min(accurate)[1], min(accurate)[0]) if accurate else None


def table(results: list[dict[str, Any]]) -> str:
    """Markdown: cheapest run with an error of at most 1e-9 rad."""
    lines = ["| scene | tool | setting | error, rad | CPU ms | mstmm / it |", "|---" * 6 + "|"]
    for result in results:
        own_best = cheapest(result["curves"]["mstmm"])
        for name, curve in result["curves"].items():
            best = cheapest(curve)
            if best is None:
                smallest_error = min(
                    (p["error_rad"] for p in curve.values() if "error_rad" in p), default=1
                )
                lines.append(
                    f"| {result['scene']} | {name} | none: {smallest_error:.1e} at best | | | |"
                )
                continue
            setting, value = best
            ratio = f"{own_best[1] / value:.3f}" if own_best else ""
            achieved = f"{curve[setting]['error_rad']:.1e}"
            lines.append(
                f"| {result['scene']} | {name} | {setting} | {achieved} | {value:.3f} | {ratio} |"
            )
    return "\n".join(lines)


def main() -> None:
    """Measure, print the table, draw."""
    parser = measure.option_parser(str(__doc__).splitlines()[0], HERE)
    parser.add_argument("--rounds", type=int, default=4)
    options = parser.parse_args()
    if not options.plot:
        count = 1 if options.quick else options.rounds
        results = [measure_scene(name, count, options.quick) for name in SCENES]
        measure.save_record(
            options.json, results, unit="CPU ms of 10 s", target_error_rad=TARGET_ERROR
        )
    record = measure.write_table(options.json, table)
    from picture import draw

    draw(record, cheapest, options.picture)


if __name__ == "__main__":
    main()
