"""The picture of the long chains: time and memory over length, crosses where a tool gives up."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
from common import style

LOOKS = {
    "mstmm": style.LOOKS["mstmm looped"], "Pinocchio": style.LOOKS["Pinocchio"],
    "MuJoCo": style.LOOKS["MuJoCo"], "Drake": style.LOOKS["Drake"],
    "Exudyn, tree": style.LOOKS["Exudyn"],
    "Exudyn, sparse": {**style.LOOKS["Exudyn"], "ls": "--", "mfc": "white"},
}  # fmt: skip
PANELS = (
    ("evaluation_ms", "One evaluation", "CPU ms"),
    ("memory_mib", "Memory", "MiB"),
    ("run_s_per_s", "Simulation from rest", "CPU s per simulated s"),
)


def draw(record: dict[str, Any], path: Path) -> None:
    """Two rows (pins, balls), three columns."""
    figure, panels = plt.subplots(2, 3, figsize=(10, 6.6), sharex=True)
    figure.subplots_adjust(left=0.07, right=0.985, top=0.94, bottom=0.15, hspace=0.2, wspace=0.22)
    for row, kind in zip(panels, ("pins", "balls"), strict=True):
        for axes, (column, title, unit) in zip(row, PANELS, strict=True):
            for tool, looks in LOOKS.items():
                curve(axes, record["results"], tool, kind, column, {"label": tool, **looks})
            axes.set_xscale("log")
            axes.set_yscale("log")
            axes.set_ylabel(unit)
            axes.set_title(f"{title}, {kind}")
    for axes in panels[1]:
        axes.set_xlabel("bodies")
    handles, labels = panels[0][0].get_legend_handles_labels()
    extra = panels[0][2].get_legend_handles_labels()
    shown = dict(zip(labels + extra[1], handles + extra[0], strict=True))
    figure.legend(
        shown.values(), shown.keys(), fontsize=8, ncol=6, loc="lower center",
        bbox_to_anchor=(0.5, 0.035),
    )  # fmt: skip
    style.footer(
        figure, record, "x: gives up at the next size tried (8 GiB and 40 s allowed; table.)"
    )
    style.save(figure, path)


def curve(
    axes: Any, results: list[dict[str, Any]], tool: str, kind: str, column: str, looks: Any
) -> None:
    """One tool, with a cross behind its last size if the next one failed."""
    own = [r for r in results if r["tool"] == tool and r["kind"] == kind]
    points = [(r["bodies"], r[column]) for r in own if column in r]
    if not points:
        return
    axes.plot(*zip(*points, strict=True), **looks)
    failed = [r for r in own if "failure" in r]
    if failed:
        axes.plot(
            [failed[0]["bodies"]], [points[-1][1] * failed[0]["bodies"] / points[-1][0]],
            marker="x", ms=8, mew=2, ls="", color=looks["color"],
        )  # fmt: skip
