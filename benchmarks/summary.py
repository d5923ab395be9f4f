"""Targets compared with measurements, and the picture that shows them.

    python benchmarks/summary.py [--run [FOLDER ...]]

Reads result.json of all folders.  With --run it first measures, one benchmark after the other.
Writes benchmarks/summary.md, docs/images/speed.png and the tables of
docs/benchmarks/performance.md.
"""

from __future__ import annotations

import argparse
import datetime
import importlib.util
import json
import os
import statistics
import subprocess
import sys
import time
from pathlib import Path
from types import ModuleType
from typing import Any

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

import performance_tables  # noqa: E402
from common import measure  # noqa: E402

STIFF_CASES = ("a10-1e8", "a50-1e8", "f", "d-half", "d-quarter")  # in the performance page
#: Folder -> arguments of Python that measure it; all of one run take about an hour on one core.
COMMANDS = {folder: (str(HERE / folder / "run.py"),) for folder in (
    "forward_dynamics", "robots", "work_precision", "flexible", "long_chains", "loops", "startup",
    "batch_throughput",
)}  # fmt: skip
STIFF_METHODS = "dop853,auto,rodas4p2,rodas5p,rodas4,ros34pw2,genalpha"
STIFF_OPTIONS = ("--methods", STIFF_METHODS, "--rounds", "2", "--limit", "2", "--budget", "0.5")
COMMANDS["stiff"] = ("-m", "benchmarks.stiff", *STIFF_CASES, *STIFF_OPTIONS)
#: Folders with targets in summary.md.
FOLDERS = tuple(folder for folder in COMMANDS if folder not in ("robots", "stiff"))
Row = tuple[str, str, float, float, bool]  # quantity, scene, measured, target, smaller is better


def load_run_module(folder: str) -> ModuleType:
    """run.py of a folder."""
    sys.path.insert(0, str(HERE / folder))
    spec = importlib.util.spec_from_file_location(f"{folder}_run", HERE / folder / "run.py")
    assert spec is not None and spec.loader is not None
    loaded = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(loaded)
    sys.path.remove(str(HERE / folder))
    for name in ("picture", "programs"):
        sys.modules.pop(name, None)
    return loaded


def load_record(folder: str) -> dict[str, Any]:
    """Stored record of a benchmark."""
    return dict(json.loads((HERE / folder / "result.json").read_text()))


def forward_dynamics_rows() -> list[Row]:
    """Fused against CasADi and Pinocchio; looped against Pinocchio and itself."""
    run = load_run_module("forward_dynamics")
    results = load_record("forward_dynamics")["results"]
    times_by_scene = {(r["kind"], r["bodies"]): run.best_times(r) for r in results}
    ratios = {
        key: times["mstmm fused"] / times["CasADi C"]
        for key, times in times_by_scene.items()
        if {"mstmm fused", "CasADi C"} <= times.keys()
    }
    compared = {
        k: v for k, v in ratios.items() if k[1] in (3, 7, 24) or k[0] in ("puma", "humanoid")
    }
    worst = max(compared, key=lambda k: compared[k])
    times_100, times_7 = times_by_scene["pins", 100], times_by_scene["pins", 7]
    per_body = {n: times_by_scene["pins", n]["mstmm looped"] / n for n in (1000, 100_000)}
    separate_process = {
        r["bodies"]: r["evaluation_ms"] / r["bodies"] for r in load_record("long_chains")["results"]
        if r["tool"] == "mstmm" and r["kind"] == "pins"
    }  # fmt: skip
    errors = [r["error"]["mstmm looped"] for r in results if r["error"]]
    return [
        ("fused / CasADi C, worst", f"{worst[0]} {worst[1]}", compared[worst], 1.0, True),
        ("fused / CasADi C, geometric mean", f"{len(ratios)} scenes",
         measure.geometric_mean(list(ratios.values())), 0.7, True),
        ("fused / Pinocchio C++", "pins 7", times_7["mstmm fused"] / times_7["Pinocchio"], 0.2,
        True),
        ("looped / Pinocchio C++", "pins 100",
         times_100["mstmm looped"] / times_100["Pinocchio"], 0.4, True),
        ("looped per body, 1e5 / 1e3", "pins, each in a fresh process",
         separate_process[100_000] / separate_process[1000], 1.5, True),
        ("the same", "pins, in a process where peers ran before",
         per_body[100_000] / per_body[1000], 1.5, True),
        ("looped, relative error", "largest up to 100 bodies", max(errors), 1e-13, True),
    ]  # fmt: skip


