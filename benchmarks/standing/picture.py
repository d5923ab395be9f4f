"""The picture of the standing charts: CPU time against achieved error, a panel for each scene."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
from matplotlib.lines import Line2D

from ..common import style
from .side_by_side import ASKED, OWN

LOOKS: dict[str, dict[str, Any]] = {
    OWN: {"color": "#c1121f", "marker": "o", "lw": 2.2, "zorder": 5},
    "SciPy Radau": {"color": "#1d3557", "marker": "^", "lw": 1.3, "ls": "--"},
    "SciPy DOP853": {"color": "#6c9bd2", "marker": "v", "lw": 1.3, "ls": "--"},
    "CVODE BDF": {"color": "#8d6a9f", "marker": "X", "lw": 1.3, "ls": "--"},
    "CasADi C": {"color": "#c98a00", "marker": "s", "lw": 1.5},
    "Pinocchio": style.LOOKS["Pinocchio"],
    "MuJoCo": style.LOOKS["MuJoCo"],
    "Exudyn": style.LOOKS["Exudyn"],
}
#: Of mstmm's single methods, behind its front.
_BEHIND: dict[str, Any] = {"color": "#c1121f", "lw": 0.7, "alpha": 0.3, "zorder": 1}
#: Largest and smallest error that is shown, m.
ERRORS = (1e-1, 1e-10)
COLUMNS = 4


def draw(record: dict[str, Any], path: Path) -> None:
    """All scenes of the record."""
    results = record["results"]
    columns = min(COLUMNS, len(results))
    rows = -(-len(results) // columns)
    width, height = 3.6 * columns + 0.3, 3.0 * rows + 1.1  # inches
    figure, panels = plt.subplots(rows, columns, figsize=(width, height), squeeze=False)
    figure.subplots_adjust(
        left=0.8 / width, right=1 - 0.15 / width, top=1 - 0.65 / height, bottom=0.75 / height,
        wspace=0.24, hspace=0.26,
    )  # fmt: skip
    for axes, result in zip(panels.flat, results, strict=False):
        _panel(axes, result)
    for axes in panels.flat[len(results) :]:
        axes.set_visible(False)
    for axes in panels[:, 0]:
        axes.set_ylabel("CPU ms of one run")
    for axes in panels.flat[max(0, len(results) - columns) : len(results)]:
        axes.set_xlabel("error at the end, m" + " (more accurate to the right)" * (columns < 4))
    _legend(figure, results)
    style.footer(
        figure, record,
        "Least CPU time of a whole warm call; peers and mstmm's cheapest settings timed in "
        "alternating rounds.",
    )  # fmt: skip
    style.save(figure, path)


def _legend(figure: Any, results: list[dict[str, Any]]) -> None:
    shown = [tool for tool in LOOKS if any(tool in one["fronts"] for one in results)]
    handles = [
        Line2D([], [], label="mstmm, its cheapest" if tool == OWN else tool, **LOOKS[tool])
        for tool in shown
    ]
    handles.insert(1, Line2D([], [], label="mstmm's single methods", **_BEHIND))
    columns = len(handles) if len(results) > 2 else 3
    figure.legend(handles=handles, loc="upper center", ncol=columns, fontsize=9)


def _panel(axes: Any, result: dict[str, Any]) -> None:
    curves: dict[str, list[tuple[float, float]]] = {}
    for p in result["others"][OWN]:
        curves.setdefault(p["method"], []).append((p["error_m"], p["cpu_ms"]))
    for points in curves.values():
        axes.plot(*zip(*points, strict=True), **_BEHIND)
    heights = []
    for tool, looks in LOOKS.items():
        points = [(p["sure_error_m"], p["cpu_ms"]) for p in result["fronts"].get(tool, [])]
        points = [(error, time) for error, time in points if error > 0]
        heights += [time for _, time in points]
        if points:
            axes.plot(*zip(*points, strict=True), **looks)
    for asked in ASKED:
        axes.axvline(asked, color="black", lw=0.7, ls=":")
        _name(axes, result["recommended"][f"{asked:g}"])
    low, high = min(heights), max(heights)
    axes.set(xscale="log", yscale="log", xlim=ERRORS, ylim=(0.35 * low, 1.6 * high))
    axes.xaxis.minorticks_off()
    axes.set_title(result["title"], fontsize=9)


def _name(axes: Any, found: dict[str, Any]) -> None:
    """mstmm's method for an error, below its point, and how it stands beside the best peer."""
    own = found["tools"][OWN]
    if "missed" in own:
        return
    text = own["method"]
    if found["ratio"] is not None:
        text += f"\n{found['ratio']:.2g} of {found['best_peer']}"
    axes.annotate(
        text, (own["sure_error_m"], own["cpu_ms"]), (0, -8), textcoords="offset points",
        ha="center", va="top", fontsize=6.5, zorder=7, color="#7a0a14",
    )  # fmt: skip
