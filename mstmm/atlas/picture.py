"""Plot of a case: both methods along the parameter, the limit, and the failing side."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import SceneError
from ..extras import figures
from ..runtime.host.files import replacing
from .page import number, tried_to

if TYPE_CHECKING:
    from .found import Found
    from .frontier import Points

#: Colours that differ in grey and for colour-blind readers (Okabe and Ito, 2008).
_FAILING, _REMEDY, _SIDE = "#D55E00", "#0072B2", "#fbe6da"

_STYLE: dict[str, Any] = {
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e3e3e3",
    "grid.linewidth": 0.6,
    "axes.edgecolor": "#555555",
    "axes.axisbelow": True,
    "legend.frameon": False,
    "savefig.dpi": 110,
}

#: Range of measured values that is drawn.
_LEAST, _MOST = 1e-17, 1e6

#: Ratio of measured values beyond which their axis is logarithmic.
_DECADE = 10.0

#: Fractions of the axis: space below the data, height of the data, position of arrows and of the
#: text above them.
_FOOT, _FILLED, _ARROWS, _WORD = 0.05, 0.73, 0.84, 0.865

#: Number of letters that fit on a line of the legend.
_LETTERS = 80


def draw(case: Found, path: Path | None) -> Any:
    """Plot a case; see `Case.plot`."""
    Figure = figures()
    import matplotlib as mpl

    style: Any = _STYLE
    with mpl.rc_context(style):
        figure = Figure(figsize=(6.4, 3.7), layout="constrained")
        _fill(figure.subplots(), case)
        if path is not None:
            _write(figure, path)
    return figure


def _fill(axis: Any, case: Found) -> None:
    everything = (*case.points, *case.remedy_points)
    left, right = min(everything)[0], max(everything)[0]
    if case.scale != "linear":
        axis.set_xscale("log")
    if case.scale == "count":
        _whole_ticks(axis, left, right)
    _heights(axis, everything, case.limit)
    axis.axvspan(case.fails_at, right if case.fails == "above" else left, color=_SIDE, zorder=0)
    axis.axvline(case.fails_at, color=_FAILING, linewidth=1.0, linestyle=":")
    axis.axhline(case.limit, color="#555555", linewidth=1.0, linestyle="--")
    _curve(axis, case.points, color=_FAILING, marker="o", label=case.method)
    _curve(axis, case.remedy_points, color=_REMEDY, marker="s", label=case.remedy)
    _name_frontier(axis, case.fails_at)
    if tried_to(case) not in (left, right):
        _name_end(axis, case)
    axis.set_title(case.title, loc="left", fontsize=10, fontweight="bold")
    axis.set_xlabel(f"{case.parameter} in {case.unit}" if case.unit else case.parameter)
    axis.set_ylabel(case.measured)
    handles, _ = axis.get_legend_handles_labels()
    if any(_lost(measured) for _, measured in everything):
        handles += axis.plot([], [], color="#777777", marker=10, linestyle="none", markersize=5,
                             label="no answer, or far above")  # fmt: skip
    wide = sum(len(handle.get_label()) for handle in handles) > _LETTERS
    axis.figure.legend(
        handles=handles, loc="outside lower center", ncols=2 if wide else 3, handlelength=1.4,
        columnspacing=1.2, fontsize=8,
    )  # fmt: skip


def _whole_ticks(axis: Any, left: float, right: float) -> None:
    """Set ticks at integers on a short axis, at powers of ten on a long one."""
    steps = (1, 2, 5) if right < 300 * left else (1,)
    powers = range(int(math.log10(left)), int(math.log10(right)) + 1)
    ticks = [step * 10**power for power in powers for step in steps]
    shown = [tick for tick in ticks if left <= tick <= right]
    axis.set_xticks(shown, [f"{tick:,}".replace(",", " ") for tick in shown])
    axis.minorticks_off()


def _heights(axis: Any, points: Points, limit: float) -> None:
    """Set scale and limits of the axis of measured values: all finite ones, with space above."""
    found = [min(max(m, _LEAST), _MOST) for _, m in points if math.isfinite(m)]
    low, high = min(*found, limit), max(*found, limit)
    if high > _DECADE * low:
        axis.set_yscale("log")
        room = (high / low) ** (1 / _FILLED)
        axis.set_ylim(low / room**_FOOT, low / room**_FOOT * room)
    else:
        room = (high - low) / _FILLED
        axis.set_ylim(low - _FOOT * room, low - _FOOT * room + room)


def _name_frontier(axis: Any, at: float) -> None:
    """Label the frontier with its parameter, at the top, on the side with more space."""
    axis.autoscale_view()  # otherwise the transformation is that of an empty axis
    left, _ = axis.transAxes.inverted().transform(axis.transData.transform((at, 1.0)))
    axis.annotate(
        f"fails at {number(at)}", (at, 0.985), xycoords=("data", "axes fraction"),
        xytext=(-4 if left > 0.5 else 4, 0), textcoords="offset points", color=_FAILING,
        ha="right" if left > 0.5 else "left", va="top",
    )  # fmt: skip


def _name_end(axis: Any, case: Found) -> None:
    """Label the end of the measured range, above the last mark, or below a falling curve."""
    before, last = sorted(case.points, reverse=case.fails == "below")[-2:]
    at, measured = last
    lost = _lost(measured)
    falls = not lost and measured < before[1]
    axis.annotate(
        f"tried to {number(at)}", (at, _WORD if lost else max(measured, _LEAST)),
        xycoords=("data", "axes fraction" if lost else "data"),
        xytext=(0, -7 if falls else 2 if lost else 7), textcoords="offset points", fontsize=8,
        color=_FAILING, ha="center", va="top" if falls else "bottom",
    )  # fmt: skip


def _lost(measured: float) -> bool:
    """Whether there is no answer, or one far beyond the axis."""
    return not measured <= _MOST


def _curve(axis: Any, points: Points, **look: Any) -> None:
    """Draw a line through the measured values, and arrows where there is no answer."""
    shown = [(at, max(m, _LEAST)) for at, m in points if not _lost(m)]
    axis.plot(*zip(*shown, strict=True), linewidth=1.6, markersize=3.5, **look)
    lost = [at for at, m in points if _lost(m)]
    axis.plot(
        lost, [_ARROWS] * len(lost), transform=axis.get_xaxis_transform(), color=look["color"],
        marker=10, linestyle="none", markersize=5,
    )  # fmt: skip


def _write(figure: Any, path: Path) -> None:
    kind = path.suffix.lower().lstrip(".")
    if kind not in ("png", "svg", "pdf"):
        raise SceneError(f'plot "{path}": expected a name that ends in .png, .svg or .pdf')
    with replacing(path) as temporary:
        figure.savefig(temporary, format=kind)