def batch_rows() -> list[Row]:
    """Speed-up of vector lanes over single states on one core."""
    run = load_run_module("batch_throughput")
    gains = {}
    for result in load_record("batch_throughput")["results"]:
        times = run.best_times(result, "one_core_cpu_ns")
        name = f"{result['kind']} {result['bodies']}"
        gains[name] = times["mstmm one by one"] / times["mstmm lanes"]
    worst = min(gains, key=lambda k: gains[k])
    mean = measure.geometric_mean(list(gains.values()))
    return [
        ("batch, lanes / one by one, smallest", worst, gains[worst], 4.0, False),
        ("batch, lanes / one by one, geometric mean", f"{len(gains)} scenes", mean, 4.0, False),
    ]


def work_precision_rows() -> list[Row]:
    """10 s to 1e-9 against CasADi with CVODES."""
    run = load_run_module("work_precision")
    rows: list[Row] = []
    for result in load_record("work_precision")["results"]:
        per_body, other = (run.cheapest(result["curves"][k]) for k in ("mstmm", "CasADi + CVODES"))
        if per_body and other:
            rows.append(("10 s to 1e-9 rad / CasADi + CVODES", result["scene"],
                         per_body[1] / other[1], 0.15, True))  # fmt: skip
    return rows


def startup_rows() -> list[Row]:
    """Imports and first results."""
    run = load_run_module("startup")
    ratios = run.ratios(load_record("startup")["results"])
    return [(name, "7 pins", value, run.TARGETS[name], True) for name, value in ratios.items()]


def flexible_rows() -> list[Row]:
    """Runs of flexible bodies compared with Exudyn's ANCF cable at the same error."""
    run = load_run_module("flexible")
    stored = load_record("flexible")
    rows: list[Row] = []
    for result in stored["results"]:
        value = run.ratio(result)
        if value is not None:
            rows.append(
                ("flexible / Exudyn ANCF", result["scene"], value, stored["target_ratio"], True)
            )
    return rows


def loop_rows() -> list[Row]:
    """Closed loops compared with programs that use constraints."""
    loaded = load_run_module("loops").ratios(load_record("loops")["results"])
    return [(f"closed loops, {what}", where, value, compared, True)
            for what, where, value, compared in loaded]  # fmt: skip


def table(rows: list[Row]) -> str:
    """Markdown."""
    lines = ["| quantity | scene | measured | target | met |", "|---" * 5 + "|"]
    for what, where, value, target, is_upper_bound in rows:
        met = value <= target if is_upper_bound else value >= target
        sign = "≤" if is_upper_bound else "≥"
        lines.append(
            f"| {what} | {where} | {value:.3g} | {sign} {target:g} | {'yes' if met else '**no**'} |"
        )
    return "\n".join(lines)


def machine_text(machine: dict[str, Any]) -> str:
    """Date, processor and programs of a measurement."""
    return "{date}, {cores}-core {processor} ({vectors}), gcc {gcc}, Python {python}".format(
        **machine
    )


def machine_lines() -> str:
    """Machines and dates of the benchmarks, with the median of the loads."""
    loads: dict[str, list[tuple[str, float]]] = {}
    for folder in FOLDERS:
        machine = load_record(folder)["machine"]
        loads.setdefault(machine_text(machine), []).append((folder, float(machine["load"])))
    return "\n".join(
        f"- {', '.join(folder for folder, _ in folders)}: {line}, "
        f"load {statistics.median([load for _, load in folders]):.1f}."
        for line, folders in loads.items()
    )


