"""The picture of the flexible benchmarks: CPU time over achieved error, every setting a point."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
from common import style

TITLES = {
    "spin-up": "Spin-up of a beam, 20 s", "chain": "Chain of 100 flexible strips, 3 s",
}  # fmt: skip
ERRORS = {
    "spin-up": "error of the largest tip deflection, m", "chain": "largest error of the tip, m",
}  # fmt: skip


@style.styled
def draw(record: dict[str, Any], is_accurate: Callable[[dict[str, Any]], bool], path: Path) -> None:
    """One panel per scene."""
    figure, panels = plt.subplots(1, 2, figsize=(10, 4.6))
    figure.subplots_adjust(left=0.07, right=0.985, top=0.92, bottom=0.185, wspace=0.2)
    for axes, result in zip(panels, record["results"], strict=False):
        for tool, points in result["tools"].items():
            look = style.line_style(tool)
            points_with_error = [p for p in points.values() if "error_m" in p]
            for accurate in (False, True):
                selected = [p for p in points_with_error if is_accurate(p) == accurate]
                axes.plot(
                    [p["error_m"] for p in selected],
                    [min(p.get("cpu_ms", [p["first_cpu_ms"]])) for p in selected],
                    marker=look["marker"], color=look["color"], ls="", ms=4,
                    mfc=look["color"] if accurate else "white",
                    alpha=1.0 if accurate else 0.35,
                    label=tool if accurate else None,
                )  # fmt: skip
        axes.axvline(record["results"][0]["target_error_m"], color="black", lw=0.7, ls=":")
        axes.set(xscale="log", yscale="log", xlim=(3e-1, 1e-6), title=TITLES[result["scene"]])
        axes.set_xlabel(ERRORS[result["scene"]] + " (more accurate to the right)")
        axes.legend(fontsize=8, loc="best")
    panels[0].set_ylabel("CPU ms of one run")
    style.add_footer(figure, record, "Each point a setting; filled ones are accurate enough.")
    style.save_figure(figure, path)
