"""Picture of the long chains: time and memory over length, crosses for failures."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
from common import style

LINE_STYLES = {
    "mstmm": style.LINE_STYLES["mstmm looped"], "Pinocchio": style.LINE_STYLES["Pinocchio"],
    "MuJoCo": style.LINE_STYLES["MuJoCo"], "Drake": style.LINE_STYLES["Drake"],
    "Exudyn, tree": style.LINE_STYLES["Exudyn"],
    "Exudyn, sparse": {**style.LINE_STYLES["Exudyn"], "ls": "--", "mfc": "white"},
}  # fmt: skip
PANELS = (
    ("evaluation_ms", "One evaluation", "CPU ms"),
    ("memory_mib", "Memory", "MiB"),
    ("run_s_per_s", "Simulation from rest", "CPU s per simulated s"),
)


@style.styled
def draw(record: dict[str, Any], path: Path) -> None:
    """Two rows (pins, balls), three columns."""
    figure, panels = plt.subplots(2, 3, figsize=(10, 6.6), sharex=True)
    figure.subplots_adjust(left=0.07, right=0.985, top=0.94, bottom=0.15, hspace=0.2, wspace=0.22)
    for row, kind in zip(panels, ("pins", "balls"), strict=True):
        for axes, (column, title, unit) in zip(row, PANELS, strict=True):
            for tool, line_style in LINE_STYLES.items():
                draw_curve(
                    axes, record["results"], tool, kind, column, {"label": tool, **line_style}
                )
            axes.set_xscale("log")
            axes.set_yscale("log")
            axes.set_ylabel(unit)
            axes.set_title(f"{title}, {kind}")
    for axes in panels[1]:
        axes.set_xlabel("bodies")
    handles, labels = panels[0][0].get_legend_handles_labels()
    more_entries = panels[0][2].get_legend_handles_labels()
    legend_entries = dict(zip(labels + more_entries[1], handles + more_entries[0], strict=True))
    figure.legend(
        legend_entries.values(), legend_entries.keys(), fontsize=8, ncol=6, loc="lower center",
        bbox_to_anchor=(0.5, 0.035),
    )  # fmt: skip
    style.add_footer(figure, record, "x: fails at the next size (limits 8 GiB and 40 s)")
    style.save_figure(figure, path)


def draw_curve(
    axes: Any, results: list[dict[str, Any]], tool: str, kind: str, column: str, line_style: Any
) -> None:
    """Curve of a program, with a cross after its last size if the next one failed."""
    own_rows = [r for r in results if r["tool"] == tool and r["kind"] == kind]
    points = [(r["bodies"], r[column]) for r in own_rows if column in r]
    if not points:
        return
    axes.plot(*zip(*points, strict=True), **line_style)
    failures = [r for r in own_rows if "failure" in r]
    if failures:
        axes.plot(
            [failures[0]["bodies"]], [points[-1][1] * failures[0]["bodies"] / points[-1][0]],
            marker="x", ms=8, mew=2, ls="", color=line_style["color"],
        )  # fmt: skip
