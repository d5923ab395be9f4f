"""Tables of docs/benchmarks/performance.md from the stored records, between their markers."""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from types import ModuleType
from typing import Any

HERE = Path(__file__).resolve().parent
PAGE = HERE.parent / "docs" / "benchmarks" / "performance.md"
#: Folders of the tables.
FOLDERS = (
    "forward_dynamics", "robots", "work_precision", "stiff", "flexible", "long_chains",
)  # fmt: skip
NAMES = {"casadi": "CasADi", "pin": "Pinocchio", "mujoco": "MuJoCo", "drake": "Drake",
         "exudyn": "Exudyn", "scipy": "SciPy", "scikit-sundae": "scikit-SUNDAE",
         "mstmm": "mstmm"}  # fmt: skip
SCENES = {"pins": "pins, axes x, y, z", "balls": "balls", "planar": "planar pins",
          "puma": "Puma 560", "humanoid": "humanoid-size tree"}  # fmt: skip
ROWS = (
    ("pins", 3), ("pins", 7), ("pins", 24), ("balls", 3), ("balls", 7), ("balls", 24),
    ("planar", 7), ("planar", 24), ("puma", 6), ("humanoid", 25), ("pins", 100), ("pins", 100_000),
)  # fmt: skip
CALLS = ("accelerations in C", "accelerations", "inverse_dynamics", "mass_matrix", "derivatives",
         "jacobian", "simulate, 100 steps", "session, 100 ticks", "file to first")  # fmt: skip
STIFF = {
    "a10-1e8": "10 rods on bushings, 1e8 N/m, 1 % damping", "a50-1e8": "50 rods on the same",
    "f": "100 rods on damped pins", "d-half": "half car on bushings",
    "d-quarter": "quarter car on a stiff mount",
}  # fmt: skip
STIFF_ERROR = 1e-4  # m


def records() -> dict[str, dict[str, Any]]:
    """Stored records of all tables by folder."""
    return {name: json.loads((HERE / name / "result.json").read_text()) for name in FOLDERS}


def duration(nanoseconds: float | None) -> str:
    """Time with a unit and three digits; empty for None."""
    if nanoseconds is None:
        return ""
    for unit, size in (("ns", 1.0), ("µs", 1e3), ("ms", 1e6), ("s", 1e9)):
        if nanoseconds < 999.5 * size or unit == "s":
            break
    return f"{nanoseconds / size:#.3g}".rstrip(".") + f" {unit}"


