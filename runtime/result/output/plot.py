"""Pictures of a result: any quantities by name over time, one panel per unit (extra: plot)."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mstmm.errors import SceneError
from mstmm.extras import missing
from mstmm.printable import printable

from ...host.files import replacing
from ..flexible.pictures import Picture, picture
from .curves import curve
from .table import default_names, default_pictures

if TYPE_CHECKING:
    from ..names import Quantity
    from ..record import Record

#: Colours that stay apart in grey and for colour-blind readers (Okabe and Ito, 2008).
_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#000000", "#F0E442")

_STYLE: dict[str, Any] = {
    "font.size": 10,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e3e3e3",
    "grid.linewidth": 0.7,
    "axes.edgecolor": "#555555",
    "axes.axisbelow": True,
    "axes.formatter.use_mathtext": True,
    "axes.formatter.useoffset": False,
    "axes.formatter.limits": (-4, 5),
    "lines.linewidth": 1.6,
    "legend.frameon": False,
    "savefig.dpi": 150,
}

#: Points of a smooth curve between samples of the integrator's own steps.
_FINE = 1500

#: Inches of a panel of curves.
_HEIGHT = 2.3

#: A panel shows at least this part of its largest value.
_FLAT = 1e-3

_UNIT_TEXT = {
    "N*m": "N m",
    "m/s2": "m/s²",
    "rad/s2": "rad/s²",
    "kg*m/s": "kg m/s",
    "kg*m2/s": "kg m²/s",
}


def plot(result: Record, names: Sequence[str], path: Path | None, title: str | None) -> Any:
    """`matplotlib.figure.Figure`; see `Result.plot`.

    Raises SceneError for an unknown name or file type, EnvironmentFailure without the extra.
    """
    try:
        import matplotlib as mpl
        from matplotlib.figure import Figure
    except ImportError as error:
        raise missing("plot", "a picture", error) from None
    if not len(result.t):
        raise SceneError("there is nothing to plot: the run has no sample; ask for other times")
    panels = _panels(result, names)
    if not panels:
        raise SceneError("there is nothing to plot: give the name of a quantity, such as energy")
    style: Any = _STYLE
    with mpl.rc_context(style):
        figure = Figure(
            figsize=(7.5, 1.0 + sum(panel.height for panel in panels)), layout="constrained"
        )
        groups = [[panel] for panel in panels if not panel.over_time]
        groups += [[panel for panel in panels if panel.over_time]]
        groups = [group for group in groups if group]
        heights = [sum(panel.height for panel in group) for group in groups]
        parts = figure.subfigures(len(groups), 1, height_ratios=heights, squeeze=False)[:, 0]
        for part, group in zip(parts, groups, strict=True):
            _fill(part, group)
        if title:
            figure.suptitle(printable(title), parse_math=False)
        if path is not None:
            _write(figure, path)
    return figure


def _panels(result: Record, names: Sequence[str]) -> list[Picture]:
    """Pictures, then quantities of one unit together, in the order of their first ones."""
    wanted = list(dict.fromkeys(names)) or [*default_pictures(result), *default_names(result)]
    found = {name: picture(result, name) for name in wanted}
    panels: list[Picture] = [one for one in found.values() if one is not None]
    chosen = [result.quantity(name) for name, one in found.items() if one is None]
    units: dict[str, list[Quantity]] = {}
    for quantity in {quantity.name: quantity for quantity in chosen}.values():
        units.setdefault(quantity.unit, []).append(quantity)
    curves = [
        Picture(partial(_curves, result, some), _HEIGHT, over_time=True) for some in units.values()
    ]
    return panels + curves


def _fill(part: Any, group: Sequence[Picture]) -> None:
    """One picture, or all panels over time with one time axis below the last."""
    heights = [panel.height for panel in group]
    axes = part.subplots(len(group), 1, height_ratios=heights, sharex=True, squeeze=False)[:, 0]
    for axis, panel in zip(axes, group, strict=True):
        panel.draw(part, axis)
    if group[0].over_time:
        axes[-1].set_xlabel("time in s")


def _curves(result: Record, panel: Sequence[Quantity], figure: Any, axis: Any) -> None:
    _draw(axis, result, panel)


def _draw(axis: Any, result: Record, panel: Sequence[Quantity]) -> None:
    """The curves of one panel, broken where an event makes them jump."""
    axis.set_prop_cycle(color=_COLOURS)
    lines = 0
    for quantity in panel:
        labels = [f"{quantity.name}.{x}" for x in quantity.labels] or [quantity.name]
        times, columns = curve(result.t, quantity)
        for label, values in zip(labels, columns.T, strict=True):
            axis.plot(times, values, label=label)
            lines += 1
    unit = panel[0].unit
    name = panel[0].name if lines == 1 else ""
    text = _UNIT_TEXT.get(unit, unit)
    axis.set_ylabel(" in ".join(x for x in (name, text) if x))
    axis.margins(x=0.01)
    _flatten(axis)
    if lines > 1:
        axis.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), handlelength=1.4)


def _flatten(axis: Any) -> None:
    """Show a constant as a line, not its last digits as mountains."""
    low, high = axis.dataLim.intervaly
    least = _FLAT * max(abs(low), abs(high))
    if np.isfinite([low, high]).all() and high - low < least:
        middle = (low + high) / 2
        axis.set_ylim(middle - least / 2, middle + least / 2)


def _write(figure: Any, path: Path) -> None:
    known = figure.canvas.get_supported_filetypes()
    kind = path.suffix.lower().lstrip(".")
    if kind not in known:
        raise SceneError(f'picture "{path}": expected a name that ends in .png, .svg or .pdf')
    with replacing(path) as temporary:
        figure.savefig(temporary, format=kind)
