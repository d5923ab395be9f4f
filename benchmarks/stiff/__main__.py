"""Stiff motions: CPU time and work over achieved error, compared with other programs.

    python -m benchmarks.stiff [CASE ...] [--methods NAMES] [--quick] [--plot] [--references]

All programs run each case from loose to tight settings.  The error is the largest distance (m) of
an end from its reference position at the end (`references.py`).  The cheapest setting counts that
meets an error and whose tighter settings meet it too.  Runs of all programs alternate in one
process; times are minimum CPU times of one whole warm call.  Work is also given in evaluations
where a program counts evaluations, residuals, tangents and solves.
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
from .cost_measure import cheapest, evaluations, milliseconds

HERE = Path(__file__).resolve().parent
TARGET_ERRORS = (1e-2, 1e-3, 1e-4, 1e-6, 1e-8)


@cache
def print_once(message: str) -> None:
    """Print it, the first time."""
    print(message, flush=True)


def measure_case(case: Case, options: Namespace) -> dict[str, Any]:
    """All curves of one case, timed in alternating rounds."""
    reference, reference_difference = references.load_reference(case)
    curves = programs.case_curves(case, options.methods.split(","), print_once)
    evaluated = []
    for curve in curves:
        points = list(evaluate_curve(curve, reference, options))
        evaluated.append({"tool": curve.tool, "variant": curve.variant, "points": points})
        print(case.name, curve.tool, curve.variant, len(points), "settings", flush=True)
    timed_points = [
        (point, dict(curve.settings)[point["tolerance"]])
        for curve, entry in zip(curves, evaluated, strict=True)
        for point in entry["points"]
        if "error_m" in point
    ]
    for _ in range(options.rounds):
        for point, run in timed_points:
            if sum(point["cpu_ms"]) < 1e3 * options.budget:
                point["cpu_ms"].append(round(1e3 * measure.call_time(run), 4))
    return {"case": case.name, "title": case.title, "t_end_s": case.t_end,
            "date": measure.machine()["date"],
            "reference_difference_m": reference_difference, "curves": evaluated}  # fmt: skip


def evaluate_curve(
    curve: programs.Curve, reference: np.ndarray, options: Namespace
) -> Iterator[dict[str, Any]]:
    """One point per setting, up to the first beyond the time limit (loose ones may exceed it) or
    the second that is more accurate than all targets."""
    accurate_count = 0
    for index, (tolerance, run) in enumerate(list(curve.settings)[:: 4 if options.quick else 1]):
        try:
            outcomes: list[programs.Outcome] = []
            cpu_s = measure.cpu_time(lambda run=run, outcomes=outcomes: outcomes.append(run()))
            read_positions, counts = outcomes[0]
            error = float(np.linalg.norm(read_positions() - reference, axis=1).max())
        except Exception as failure:  # a failed run is a result too
            text = (str(failure).strip().splitlines() or [type(failure).__name__])[0]
            yield {"tolerance": tolerance, "failure": text[:120]}
            continue
        if not np.isfinite(error):
            yield {"tolerance": tolerance, "failure": "positions not finite"}
            continue
        yield {"tolerance": tolerance, "error_m": float(f"{error:.4g}"), "counts": counts,
               "cpu_ms": [round(1e3 * cpu_s, 4)]}  # fmt: skip
        accurate_count = accurate_count + 1 if error < min(TARGET_ERRORS) / 10 else 0
        if accurate_count == 2 or (index > 1 and cpu_s > options.limit):
            return


def curves_of_tools(result: dict[str, Any]) -> dict[str, list[dict[str, Any]]]:
    """Tool -> its curves."""
    curves_by_tool: dict[str, list[dict[str, Any]]] = {}
    for curve in result["curves"]:
        curves_by_tool.setdefault(curve["tool"], []).append(curve)
    return curves_by_tool


def table(results: list[dict[str, Any]]) -> str:
    """Markdown: CPU ms (and evaluations) of the cheapest setting, by program and error."""
    lines = []
    for result in results:
        lines += [
            f"**{result['case']}**: {result['title']}, {result['t_end_s']:g} s, "
            f"measured {result['date']}", "",
            "| tool | " + " | ".join(f"{target:.0e} m" for target in TARGET_ERRORS) + " |",
            "|---" * (len(TARGET_ERRORS) + 1) + "|",
        ]  # fmt: skip
        for tool, curves in curves_of_tools(result).items():
            cells = [cell(curves, target) for target in TARGET_ERRORS]
            lines.append(f"| {tool} | " + " | ".join(cells) + " |")
        lines.append("")
    return "\n".join(lines)


def cell(curves: list[dict[str, Any]], target: float) -> str:
    """CPU ms, and evaluations in brackets, of the cheapest accurate point."""
    points = [p for curve in curves if (p := cheapest(curve["points"], target)) is not None]
    if not points:
        return ""
    fastest = min(points, key=milliseconds)
    evaluation_count = evaluations(fastest)
    return f"{milliseconds(fastest):.3g}" + (
        f" ({evaluation_count:.0f} E)" if evaluation_count is not None else ""
    )


def command_parser() -> ArgumentParser:
    """Parser of the command line."""
    parser = measure.option_parser(str(__doc__).splitlines()[0], HERE)
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
    parser = command_parser()
    options = parser.parse_args()
    if unknown := [name for name in options.case if name not in CASES]:
        parser.error(f"no case {unknown[0]!r}; there are {', '.join(CASES)}")
    names = options.case or list(CASES)
    if options.references:
        references.write_references(names)
        return
    if not options.plot:
        warnings.simplefilter("ignore")  # of integrators with difficulties
        stored = {}
        if options.json.exists():
            stored = {r["case"]: r for r in json.loads(options.json.read_text())["results"]}
        for name in names:
            stored[name] = measure_case(CASES[name], options)
            results = [stored[name] for name in CASES if name in stored]
            measure.save_record(options.json, results, unit="CPU ms of one run")
    record = measure.write_table(options.json, table)
    from .picture import draw

    draw(record, options.picture)


if __name__ == "__main__":
    main()
