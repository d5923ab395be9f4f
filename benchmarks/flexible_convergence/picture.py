"""The picture of the convergence of flexible bodies: error over the number of shapes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
from common import style

TITLES = {
    "pendulum": "Pinned beam falling, 1 s",
    "two pinned": "Two pinned beams falling, 1 s",
    "welded": "L of two welded beams falling, 0.5 s",
}
LINE_STYLES: dict[str, dict[str, Any]] = {
    "chord": {"color": "#c1121f", "marker": "o", "lw": 2.0, "zorder": 5},
    "mean": {"color": "#1d3557", "marker": "^", "lw": 1.6},
    "tangent, quadrature": {"color": "#2a9d8f", "marker": "D", "lw": 1.6},
    "chord, linear": {"color": "#7f7f7f", "marker": "h", "lw": 1.4, "ls": "--"},
    "clamped-free": {"color": "#2a9d8f", "marker": "D", "lw": 1.6},
    "simply-supported": {"color": "#8d6a9f", "marker": "X", "lw": 1.6},
    "static + fixed-interface": {"color": "#c1121f", "marker": "o", "lw": 2.0, "zorder": 5},
    "static+fixed-interface": {"color": "#c1121f", "marker": "o", "lw": 2.0, "zorder": 5},
    "static + fixed-interface, linear": {"color": "#7f7f7f", "marker": "h", "lw": 1.4, "ls": "--"},
}


@style.styled
def draw(record: dict[str, Any], path: Path) -> None:
    """Three motions above; frequencies and spin-ups below."""
    figure, panels = plt.subplots(2, 3, figsize=(11.5, 7.2))
    figure.subplots_adjust(
        left=0.065, right=0.985, top=0.95, bottom=0.075, wspace=0.24, hspace=0.32
    )
    for axes, (case, result) in zip(panels[0], record["motions"].items(), strict=True):
        for line, errors in result["lines"].items():
            axes.plot(
                [int(n) for n in errors], list(errors.values()), label=line, **LINE_STYLES[line]
            )
        rigid = result["rigid"]
        axes.axhline(rigid, color="black", lw=0.8, ls=":")
        axes.text(0.98, rigid * 1.1, "rigid", fontsize=7, ha="right", va="bottom",
                  transform=axes.get_yaxis_transform())  # fmt: skip
        axes.set_title(TITLES[case])
        axes.legend(fontsize=7.5, loc="lower left")
    panels[0, 0].set_ylabel("largest tip error, m (lengths 1 m)")
    _draw_frequencies(panels[1, 0], record["frequencies"]["l_frame"])
    _draw_rotating_beam(panels[1, 1], record["frequencies"]["turning"])
    _draw_spin_ups(panels[1, 2], record["spin_ups"])
    for axes in panels.flat:
        axes.set_yscale("log")
        axes.set_xlabel("shapes per beam")
        axes.xaxis.get_major_locator().set_params(integer=True)
    style.save_figure(figure, path)


def _draw_frequencies(axes: Any, results: dict[str, Any]) -> None:
    for basis, errors in results.items():
        worst = [max(values) for values in errors.values()]
        axes.plot([int(n) for n in errors], worst, label=basis, **LINE_STYLES[basis])
    axes.set_title("L-frame: worst of three frequencies")
    axes.set_ylabel("relative error")
    axes.legend(fontsize=7.5, loc="lower left")


def _draw_rotating_beam(axes: Any, results: dict[str, Any]) -> None:
    line_styles = {"flap": LINE_STYLES["chord"], "lag": LINE_STYLES["mean"]}
    for word, errors in results.items():
        axes.plot([int(n) for n in errors], list(errors.values()), label=word, **line_styles[word])
    axes.set_title("Blade turning at 12: first frequency")
    axes.legend(fontsize=7.5, loc="lower left")


def _draw_spin_ups(axes: Any, results: dict[str, Any]) -> None:
    colours = {"simo": "#c1121f", "kane 4": "#1d3557", "kane 6": "#2a9d8f"}
    names = {
        "simo": "Simo and Vu-Quoc, 1.58",
        "kane 4": "Kane et al., 1.38",
        "kane 6": "the same, 2.06",
    }
    for case, forms in results.items():
        for form, errors in forms.items():
            line_style = {"color": colours[case], "marker": "o", "lw": 1.8}
            if form == "quadrature":
                line_style |= {"ls": "--", "mfc": "white", "lw": 1.2}
            values = [entry["error"] for entry in errors.values()]
            label = names[case] if form != "quadrature" else None
            axes.plot([int(n) for n in errors], values, label=label, **line_style)
    axes.plot([], [], color="#555555", ls="--", marker="o", mfc="white", label="quadrature form")
    axes.set_title("Spin-ups: largest tip deflection")
    axes.set_ylabel("error over the length")
    axes.set_ylim(2e-6, 3e-3)
    axes.legend(fontsize=7.5, loc="lower left")
