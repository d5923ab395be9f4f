"""The picture of the work-precision benchmark: speed against accuracy."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
from common import style

TITLES = {"arm": "Arm of three rods on pins, 10 s", "balls": "Three rods on ball hinges, 10 s"}
LINE_STYLES = {
    "CasADi C + DOP853": {**style.LINE_STYLES["CasADi C"], "mfc": "white", "ls": "--", "lw": 1.1},
    "Pinocchio + DOP853": style.LINE_STYLES["Pinocchio"],
}


@style.styled
def draw(record: dict[str, Any], cheapest: Callable[..., Any], path: Path) -> None:
    """CPU time over achieved error, one panel per scene."""
    figure, panels = plt.subplots(1, 2, figsize=(10, 4.6), sharey=True)
    figure.subplots_adjust(left=0.07, right=0.985, top=0.92, bottom=0.185, wspace=0.06)
    for axes, result in zip(panels, record["results"], strict=True):
        for name, curve in result["curves"].items():
            front = style.pareto_front(curve_points(curve))
            if front:
                look = LINE_STYLES.get(name, style.LINE_STYLES.get(name, {}))
                axes.plot(*zip(*front, strict=True), label=name, **look)
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_xlim(1e-2, 1e-13)
        axes.axvline(record["target_error_rad"], color="black", lw=0.7, ls=":")
        axes.set_title(TITLES[result["scene"]])
        axes.set_xlabel("achieved error at the end, rad (more accurate to the right)")
    panels[0].set_ylabel("CPU ms of one run")
    panels[0].legend(fontsize=8, loc="upper left", ncol=2, labelspacing=0.25)
    style.add_footer(
        figure, record,
        "Minimum CPU time of warm runs; each in its cheapest settings for the error achieved.",
    )  # fmt: skip
    style.save_figure(figure, path)


def curve_points(curve: dict[str, Any]) -> list[tuple[float, float]]:
    """Error and CPU time of the runs within the error range of the picture."""
    return sorted(
        (p["error_rad"], min(p["cpu_ms"]))
        for p in curve.values()
        if p.get("cpu_ms") and 1e-13 < p["error_rad"] < 1e-2
    )
