"""Flexible bodies compared with Exudyn's ANCF cable: spin-up of a beam, chain of 100 strips.

    python benchmarks/flexible/run.py [--quick] [--plot]

Spin-up (20 s): a setting is accurate if the largest deflection of the tip is within 2e-3 m of
-0.57375 m, at a time within 0.06 s of 6.762 s.  Chain (3 s): accurate if the tip stays within
2e-3 m of a converged run of the same program, at 301 times.  Each program tries a grid of settings
once; the cheapest accurate ones are then timed in alternating rounds without recording.  CPU time
of one whole call of `simulate` or `SolveDynamic` without set-up; C code of mstmm's scenes is
compiled beforehand.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

import programs  # noqa: E402
from common import measure  # noqa: E402

MAX_ERROR, MAX_TIME_ERROR = 2e-3, 0.06  # m, s
TARGET_RATIO = 0.02
FINALISTS = 5


def measure_scene(name: str, quick: bool, rounds: int) -> dict[str, Any]:
    """Evaluate each setting once, then time the cheapest accurate ones in rounds."""
    settings_by_tool = programs.SCENES[name](quick)
    settings: dict[str, dict[str, Any]] = {}
    finalists: dict[str, programs.Setting] = {}
    for tool, settings_of_tool in settings_by_tool.items():
        settings[tool] = {}
        for label, setting in settings_of_tool.items():
            settings[tool][label] = evaluate_setting(setting)
            print(name, tool, label, settings[tool][label], flush=True)
        accurate = [k for k, value in settings[tool].items() if is_accurate(value)]
        for label in sorted(accurate, key=lambda k: settings[tool][k]["first_cpu_ms"])[:FINALISTS]:
            finalists[f"{tool}|{label}"] = settings_of_tool[label]
    timers = {key: setting.run_time for key, setting in finalists.items()}
    for key, values in measure.sample_rounds(timers, rounds).items():
        tool, _, label = key.partition("|")
        settings[tool][label]["cpu_ms"] = [round(1e3 * value, 5) for value in values]
        print(name, key, f"{1e3 * min(values):.4g} ms", flush=True)
    return {"scene": name, "target_error_m": MAX_ERROR,
            "description": programs.DESCRIPTIONS[name], "tools": settings}  # fmt: skip


def evaluate_setting(setting: programs.Setting) -> dict[str, Any]:
    """Error and CPU time of one run, or why it failed."""
    try:
        error, time_error, seconds = setting.evaluate()
    except Exception as failure:  # a failed run is a result too
        return {"failure": (str(failure).strip().splitlines() or ["failed"])[0][:120]}
    point = {"error_m": float(error), "first_cpu_ms": round(1e3 * seconds, 4)}
    return point if time_error is None else {**point, "time_error_s": float(time_error)}


def is_accurate(point: dict[str, Any]) -> bool:
    """Whether a run meets the error limits."""
    if not point.get("error_m", np.inf) <= MAX_ERROR:
        return False
    return abs(point.get("time_error_s", 0.0)) <= MAX_TIME_ERROR


def cheapest(points: dict[str, Any]) -> tuple[str, float] | None:
    """Setting and CPU ms of the cheapest timed point."""
    timed = [(min(p["cpu_ms"]), label) for label, p in points.items() if p.get("cpu_ms")]
    return (min(timed)[1], min(timed)[0]) if timed else None


def ratio(result: dict[str, Any], prefix: str = "mstmm") -> float | None:
    """CPU time of mstmm over that of Exudyn."""
    mstmm_best = [cheapest(p) for tool, p in result["tools"].items() if tool.startswith(prefix)]
    times = [best[1] for best in mstmm_best if best]
    exudyn_best = cheapest(result["tools"]["Exudyn"])
    return min(times) / exudyn_best[1] if times and exudyn_best else None


def table(results: list[dict[str, Any]]) -> str:
    """Markdown: the cheapest accurate setting of each program."""
    lines = ["| scene | tool | setting | error, m | CPU ms | of Exudyn's |", "|---" * 6 + "|"]
    for result in results:
        exudyn_best = cheapest(result["tools"]["Exudyn"])
        for tool, points in result["tools"].items():
            best = cheapest(points)
            if best is None:
                lines.append(f"| {result['scene']} | {tool} | none is accurate | | | |")
                continue
            label, value = best
            share = f"{value / exudyn_best[1]:.4f}" if exudyn_best else ""
            error = f"{points[label]['error_m']:.1e}"
            lines.append(
                f"| {result['scene']} | {tool} | {label} | {error} | {value:.4g} | {share} |"
            )
    return "\n".join(lines)


def main() -> None:
    """Measure, print the table, draw."""
    parser = measure.option_parser(str(__doc__).splitlines()[0], HERE)
    parser.add_argument("--rounds", type=int, default=9)
    options = parser.parse_args()
    if not options.plot:
        rounds = 2 if options.quick else options.rounds
        results = [measure_scene(name, options.quick, rounds) for name in programs.SCENES]
        measure.save_record(
            options.json, results, unit="CPU ms of one run", target_ratio=TARGET_RATIO
        )
    record = measure.write_table(options.json, table)
    from picture import draw

    draw(record, is_accurate, options.picture)


if __name__ == "__main__":
    main()
