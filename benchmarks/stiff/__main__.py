"""Stiff motions: CPU time and work against achieved error, mstmm's methods beside their peers.

    python -m benchmarks.stiff [CASE ...] [--methods NAMES] [--quick] [--plot] [--references]

Every contestant runs every case from loose to tight settings; the error is the largest distance (m)
of a watched end from where it should be at the end (`references.py`).  Counted is the cheapest
setting that meets an error and all of whose tighter ones meet it too.  Runs of all contestants
alternate in one process; times are CPU times of one whole warm call, the minimum counts.  Points
whose evaluations, residuals, tangents and solves are known are also counted in evaluations.
"""

from __future__ import annotations

import json
import warnings
from argparse import ArgumentParser, Namespace
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from ..common import measure
from . import programs, references
from .cases import CASES, Case
from .counting import cheapest, evaluations, milliseconds

HERE = Path(__file__).resolve().parent
ASKED = (1e-2, 1e-3, 1e-4, 1e-6, 1e-8)


@cache
def say(what: str) -> None:
    """Print it, the first time."""
    print(what, flush=True)


def measured(case: Case, options: Namespace) -> dict[str, Any]:
    """All curves of one case, timed in alternating rounds."""
    exact, apart = references.load(case)
    curves = programs.of_case(case, options.methods.split(","), say)
    found = []
    for curve in curves:
        points = list(tried(curve, exact, options))
        found.append({"tool": curve.tool, "manner": curve.manner, "points": points})
        print(case.name, curve.tool, curve.manner, len(points), "settings", flush=True)
    timed = [
        (point, dict(curve.settings)[point["tolerance"]])
        for curve, kept in zip(curves, found, strict=True)
        for point in kept["points"]
        if "error_m" in point
    ]
    for _ in range(options.rounds):
        for point, run in timed:
            if sum(point["cpu_ms"]) < 1e3 * options.budget:
                point["cpu_ms"].append(round(1e3 * measure.once(run), 4))
    return {"case": case.name, "title": case.title, "t_end_s": case.t_end,
            "reference_apart_m": apart, "curves": found}  # fmt: skip


def tried(curve: programs.Curve, exact: np.ndarray, options: Namespace) -> Iterator[dict[str, Any]]:
    """One point per setting, up to the first that takes longer than allowed (loose ones may, where
    they struggle) or the second that nobody asks to be so accurate."""
    accurate = 0
    for number, (tolerance, run) in enumerate(list(curve.settings)[:: 4 if options.quick else 1]):
        try:
            box: list[programs.Outcome] = []
            spent = measure.cpu(lambda run=run, box=box: box.append(run()))
            look, counts = box[0]
            error = float(np.linalg.norm(look() - exact, axis=1).max())
        except Exception as failure:  # one that gives up is a result too
            text = (str(failure).strip().splitlines() or [type(failure).__name__])[0]
            yield {"tolerance": tolerance, "failure": text[:120]}
            continue
        if not np.isfinite(error):
            yield {"tolerance": tolerance, "failure": "places that are not numbers"}
            continue
        yield {"tolerance": tolerance, "error_m": float(f"{error:.4g}"), "counts": counts,
               "cpu_ms": [round(1e3 * spent, 4)]}  # fmt: skip
        accurate = accurate + 1 if error < min(ASKED) / 10 else 0
        if accurate == 2 or (number > 1 and spent > options.limit):
            return


def tools(result: dict[str, Any]) -> dict[str, list[dict[str, Any]]]:
    """Tool -> its curves."""
    found: dict[str, list[dict[str, Any]]] = {}
    for curve in result["curves"]:
        found.setdefault(curve["tool"], []).append(curve)
    return found


def table(results: list[dict[str, Any]]) -> str:
    """Markdown: for every error asked, each tool's cheapest CPU ms (and evaluations)."""
    lines = []
    for result in results:
        lines += [
            f"**{result['case']}**: {result['title']}, {result['t_end_s']:g} s", "",
            "| tool | " + " | ".join(f"{asked:.0e} m" for asked in ASKED) + " |",
            "|---" * (len(ASKED) + 1) + "|",
        ]  # fmt: skip
        for tool, curves in tools(result).items():
            cells = [cell(curves, asked) for asked in ASKED]
            lines.append(f"| {tool} | " + " | ".join(cells) + " |")
        lines.append("")
    return "\n".join(lines)


def cell(curves: list[dict[str, Any]], asked: float) -> str:
    """CPU ms and, in brackets, evaluations of the cheapest point of these curves that counts."""
    points = [p for curve in curves if (p := cheapest(curve["points"], asked)) is not None]
    if not points:
        return ""
    best = min(points, key=milliseconds)
    work = evaluations(best)
    return f"{milliseconds(best):.3g}" + (f" ({work:.0f} E)" if work is not None else "")


def arguments() -> ArgumentParser:
    """What the command understands."""
    parser = measure.options(str(__doc__).splitlines()[0], HERE)
    parser.prog = "python -m benchmarks.stiff"
    parser.add_argument("case", nargs="*", help=f"of {', '.join(CASES)}; all unless given")
    parser.add_argument("--methods", default=",".join(programs.METHODS), help="mstmm's, by name")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--budget", type=float, default=2.0, help="CPU s per point in all rounds")
    parser.add_argument("--limit", type=float, default=5.0,
                        help="CPU s of a run after which no tighter one is tried")  # fmt: skip
    parser.add_argument("--references", action="store_true", help="only compute references anew")
    return parser


def main() -> None:
    """Measure, print the table, draw."""
    parser = arguments()
    options = parser.parse_args()
    if unknown := [name for name in options.case if name not in CASES]:
        parser.error(f"no case {unknown[0]!r}; there are {', '.join(CASES)}")
    names = options.case or list(CASES)
    if options.references:
        references.write(names)
        return
    if not options.plot:
        warnings.simplefilter("ignore")  # of integrators that struggle
        kept = {}
        if options.json.exists():
            kept = {r["case"]: r for r in json.loads(options.json.read_text())["results"]}
        for name in names:
            kept[name] = measured(CASES[name], options)
            results = [kept[name] for name in CASES if name in kept]
            measure.save(options.json, results, unit="CPU ms of one run")
    record = json.loads(options.json.read_text())
    text = table(record["results"])
    print(text)
    options.json.with_suffix(".md").write_text(text)
    from .picture import draw

    draw(record, options.picture)


if __name__ == "__main__":
    main()
