"""The picture of the stiff motions: CPU time against achieved error, a panel per case."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
from matplotlib.lines import Line2D

from ..common import style
from .cost_measure import frontier, milliseconds

#: Explicit methods orange, implicit ones of mstmm in strong colours, peers grey and blue, dashed.
LINE_STYLES: dict[str, dict[str, Any]] = {
    "dop853": {"color": "#f4791f", "marker": "s", "lw": 1.3},
    "dopri5": {"color": "#f6b26b", "marker": "s", "lw": 1.1, "mfc": "white"},
    "auto": {"color": "#111111", "marker": "*", "lw": 1.4, "zorder": 6},
    "rodas4p2": {"color": "#c1121f", "marker": "o", "lw": 2.0, "zorder": 5},
    "rodas5p": {"color": "#780000", "marker": "D", "lw": 2.0, "zorder": 5},
    "dop853, fused": {"color": "#f4791f", "marker": "s", "lw": 1.3, "ls": ":"},
    "rodas4p2, fused": {"color": "#c1121f", "marker": "o", "lw": 2.0, "ls": ":", "zorder": 5},
    "rodas5p, fused": {"color": "#780000", "marker": "D", "lw": 2.0, "ls": ":", "zorder": 5},
    "rodas4": {"color": "#e5677b", "marker": "o", "lw": 1.1, "mfc": "white"},
    "ros34pw2": {"color": "#b5838d", "marker": "^", "lw": 1.1, "mfc": "white"},
    "genalpha": {"color": "#2a9d8f", "marker": "v", "lw": 1.6, "zorder": 4},
    "dttmm": {"color": "#6a994e", "marker": "v", "lw": 1.1, "mfc": "white"},
    "esdirk436": {"color": "#8d6a9f", "marker": "P", "lw": 1.3},
    "kvaerno5": {"color": "#b497c4", "marker": "P", "lw": 1.1, "mfc": "white"},
    "SciPy Radau": {"color": "#1d3557", "marker": "^", "lw": 1.4, "ls": "--"},
    "CVODE BDF": {"color": "#457b9d", "marker": "X", "lw": 1.4, "ls": "--"},
    "Exudyn": {"color": "#7f7f7f", "marker": "h", "lw": 1.4, "ls": "--"},
}
ERRORS = (1e-1, 1e-9)  # m, from left to right
COLUMNS = 3


@style.styled
def draw(record: dict[str, Any], path: Path) -> None:
    """All cases of the record."""
    results = record["results"]
    columns = min(COLUMNS, len(results))
    rows = -(-len(results) // columns)
    height = 2.7 * rows + 1.0  # inches
    figure, panels = plt.subplots(
        rows, columns, figsize=(3.9 * columns + 0.5, height), sharex=True, squeeze=False
    )
    figure.subplots_adjust(
        left=0.055 if columns == COLUMNS else 0.13, right=0.985, top=1 - 0.65 / height,
        bottom=0.7 / height, wspace=0.17, hspace=0.28,
    )  # fmt: skip
    for axes, result in zip(panels.flat, results, strict=False):
        _panel(axes, result)
    for axes in panels.flat[len(results) :]:
        axes.set_visible(False)
    for axes in panels[:, 0]:
        axes.set_ylabel("CPU ms of one run")
    for axes in panels.flat[max(0, len(results) - columns) : len(results)]:
        axes.set_xlabel("error at the end, m (more accurate to the right)")
        axes.tick_params(labelbottom=True)
    tools = [t for t in LINE_STYLES if any(c["tool"] == t for r in results for c in r["curves"])]
    handles = [Line2D([], [], label=tool, **LINE_STYLES[tool]) for tool in tools]
    figure.legend(handles=handles, loc="upper center", ncol=min(9, len(handles)), fontsize=8.5)
    style.add_footer(
        figure, record,
        "Minimum CPU time of warm runs; a point counts if all tighter settings are as accurate.",
    )  # fmt: skip
    style.save_figure(figure, path)


def _panel(axes: Any, result: dict[str, Any]) -> None:
    """The cheapest settings of every tool, over all its variants."""
    for tool, look in LINE_STYLES.items():
        curves = [c["points"] for c in result["curves"] if c["tool"] == tool]
        front = _visible_front([
            (float(p["error_m"]), milliseconds(p)) for points in curves for p in frontier(points)
        ])  # fmt: skip
        if front:
            axes.plot(*zip(*front, strict=True), **look)
            loosest = front[0]  # no cheaper setting is known for larger errors
            axes.plot(
                [ERRORS[0], loosest[0]], [loosest[1]] * 2, color=look["color"], lw=0.8, ls=":"
            )
    axes.set(xscale="log", yscale="log", xlim=ERRORS)
    axes.xaxis.minorticks_off()
    axes.set_title(result["title"], fontsize=9)


def _visible_front(points: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Pareto front within the panel and one point beyond it."""
    front, (left, right) = style.pareto_front(points), ERRORS
    inside = [p for p in front if right <= p[0] < 3 * left]
    outside = [(right / 3, time) for error, time in front if error < right]
    return inside + outside[:1]