def draw_summary(path: Path) -> None:
    """Time over length, ratio to CasADi, and time over error."""
    import matplotlib.pyplot as plt
    from common import style

    forward_run = load_run_module("forward_dynamics")
    results = load_record("forward_dynamics")
    with plt.rc_context(style.PARAMETERS):
        figure, panels = plt.subplots(1, 3, figsize=(11.5, 4.1))
        figure.subplots_adjust(left=0.055, right=0.99, top=0.91, bottom=0.19, wspace=0.24)
        for name in ("mstmm fused", "mstmm looped", "CasADi C", "Pinocchio", "MuJoCo", "Drake"):
            times = {r["bodies"]: forward_run.best_times(r).get(name) for r in results["results"]
                     if r["kind"] == "pins"}  # fmt: skip
            points = [(n, value / n) for n, value in times.items() if value]
            panels[0].plot(*zip(*points, strict=True), **style.line_style(name))
        panels[0].set(xscale="log", yscale="log", xlabel="bodies", ylabel="CPU ns per body",
                      title="Accelerations of a chain of pins")  # fmt: skip
        panels[0].legend(fontsize=7.5, labelspacing=0.2)
        _ratios(panels[1], results["results"], forward_run)
        data = load_record("work_precision")
        _precision(panels[2], data)
        style.add_footer(
            figure, results,
            "CPU times of one run, latency-chained, each program in its best form.",
        )  # fmt: skip
        style.save_figure(figure, path)


def _ratios(axes: Any, results: list[dict[str, Any]], run: ModuleType) -> None:
    from common import style

    compared = [(r, run.best_times(r)) for r in results]
    compared = [(r, b) for r, b in compared if {"mstmm fused", "CasADi C"} <= b.keys()]
    markers = {"pins": "o", "balls": "s", "planar": "^", "puma": "D", "humanoid": "P"}
    for kind, marker in markers.items():
        points = [
            (r["bodies"], b["mstmm fused"] / b["CasADi C"])
            for r, b in compared
            if r["kind"] == kind
        ]
        if points:
            colour = style.LINE_STYLES["mstmm fused"]["color"]
            axes.plot(*zip(*points, strict=True), marker=marker, label=kind, color=colour,
                      lw=1, mfc="white" if kind != "pins" else colour)  # fmt: skip
    axes.axhline(1.0, color="black", lw=0.8)
    axes.set(xscale="log", xlabel="bodies", ylabel="mstmm fused / CasADi C",
             title="Against C generated by CasADi", ylim=(0, 1.25))  # fmt: skip
    sizes = [2, 3, 7, 12, 24, 50]
    axes.set_xticks(sizes, [str(n) for n in sizes])
    axes.minorticks_off()
    axes.legend(fontsize=7.5, loc="lower right", ncol=2)


def _precision(axes: Any, data: dict[str, Any]) -> None:
    from common import style

    picture_of = HERE / "work_precision" / "picture.py"
    spec = importlib.util.spec_from_file_location("work_precision_picture", picture_of)
    assert spec is not None and spec.loader is not None
    picture_module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(picture_module)
    for name, curve in data["results"][0]["curves"].items():
        points = style.pareto_front(picture_module.curve_points(curve))
        if points:
            look = picture_module.LINE_STYLES.get(name, style.LINE_STYLES.get(name, {}))
            axes.plot(*zip(*points, strict=True), label=name, **look)
    axes.set(xscale="log", yscale="log", xlabel="achieved error, rad", ylabel="CPU ms",
             title="10 s of a three-pin arm")  # fmt: skip
    axes.set(xlim=(1e-2, 1e-13), ylim=(0.04, 3e4))
    axes.legend(fontsize=7.5, labelspacing=0.2, ncol=2, loc="upper left", columnspacing=1.0)


def main() -> None:
    """Measure if requested; write tables and picture."""
    parser = argparse.ArgumentParser(description=str(__doc__).splitlines()[0])
    parser.add_argument(
        "--run", nargs="*", choices=list(COMMANDS), help="measure; all unless named"
    )
    options = parser.parse_args()
    if options.run is not None:
        environment = os.environ | {
            "BENCHMARK_RUN": datetime.datetime.now().isoformat("T", "minutes")
        }
        for folder in options.run or COMMANDS:
            start_time = time.monotonic()
            command = [sys.executable, *COMMANDS[folder]]
            subprocess.run(command, check=True, cwd=HERE.parent, env=environment)
            print(f"{folder}: {(time.monotonic() - start_time) / 60:.1f} min", flush=True)
    rows = forward_dynamics_rows() + batch_rows() + work_precision_rows() + startup_rows()
    text = f"{table(rows + flexible_rows() + loop_rows())}\n\n{machine_lines()}\n"
    print(text)
    (HERE / "summary.md").write_text(text)
    draw_summary(HERE.parent / "docs" / "images" / "speed.png")
    performance_tables.write_page(load_run_module)


if __name__ == "__main__":
    main()
