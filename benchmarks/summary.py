"""Targets against what was measured, and the picture of the project's front page.

    python benchmarks/summary.py [--run]

Reads result.json of every folder; with --run it takes all figures first, one benchmark after the
other.  Writes benchmarks/summary.md and docs/images/speed.png.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import statistics
import subprocess
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

from common import measure  # noqa: E402

FOLDERS = (
    "forward_dynamics", "batch_throughput", "work_precision", "startup", "long_chains", "flexible",
    "loops",
)  # fmt: skip
Row = tuple[str, str, float, float, bool]  # what, where, measured, target, smaller is better


def module(folder: str) -> ModuleType:
    """run.py of a folder."""
    sys.path.insert(0, str(HERE / folder))
    spec = importlib.util.spec_from_file_location(f"{folder}_run", HERE / folder / "run.py")
    assert spec is not None and spec.loader is not None
    found = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(found)
    sys.path.remove(str(HERE / folder))
    for name in ("picture", "contestants"):
        sys.modules.pop(name, None)
    return found


def record(folder: str) -> dict[str, Any]:
    """What a benchmark left."""
    return dict(json.loads((HERE / folder / "result.json").read_text()))


def forward() -> list[Row]:
    """Fused against CasADi and Pinocchio; looped against Pinocchio and itself."""
    run = module("forward_dynamics")
    results = record("forward_dynamics")["results"]
    best = {(r["kind"], r["bodies"]): run.best(r) for r in results}
    ratios = {
        key: found["mstmm fused"] / found["CasADi C"]
        for key, found in best.items()
        if {"mstmm fused", "CasADi C"} <= found.keys()
    }
    asked = {k: v for k, v in ratios.items() if k[1] in (3, 7, 24) or k[0] in ("puma", "humanoid")}
    worst = max(asked, key=lambda k: asked[k])
    hundred, seven = best["pins", 100], best["pins", 7]
    own = {n: best["pins", n]["mstmm looped"] / n for n in (1000, 100_000)}
    fresh = {
        r["bodies"]: r["evaluation_ms"] / r["bodies"] for r in record("long_chains")["results"]
        if r["tool"] == "mstmm" and r["kind"] == "pins"
    }  # fmt: skip
    errors = [r["error"]["mstmm looped"] for r in results if r["error"]]
    return [
        ("fused / CasADi C, worst", f"{worst[0]} {worst[1]}", asked[worst], 1.0, True),
        ("fused / CasADi C, geometric mean", f"{len(ratios)} scenes",
         measure.geometric_mean(list(ratios.values())), 0.7, True),
        ("fused / Pinocchio C++", "pins 7", seven["mstmm fused"] / seven["Pinocchio"], 0.2, True),
        ("looped / Pinocchio C++", "pins 100",
         hundred["mstmm looped"] / hundred["Pinocchio"], 0.4, True),
        ("looped per body, 1e5 / 1e3", "pins, each in a fresh process",
         fresh[100_000] / fresh[1000], 1.5, True),
        ("the same", "pins, in a process where peers ran before",
         own[100_000] / own[1000], 1.5, True),
        ("looped, relative error", "largest up to 100 bodies", max(errors), 1e-13, True),
    ]  # fmt: skip


def batches() -> list[Row]:
    """What lanes gain over one state at a time, on one core."""
    run = module("batch_throughput")
    gains = {}
    for result in record("batch_throughput")["results"]:
        found = run.best(result, "one_core_cpu_ns")
        name = f"{result['kind']} {result['bodies']}"
        gains[name] = found["mstmm one by one"] / found["mstmm lanes"]
    worst = min(gains, key=lambda k: gains[k])
    mean = measure.geometric_mean(list(gains.values()))
    return [
        ("batch, lanes / one by one, smallest", worst, gains[worst], 4.0, False),
        ("batch, lanes / one by one, geometric mean", f"{len(gains)} scenes", mean, 4.0, False),
    ]


def precision() -> list[Row]:
    """10 s to 1e-9 against CasADi with CVODES."""
    run = module("work_precision")
    rows: list[Row] = []
    for result in record("work_precision")["results"]:
        own, other = (run.cheapest(result["curves"][k]) for k in ("mstmm", "CasADi + CVODES"))
        if own and other:
            rows.append(("10 s to 1e-9 rad / CasADi + CVODES", result["scene"],
                         own[1] / other[1], 0.15, True))  # fmt: skip
    return rows


def starts() -> list[Row]:
    """Imports and first results."""
    run = module("startup")
    found = run.ratios(record("startup")["results"])
    return [(name, "7 pins", value, run.TARGETS[name], True) for name, value in found.items()]


def flexible() -> list[Row]:
    """Runs of flexible bodies against Exudyn's ANCF cable, both as accurate as asked."""
    run = module("flexible")
    found = record("flexible")
    rows: list[Row] = []
    for result in found["results"]:
        value = run.ratio(result)
        if value is not None:
            rows.append(
                ("flexible / Exudyn ANCF", result["scene"], value, found["asked_ratio"], True)
            )
    return rows


def loops() -> list[Row]:
    """Closed loops against those who close them by constraints."""
    found = module("loops").ratios(record("loops")["results"])
    return [(f"closed loops, {what}", where, value, asked, True)
            for what, where, value, asked in found]  # fmt: skip


