"""One look for all pictures."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt

#: Colour, marker and line of each family; mstmm in strong colours, peers told apart in print too.
LOOKS: dict[str, dict[str, Any]] = {
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

mpl.rcParams.update(
    {
        "font.size": 9, "font.family": "DejaVu Sans", "axes.spines.top": False,
        "axes.spines.right": False, "axes.grid": True, "grid.color": "#e3e3e3",
        "grid.linewidth": 0.6, "axes.axisbelow": True, "legend.frameon": False,
        "figure.dpi": 110, "savefig.dpi": 170, "lines.markersize": 5,
        "axes.titlesize": 10, "axes.titleweight": "bold", "axes.titlelocation": "left",
    }
)  # fmt: skip


def look(name: str) -> dict[str, Any]:
    """Line style of a family."""
    return {"label": name, **LOOKS[name]}


def footer(figure: Any, record: dict[str, Any], text: str) -> None:
    """What it was taken on, and when."""
    at = record["machine"]
    figure.text(
        0.01, 0.005,
        f"{text}  {at['cores']}-core {at['processor']} ({at['vectors']}), gcc {at['gcc']}, "
        f"{at['date']}.",
        fontsize=7, color="#555555", ha="left", va="bottom",
    )  # fmt: skip


def save(figure: Any, path: Path) -> None:
    """PNG."""
    figure.savefig(path)
    plt.close(figure)
