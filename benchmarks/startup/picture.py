"""The picture of the start-up benchmark."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
from common import style

ORDER = (
    "import numpy", "import mstmm", "mstmm, warm", "mstmm, cold, auto", "mstmm, cold, fused",
    "gcc alone", "CasADi + CVODES, jit", "import casadi", "import pinocchio", "import mujoco",
    "import exudyn", "import pydrake.all",
)  # fmt: skip


def draw(record: dict[str, Any], path: Path) -> None:
    """Horizontal bars of the smallest CPU times."""
    figure, axes = plt.subplots(figsize=(8.2, 4.3))
    figure.subplots_adjust(left=0.2, right=0.96, top=0.92, bottom=0.17)
    values = [1e3 * min(record["results"][name]["cpu_s"]) for name in ORDER]
    colours = ["#c1121f" if "mstmm" in name else "#7f8c9a" for name in ORDER]
    places = range(len(ORDER), 0, -1)
    axes.barh(places, values, color=colours, height=0.68)
    for place, value in zip(places, values, strict=True):
        axes.text(value, place, f" {value:.0f}", va="center", fontsize=8)
    axes.set_yticks(places, ORDER)
    axes.grid(axis="y", visible=False)
    axes.set_xlabel("CPU ms of a fresh process")
    axes.set_title("Start-up: imports, and the first result of a seven-body scene")
    style.footer(figure, record, "Smallest of the rounds, children included.")
    style.save(figure, path)