def rows_to_markdown(heading: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """Markdown table."""
    cells = [list(heading), *map(list, rows)]
    lines = [f"| {' | '.join(row)} |" for row in cells]
    return "\n".join([lines[0], "|---" * len(cells[0]) + "|", *lines[1:]])


def statement(data: dict[str, dict[str, Any]]) -> str:
    """Machine, date and versions; with a line for each table of another run."""
    machines = {name: record["machine"] for name, record in data.items()}
    newest = max(machines.values(), key=lambda m: (m["date"], m.get("run", "")))
    versions = newest["versions"]
    programs = ", ".join(f"{NAMES[key]} {versions[key]}" for key in NAMES if key in versions)
    loads = [m["load"] for m in machines.values() if m.get("run") == newest["run"]]
    lines = [
        f"{newest['date']}, {newest['processor']} ({newest['vectors']}, {newest['cores']} cores, "
        f"one of them used), gcc {newest['gcc']}, Python {newest['python']}; {programs}.",
        f"Load of the machine {min(loads):.0f} to {max(loads):.0f}.",
    ]
    for name, machine in machines.items():
        if machine.get("run") != newest["run"]:
            lines.append(f"From an earlier run of {machine['date']}: {name}.")
    return "\n".join(lines)


def accelerations(record: dict[str, Any], run: ModuleType) -> str:
    """Time of one evaluation by scene and program."""
    programs = {"mstmm fused": "mstmm fused", "mstmm looped": "mstmm looped",
                "CasADi C": "CasADi's C", "Pinocchio": "Pinocchio", "MuJoCo": "MuJoCo"}  # fmt: skip
    best = {(r["kind"], r["bodies"]): run.best_times(r) for r in record["results"]}
    return rows_to_markdown(
        ["scene", "bodies", *programs.values()],
        ([SCENES[kind], f"{bodies:_}".replace("_", " "),
          *(duration(best[kind, bodies].get(name)) for name in programs)]
         for kind, bodies in ROWS),
    )  # fmt: skip


def robots(record: dict[str, Any], run: ModuleType) -> str:
    """Ratios of minimum times by robot and call."""
    names = dict.fromkeys(r["robot"] for r in record["results"])
    ratios = {}
    for row in record["results"]:
        if row["call"] in run.COMPARISONS:
            fastest = run.fastest_peer(row, record["results"])
            ratios[row["robot"], row["call"]] = min(row["s"]) / min(fastest["s"])
    return rows_to_markdown(
        ["robot", *(f"`{c}`" if c.isidentifier() else c for c in CALLS)],
        ([name, *(f"{ratios[name, call]:.2g}" for call in CALLS)] for name in names),
    )  # fmt: skip


def non_stiff_table(record: dict[str, Any], run: ModuleType) -> str:
    """Time of ten seconds of motion by scene and program."""
    titles = {"arm": "three rods on pins", "balls": "three rods on balls"}
    programs = list(record["results"][0]["curves"])
    rows = []
    for result in record["results"]:
        best = [run.cheapest(result["curves"][name]) for name in programs]
        cells = [duration(1e6 * x[1]) if x else "not met" for x in best]
        rows.append([titles[result["scene"]], *cells])
    return rows_to_markdown(["scene", *programs], rows)


def stiff_table(record: dict[str, Any], run: ModuleType) -> str:
    """Time of the cheapest accurate setting of implicit methods by case and program."""
    explicit = {"dop853", "dopri5", "dop853, fused", "auto"}
    peers = ("SciPy Radau", "CVODE BDF", "Exudyn")
    rows = []
    for case, title in STIFF.items():
        result = next(r for r in record["results"] if r["case"] == case)
        best: dict[str, tuple[float, str]] = {}
        for curve in result["curves"]:
            tool = curve["tool"]
            name = tool if tool in peers else "mstmm"
            point = run.cheapest(curve["points"], STIFF_ERROR)
            if point is not None and tool not in explicit:
                new = (run.milliseconds(point), tool)
                best[name] = min(best.get(name, new), new)
        has_exudyn = any(curve["tool"] == "Exudyn" for curve in result["curves"])
        cells = [duration(1e6 * best[x][0]) if x in best else "not met" for x in peers]
        own = f"{duration(1e6 * best['mstmm'][0])} (`{best['mstmm'][1].replace(', ', '`, ')}"
        own += ")" if "," in best["mstmm"][1] else "`)"
        rows.append([title, own, *cells[:2], cells[2] if has_exudyn else ""])
    heading = ["scene", "mstmm", "SciPy Radau, exact Jacobian", "CVODE BDF, the same", "Exudyn"]
    return rows_to_markdown(heading, rows)


def flexible_table(record: dict[str, Any], run: ModuleType) -> str:
    """Time and error of the cheapest accurate setting by scene and program."""
    titles = {"spin-up": "spin-up of a beam, 20 s", "chain": "chain of 100 strips, 3 s"}
    rows = []
    for result in record["results"]:
        for tool, points in result["tools"].items():
            if best := run.cheapest(points):
                label, value = best
                rows.append([titles[result["scene"]], tool, label, duration(1e6 * value),
                             f"{1e3 * points[label]['error_m']:.2g} mm"])  # fmt: skip
    return rows_to_markdown(["scene", "program", "setting", "CPU time", "error"], rows)


def long_chains(record: dict[str, Any], run: ModuleType) -> str:
    """Simulation cost and memory of the longest chains."""
    sizes = {"pins": (10_000, 100_000), "balls": (10_000, 33_334)}
    rows = [
        [f"{r['bodies']:_} {r['kind']}".replace("_", " "), r["tool"],
         duration(1e9 * r["run_s_per_s"]) if "run_s_per_s" in r else r["failure"],
         f"{r['memory_mib']:.0f} MiB" if "memory_mib" in r else ""]
        for kind, counts in sizes.items() for bodies in counts for r in record["results"]
        if (r["kind"], r["bodies"]) == (kind, bodies) and r["tool"] in ("mstmm", "Exudyn, sparse")
    ]  # fmt: skip
    return rows_to_markdown(
        ["chain", "program", "CPU time of one second of motion", "memory"], rows
    )


def write_page(load_run_module: Callable[[str], Any]) -> None:
    """Replace the text between the markers of the page."""
    data, text = records(), PAGE.read_text(encoding="utf-8")
    tables = {"statement": statement(data)}
    builders = {
        "forward_dynamics": accelerations,
        "robots": robots,
        "work_precision": non_stiff_table,
        "stiff": stiff_table,
        "flexible": flexible_table,
        "long_chains": long_chains,
    }
    sys.path.insert(0, str(HERE / "stiff"))
    import cost_measure

    for folder, build in builders.items():
        run = cost_measure if folder == "stiff" else load_run_module(folder)
        tables[folder] = build(data[folder], run)
    for name, table in tables.items():
        pattern = re.compile(rf"(<!-- table: {name} -->\n).*?(?=<!-- end -->)", re.DOTALL)
        text, count = pattern.subn(lambda m, table=table: f"{m[1]}{table}\n", text)
        if count != 1:
            raise ValueError(f"{PAGE.name}: expected one marker {name!r}, found {count}")
    PAGE.write_text(text, encoding="utf-8")
