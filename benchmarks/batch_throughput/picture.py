"""The picture of the batch benchmark: states per second on all cores."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
from common import style

COLOURS = {
    "mstmm lanes": "#c1121f", "mstmm accelerations()": "#f4791f", "mstmm one by one": "#e8a598",
    "CasADi C in SIMD lanes by hand": "#457b9d", "CasADi C": "#1d3557", "Pinocchio": "#2a9d8f",
    "MuJoCo": "#6a994e",
}  # fmt: skip


@style.styled
def draw(record: dict[str, Any], best_times: Callable[..., dict[str, float]], path: Path) -> None:
    """Grouped bars, millions of states per second."""
    figure, axes = plt.subplots(figsize=(10, 4.6))
    figure.subplots_adjust(left=0.07, right=0.985, top=0.92, bottom=0.17)
    results = record["results"]
    width = 0.86 / len(COLOURS)
    for k, (name, colour) in enumerate(COLOURS.items()):
        rates = [1e3 / best_times(r, "all_cores_wall_ns")[name] for r in results]
        positions = [i + (k - len(COLOURS) / 2 + 0.5) * width for i in range(len(results))]
        axes.bar(positions, rates, width * 0.92, color=colour, label=name)
    axes.set_yscale("log")
    axes.set_ylabel("million states per second")
    names = [f"{r['kind']}\n{r['bodies']}" for r in results]
    axes.set_xticks(range(len(names)), names)
    axes.grid(axis="x", visible=False)
    axes.set_title(f"Batches of accelerations on {record['cores']} threads")
    axes.legend(fontsize=8, ncol=4, loc="upper right")
    low, high = axes.get_ylim()
    axes.set_ylim(low, high * 3)
    style.add_footer(figure, record, "Median wall-clock time of 2048 states per call.")
    style.save_figure(figure, path)