def table(rows: list[Row]) -> str:
    """Markdown."""
    lines = ["| target | where | measured | asked | met |", "|---" * 5 + "|"]
    for what, where, value, target, smaller in rows:
        met = value <= target if smaller else value >= target
        sign = "≤" if smaller else "≥"
        lines.append(
            f"| {what} | {where} | {value:.3g} | {sign} {target:g} | {'yes' if met else '**no**'} |"
        )
    return "\n".join(lines)


def machines() -> str:
    """On what the figures were taken, and when; the median of the loads of each."""
    loads: dict[str, list[tuple[str, float]]] = {}
    for folder in FOLDERS:
        at = record(folder)["machine"]
        words = (
            f"{at['date']}, {at['cores']}-core {at['processor']} ({at['vectors']}), "
            f"gcc {at['gcc']}, Python {at['python']}"
        )
        loads.setdefault(words, []).append((folder, float(at["load"])))
    return "\n".join(
        f"- {', '.join(folder for folder, _ in found)}: {words}, "
        f"load {statistics.median([load for _, load in found]):.1f}."
        for words, found in loads.items()
    )


def picture(path: Path) -> None:
    """Length, ratio to CasADi, and speed against accuracy, side by side."""
    import matplotlib.pyplot as plt
    from common import style

    forward_run, precision_run = module("forward_dynamics"), module("work_precision")
    results = record("forward_dynamics")
    figure, panels = plt.subplots(1, 3, figsize=(11.5, 4.1))
    figure.subplots_adjust(left=0.055, right=0.99, top=0.91, bottom=0.19, wspace=0.24)
    for name in ("mstmm fused", "mstmm looped", "CasADi C", "Pinocchio", "MuJoCo", "Drake"):
        found = [(r["bodies"], forward_run.best(r).get(name)) for r in results["results"]
                 if r["kind"] == "pins"]  # fmt: skip
        points = [(n, value / n) for n, value in found if value]
        panels[0].plot(*zip(*points, strict=True), **style.look(name))
    panels[0].set(xscale="log", yscale="log", xlabel="bodies", ylabel="CPU ns per body",
                  title="Accelerations of a chain of pins")  # fmt: skip
    panels[0].legend(fontsize=7.5, labelspacing=0.2)
    _ratios(panels[1], results["results"], forward_run)
    data = record("work_precision")
    _precision(panels[2], data, precision_run)
    style.footer(
        figure, results,
        "CPU times in one run, inputs waiting on outputs, each tool in its best form.",
    )  # fmt: skip
    style.save(figure, path)


def _ratios(axes: Any, results: list[dict[str, Any]], run: ModuleType) -> None:
    from common import style

    shown = [(r, run.best(r)) for r in results]
    shown = [(r, b) for r, b in shown if {"mstmm fused", "CasADi C"} <= b.keys()]
    looks = {"pins": "o", "balls": "s", "planar": "^", "puma": "D", "humanoid": "P"}
    for kind, marker in looks.items():
        points = [
            (r["bodies"], b["mstmm fused"] / b["CasADi C"]) for r, b in shown if r["kind"] == kind
        ]
        if points:
            colour = style.LOOKS["mstmm fused"]["color"]
            axes.plot(*zip(*points, strict=True), marker=marker, label=kind, color=colour,
                      lw=1, mfc="white" if kind != "pins" else colour)  # fmt: skip
    axes.axhline(1.0, color="black", lw=0.8)
    axes.set(xscale="log", xlabel="bodies", ylabel="mstmm fused / CasADi C",
             title="Against C generated by CasADi", ylim=(0, 1.25))  # fmt: skip
    sizes = [2, 3, 7, 12, 24, 50]
    axes.set_xticks(sizes, [str(n) for n in sizes])
    axes.minorticks_off()
    axes.legend(fontsize=7.5, loc="lower right", ncol=2)


def _precision(axes: Any, data: dict[str, Any], run: ModuleType) -> None:
    from common import style

    picture_of = HERE / "work_precision" / "picture.py"
    spec = importlib.util.spec_from_file_location("work_precision_picture", picture_of)
    assert spec is not None and spec.loader is not None
    drawn = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(drawn)
    for name, curve in data["results"][0]["curves"].items():
        points = drawn.frontier(drawn.points_of(curve))
        if points:
            looks = {**drawn.LOOKS.get(name, style.LOOKS.get(name, {})), "label": name}
            axes.plot(*zip(*points, strict=True), **looks)
    axes.set(xscale="log", yscale="log", xlabel="achieved error, rad", ylabel="CPU ms",
             title="10 s of a three-pin arm")  # fmt: skip
    axes.set(xlim=(1e-2, 1e-13), ylim=(0.04, 3e4))
    axes.legend(fontsize=7.5, labelspacing=0.2, ncol=2, loc="upper left", columnspacing=1.0)


def main() -> None:
    """Everything that is asked for."""
    parser = argparse.ArgumentParser(description=str(__doc__).splitlines()[0])
    parser.add_argument("--run", action="store_true", help="take all figures first")
    options = parser.parse_args()
    if options.run:
        for folder in FOLDERS:
            subprocess.run([sys.executable, str(HERE / folder / "run.py")], check=True)
    rows = forward() + batches() + precision() + starts() + flexible() + loops()
    text = table(rows)
    text += f"\n\n{machines()}\n"
    print(text)
    (HERE / "summary.md").write_text(text)
    picture(HERE.parent / "docs" / "images" / "speed.png")


if __name__ == "__main__":
    main()
