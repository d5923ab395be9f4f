"""Picture of the cost charts: CPU time over achieved error, a panel per scene."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
from matplotlib.lines import Line2D

from ..common import style
from .comparison import OWN, TARGET_ERRORS

LINE_STYLES: dict[str, dict[str, Any]] = {
    OWN: {"color": "#c1121f", "marker": "o", "lw": 2.2, "zorder": 5},
    "SciPy Radau": {"color": "#1d3557", "marker": "^", "lw": 1.3, "ls": "--"},
    "SciPy DOP853": {"color": "#6c9bd2", "marker": "v", "lw": 1.3, "ls": "--"},
    "CVODE BDF": {"color": "#8d6a9f", "marker": "X", "lw": 1.3, "ls": "--"},
    "CasADi C": {"color": "#c98a00", "marker": "s", "lw": 1.5},
    "Pinocchio": style.LINE_STYLES["Pinocchio"],
    "MuJoCo": style.LINE_STYLES["MuJoCo"],
    "Exudyn": style.LINE_STYLES["Exudyn"],
}
#: Line style of single methods of mstmm.
_BACKGROUND: dict[str, Any] = {"color": "#c1121f", "lw": 0.7, "alpha": 0.3, "zorder": 1}
#: Largest and smallest error that is shown, m.
ERRORS = (1e-1, 1e-10)
COLUMNS = 4
_DPI = 110


@style.styled
def draw(record: dict[str, Any], path: Path) -> None:
    """All scenes of the record."""
    results = record["results"]
    columns = min(COLUMNS, len(results))
    rows = -(-len(results) // columns)
    width, height = 3.6 * columns + 0.3, 3.1 * rows + 1.2  # inches
    figure, panels = plt.subplots(rows, columns, figsize=(width, height), squeeze=False)
    figure.subplots_adjust(
        left=0.8 / width, right=1 - 0.3 / width, top=1 - 1.0 / height, bottom=0.75 / height,
        wspace=0.24, hspace=0.42,
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
    style.add_footer(
        figure, record,
        "Least CPU time of a whole warm call; peers and mstmm's cheapest settings timed in "
        "alternating rounds.  The numbers above the panels: mstmm's time in that of the best peer.",
    )  # fmt: skip
    figure.savefig(path, dpi=_DPI)
    plt.close(figure)


def _legend(figure: Any, results: list[dict[str, Any]]) -> None:
    tools = [tool for tool in LINE_STYLES if any(tool in result["fronts"] for result in results)]
    handles = [
        Line2D([], [], label="mstmm, its cheapest" if tool == OWN else tool, **LINE_STYLES[tool])
        for tool in tools
    ]
    handles.insert(1, Line2D([], [], label="mstmm's single methods", **_BACKGROUND))
    columns = len(handles) if len(results) > 2 else 3
    figure.legend(handles=handles, loc="upper center", ncol=columns, fontsize=9)


def _panel(axes: Any, result: dict[str, Any]) -> None:
    for curve in result["method_curves"].values():
        axes.plot(*zip(*curve, strict=True), **_BACKGROUND)
    times = []
    for tool, line_style in LINE_STYLES.items():
        points = result["fronts"].get(tool, [])
        envelope = style.pareto_front(
            (p["error_bound_m"], p["cpu_ms"]) for p in points if p["error_bound_m"] > 0
        )
        times += [time for error, time in envelope if ERRORS[1] <= error <= ERRORS[0]]
        if envelope:
            axes.plot(*zip(*envelope, strict=True), **line_style)
            loosest = envelope[0]  # no cheaper setting is known for larger errors
            axes.plot(
                [ERRORS[0], loosest[0]], [loosest[1]] * 2, color=line_style["color"], lw=0.8, ls=":"
            )
    axes.set(xscale="log", yscale="log", xlim=ERRORS, ylim=(0.6 * min(times), 1.6 * max(times)))
    axes.xaxis.minorticks_off()
    axes.text(0.0, 1.14, result["title"], transform=axes.transAxes, fontsize=9, weight="bold")
    for row, target in enumerate(TARGET_ERRORS):
        axes.axvline(target, color="black", lw=0.7, ls=":")
        text = _summary_text(result["recommended"][f"{target:g}"])
        axes.text(0.0, 1.075 - 0.06 * row, f"{target:.0e} m: {text}", transform=axes.transAxes,
                  fontsize=7, color="#7a0a14")  # fmt: skip


def _summary_text(recommended: dict[str, Any]) -> str:
    """mstmm's method for an error, and its ratio to the best other program."""
    own_point = recommended["tools"][OWN]
    if "missed" in own_point:
        return "not met by mstmm"
    text = f"{own_point['method']}, {own_point['variant']}, {own_point['cpu_ms']:.2g} ms"
    if recommended["ratio"] is None:
        return f"{text}; by no peer"
    return f"{text}; {recommended['ratio']:.2g} of {recommended['best_peer']}"
