"""10 s of a three-pin arm and of three balls: CPU time against achieved error.

    python benchmarks/work_precision/run.py [--quick] [--plot]

Everybody runs from the same start to t = 10 s over a range of tolerances or step sizes; the error
is the largest angle by which a hinge is off at the end, against CasADi's equations integrated in
long double.  CPU time of the whole process for one warm run, everything set up; minimum counts.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

import contestants  # noqa: E402
from common import measure, reference, scenes  # noqa: E402
from common.links import COORDINATES, Tree, links_of  # noqa: E402

T_END = 10.0
SCENES = {"arm": scenes.swinging_arm, "balls": scenes.swinging_balls}
ASKED = 1e-9


def error(tree: Tree, q: np.ndarray, exact: np.ndarray) -> float:
    """Largest angle (rad) between where a hinge is and where it should be."""
    worst, at = 0.0, 0
    for link in tree.links:
        size = COORDINATES[link.kind][0]
        a, b = q[at : at + size], exact[at : at + size]
        at += size
        if link.kind == "pin":
            worst = max(worst, abs(float(a[0] - b[0])))
        else:
            a, b = a / np.linalg.norm(a), b / np.linalg.norm(b)
            chord = min(np.linalg.norm(a - b), np.linalg.norm(a + b))
            worst = max(worst, 4 * float(np.arcsin(min(1.0, chord / 2))))
    return worst


def measured(name: str, rounds: int, quick: bool) -> dict[str, Any]:
    """Curve of every contestant on one scene."""
    scene = SCENES[name]()
    tree = links_of(scene)
    q, u = contestants.start(scene)
    exact = reference.end_state(tree, q, u, T_END, 400_000)
    check = reference.end_state(tree, q, u, T_END, 200_000)
    runs: dict[str, Callable[[], np.ndarray]] = {}
    for label, settings in contestants.all_of(scene, tree, q, u, T_END).items():
        chosen = list(settings.items())
        for setting, run in chosen[:: 3 if quick else 1]:
            runs[f"{label}|{setting}"] = run
    curves: dict[str, dict[str, Any]] = {}
    timed: dict[str, Callable[[], float]] = {}
    for key, run in runs.items():
        label, _, setting = key.partition("|")
        try:
            found = run()
        except Exception as failure:  # a peer that gives up is a result too
            curves.setdefault(label, {})[setting] = {"failure": str(failure).splitlines()[0]}
            continue
        curves.setdefault(label, {})[setting] = {"error_rad": error(tree, found[: len(q)], exact)}
        timed[key] = lambda r=run: repeated(r)
    for key, values in measure.rounds(timed, rounds).items():
        label, _, setting = key.partition("|")
        curves[label][setting]["cpu_ms"] = [round(v, 5) for v in values]
    return {"scene": name, "reference_change": error(tree, check, exact), "curves": curves}


def repeated(run: Callable[[], object]) -> float:
    """CPU ms of one run; short ones are repeated until they last 5 ms."""
    first = measure.cpu(run)
    if first > 5e-3:
        return first * 1e3
    count = max(2, int(5e-3 / max(first, 1e-5)))
    return measure.cpu(lambda: [run() for _ in range(count)]) / count * 1e3


def cheapest(curve: dict[str, Any], asked: float = ASKED) -> tuple[str, float] | None:
    """Setting and CPU ms of the cheapest run whose error is small enough."""
    good = [
        (min(point["cpu_ms"]), setting)
        for setting, point in curve.items()
        if point.get("error_rad", 1.0) <= asked and point.get("cpu_ms")
    ]
    return (min(good)[1], min(good)[0]) if good else None


def table(results: list[dict[str, Any]]) -> str:
    """Markdown: cheapest run with an error of at most 1e-9 rad."""
    lines = ["| scene | tool | setting | error, rad | CPU ms | mstmm / it |", "|---" * 6 + "|"]
    for result in results:
        own = cheapest(result["curves"]["mstmm"])
        for name, curve in result["curves"].items():
            found = cheapest(curve)
            if found is None:
                best = min((p["error_rad"] for p in curve.values() if "error_rad" in p), default=1)
                lines.append(f"| {result['scene']} | {name} | none: {best:.1e} at best | | | |")
                continue
            setting, value = found
            ratio = f"{own[1] / value:.3f}" if own else ""
            reached = f"{curve[setting]['error_rad']:.1e}"
            lines.append(
                f"| {result['scene']} | {name} | {setting} | {reached} | {value:.3f} | {ratio} |"
            )
    return "\n".join(lines)


def main() -> None:
    """Measure, print the table, draw."""
    parser = measure.options(str(__doc__).splitlines()[0], HERE)
    parser.add_argument("--rounds", type=int, default=4)
    options = parser.parse_args()
    if not options.plot:
        count = 1 if options.quick else options.rounds
        results = [measured(name, count, options.quick) for name in SCENES]
        measure.save(options.json, results, unit="CPU ms of 10 s", asked_error_rad=ASKED)
    record = json.loads(options.json.read_text())
    text = table(record["results"])
    print(text)
    options.json.with_suffix(".md").write_text(text + "\n")
    from picture import draw

    draw(record, cheapest, options.picture)


if __name__ == "__main__":
    main()
