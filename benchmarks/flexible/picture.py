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


def draw(record: dict[str, Any], enough: Callable[[dict[str, Any]], bool], path: Path) -> None:
    """One panel per scene."""
    figure, panels = plt.subplots(1, 2, figsize=(10, 4.6))
    figure.subplots_adjust(left=0.07, right=0.985, top=0.92, bottom=0.185, wspace=0.2)
    for axes, result in zip(panels, record["results"], strict=False):
        for tool, points in result["tools"].items():
            looks = style.look(tool)
            shown = [p for p in points.values() if "error_m" in p]
            for good in (False, True):
                some = [p for p in shown if enough(p) == good]
                axes.plot(
                    [p["error_m"] for p in some],
                    [min(p.get("cpu_ms", [p["watched_cpu_ms"]])) for p in some],
                    marker=looks["marker"], color=looks["color"], ls="", ms=4,
                    mfc=looks["color"] if good else "white", alpha=1.0 if good else 0.35,
                    label=tool if good else None,
                )  # fmt: skip
        axes.axvline(record["results"][0]["asked_m"], color="black", lw=0.7, ls=":")
        axes.set(xscale="log", yscale="log", xlim=(3e-1, 1e-6), title=TITLES[result["scene"]])
        axes.set_xlabel(ERRORS[result["scene"]] + " (more accurate to the right)")
        axes.legend(fontsize=8, loc="best")
    panels[0].set_ylabel("CPU ms of one run")
    style.footer(figure, record, "Each point a setting; full ones are as accurate as asked.")
    style.save(figure, path)
