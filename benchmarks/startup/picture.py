"""The picture of the start-up benchmark."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
from common import style

LABELS = {
    "import numpy": "import numpy",
    "import mstmm": "import mstmm",
    "mstmm, warm": "mstmm, first result, warm cache",
    "mstmm, cold, auto": "mstmm, first result, empty cache, looped",
    "mstmm, cold, fused": "mstmm, first result, empty cache, fused",
    "gcc alone": "gcc alone on the fused code",
    "CasADi + CVODES, jit": "CasADi + CVODES, first result",
    "import casadi": "import casadi",
    "import pinocchio": "import pinocchio",
    "import mujoco": "import mujoco",
    "import exudyn": "import exudyn",
    "import pydrake.all": "import pydrake.all",
}


@style.styled
def draw(record: dict[str, Any], path: Path) -> None:
    """Horizontal bars of the smallest CPU times."""
    figure, axes = plt.subplots(figsize=(8.2, 4.3))
    figure.subplots_adjust(left=0.34, right=0.96, top=0.92, bottom=0.17)
    values = [1e3 * min(record["results"][name]["cpu_s"]) for name in LABELS]
    colours = ["#c1121f" if "mstmm" in name else "#7f8c9a" for name in LABELS]
    positions = range(len(LABELS), 0, -1)
    axes.barh(positions, values, color=colours, height=0.68)
    for position, value in zip(positions, values, strict=True):
        axes.text(value, position, f" {value:.0f}", va="center", fontsize=8)
    axes.set_yticks(positions, list(LABELS.values()))
    axes.grid(axis="y", visible=False)
    axes.set_xlabel("CPU ms of a fresh process")
    axes.set_title("Start-up: imports, and the first result of a seven-body scene")
    style.add_footer(figure, record, "Smallest of the rounds, children included.")
    style.save_figure(figure, path)
