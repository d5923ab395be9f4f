"""Flexible bodies beside Exudyn's ANCF cable: a beam that is spun up, a chain of 100 strips.

    python benchmarks/flexible/run.py [--quick] [--plot]

Spin-up (20 s): a setting is good enough if the largest deflection of the tip is within 2e-3 m of
-0.57375 m, and found within 0.06 s of 6.762 s (so that no coarse run passes by accident).  Chain
(3 s): good enough if the tip stays within 2e-3 m of a converged run of the same tool, at 301 times.
Every tool tries a grid of settings, each watched once; the cheapest ones that are good enough are
then timed in alternating rounds, nothing watched.  CPU time of one whole call of `simulate` or
`SolveDynamic`, everything set up; C code of mstmm's scenes is compiled before and kept.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

import contestants  # noqa: E402
from common import measure  # noqa: E402

ASKED, AT = 2e-3, 0.06  # m, s
RATIO = 0.02
FINALISTS = 5


def measured(name: str, quick: bool, rounds: int) -> dict[str, Any]:
    """Every setting once, the cheapest good ones in rounds."""
    tools = contestants.SCENES[name](quick)
    settings: dict[str, dict[str, Any]] = {}
    finalists: dict[str, contestants.Setting] = {}
    for tool, found in tools.items():
        settings[tool] = {}
        for label, setting in found.items():
            settings[tool][label] = tried(setting)
            print(name, tool, label, settings[tool][label], flush=True)
        good = [k for k, v in settings[tool].items() if enough(v)]
        for label in sorted(good, key=lambda k: settings[tool][k]["watched_cpu_ms"])[:FINALISTS]:
            finalists[f"{tool}|{label}"] = found[label]
    timed = {key: setting.time for key, setting in finalists.items()}
    for key, values in measure.rounds(timed, rounds).items():
        tool, _, label = key.partition("|")
        settings[tool][label]["cpu_ms"] = [round(1e3 * v, 5) for v in values]
        print(name, key, f"{1e3 * min(values):.4g} ms", flush=True)
    return {"scene": name, "asked_m": ASKED, "about": contestants.ABOUT[name], "tools": settings}


def tried(setting: contestants.Setting) -> dict[str, Any]:
    """Error and CPU time of one watched run, or how it failed."""
    try:
        error, when, seconds = setting.watch()
    except Exception as failure:  # one that gives up is a result too
        return {"failure": (str(failure).strip().splitlines() or ["failed"])[0][:120]}
    found = {"error_m": float(error), "watched_cpu_ms": round(1e3 * seconds, 4)}
    return found if when is None else {**found, "late_s": float(when)}


def enough(point: dict[str, Any]) -> bool:
    """True for a run that is as accurate as asked."""
    if not point.get("error_m", np.inf) <= ASKED:
        return False
    return abs(point.get("late_s", 0.0)) <= AT


def cheapest(points: dict[str, Any]) -> tuple[str, float] | None:
    """Setting and CPU ms of the cheapest one that was timed."""
    found = [(min(p["cpu_ms"]), label) for label, p in points.items() if p.get("cpu_ms")]
    return (min(found)[1], min(found)[0]) if found else None


def ratio(result: dict[str, Any], own: str = "mstmm") -> float | None:
    """CPU time of mstmm over that of Exudyn."""
    ours = [cheapest(p) for tool, p in result["tools"].items() if tool.startswith(own)]
    times = [found[1] for found in ours if found]
    other = cheapest(result["tools"]["Exudyn"])
    return min(times) / other[1] if times and other else None


def table(results: list[dict[str, Any]]) -> str:
    """Markdown: the cheapest good setting of every tool."""
    lines = ["| scene | tool | setting | error, m | CPU ms | of Exudyn's |", "|---" * 6 + "|"]
    for result in results:
        other = cheapest(result["tools"]["Exudyn"])
        for tool, points in result["tools"].items():
            found = cheapest(points)
            if found is None:
                lines.append(f"| {result['scene']} | {tool} | none good enough | | | |")
                continue
            label, value = found
            share = f"{value / other[1]:.4f}" if other else ""
            error = f"{points[label]['error_m']:.1e}"
            lines.append(
                f"| {result['scene']} | {tool} | {label} | {error} | {value:.4g} | {share} |"
            )
    return "\n".join(lines)


def main() -> None:
    """Measure, print the table, draw."""
    parser = measure.options(str(__doc__).splitlines()[0], HERE)
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--scene", choices=list(contestants.SCENES), action="append")
    options = parser.parse_args()
    if not options.plot:
        kept = {}
        if options.scene and options.json.exists():
            kept = {r["scene"]: r for r in json.loads(options.json.read_text())["results"]}
        for name in options.scene or contestants.SCENES:
            kept[name] = measured(name, options.quick, 2 if options.quick else options.rounds)
        measure.save(options.json, list(kept.values()), unit="CPU ms of one run", asked_ratio=RATIO)
    record = json.loads(options.json.read_text())
    text = table(record["results"])
    print(text)
    options.json.with_suffix(".md").write_text(text + "\n")
    from picture import draw

    draw(record, enough, options.picture)


if __name__ == "__main__":
    main()
