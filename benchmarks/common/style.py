"""Line styles, layout and footer of all pictures."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt

#: Colour, marker and line of each program; mstmm in strong colours, all distinct in print.
LINE_STYLES: dict[str, dict[str, Any]] = {
    "mstmm fused": {"color": "#c1121f", "marker": "o", "lw": 2.2, "zorder": 5},
    "mstmm looped": {"color": "#f4791f", "marker": "s", "lw": 2.2, "zorder": 5},
    "mstmm": {"color": "#c1121f", "marker": "o", "lw": 2.2, "zorder": 5},
    "CasADi C": {"color": "#1d3557", "marker": "^", "lw": 1.5},
    "CasADi C, baked": {"color": "#1d3557", "marker": "^", "lw": 1.2, "ls": ":", "mfc": "white"},
    "CasADi C + libmvec": {"color": "#457b9d", "marker": "v", "lw": 1.2, "ls": "--"},
    "CasADi + CVODES": {"color": "#1d3557", "marker": "^", "lw": 1.5},
    "Pinocchio": {"color": "#2a9d8f", "marker": "D", "lw": 1.5},
    "MuJoCo": {"color": "#6a994e", "marker": "P", "lw": 1.5},
    "Drake": {"color": "#8d6a9f", "marker": "X", "lw": 1.5},
    "Exudyn": {"color": "#7f7f7f", "marker": "h", "lw": 1.5},
}

#: Parameters of matplotlib.
PARAMETERS: dict[str, Any] = {
    "font.size": 9, "font.family": "DejaVu Sans", "axes.spines.top": False,
    "axes.spines.right": False, "axes.grid": True, "grid.color": "#e3e3e3",
    "grid.linewidth": 0.6, "axes.axisbelow": True, "legend.frameon": False,
    "figure.dpi": 110, "savefig.dpi": 170, "lines.markersize": 5,
    "axes.titlesize": 10, "axes.titleweight": "bold", "axes.titlelocation": "left",
}  # fmt: skip

#: Decorator of a function that draws in this style.
styled = mpl.rc_context(PARAMETERS)


def line_style(name: str) -> dict[str, Any]:
    """Line style and label of a program."""
    return {"label": name, **LINE_STYLES[name]}


def add_footer(figure: Any, record: dict[str, Any], text: str) -> None:
    """Note with the machine and the date."""
    note = "{cores}-core {processor} ({vectors}), gcc {gcc}, {date}.".format(**record["machine"])
    figure.text(0.01, 0.005, f"{text}  {note}", fontsize=7, color="#555555", ha="left", va="bottom")


def save_figure(figure: Any, path: Path) -> None:
    """Write a PNG file."""
    figure.savefig(path)
    plt.close(figure)


def pareto_front(points: Iterable[tuple[float, float]]) -> list[tuple[float, float]]:
    """Pairs (error, time) that no other pair beats in both, from the largest error on."""
    front: list[tuple[float, float]] = []
    for error, time in sorted(points, reverse=True):
        while front and front[-1][1] >= time:
            front.pop()
        front.append((error, time))
    return front
