"""Figures by matplotlib: one style, curves, and files (extra: plot)."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import Any

from mstmm.errors import SceneError
from mstmm.optional_packages import missing_package_error

from .platform_support.safe_files import replace_atomically, require_path

#: Colours that are distinguishable in grey and for colour-blind readers (Okabe and Ito, 2008).
_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#000000", "#F0E442")
#: Line styles and markers of curves of equal colour.
_DASHES = ("-", (0, (5, 1.6)), (0, (1.2, 1.4)), (0, (6, 1.5, 1.2, 1.5)))
_MARKERS = ("o", "s", "^", "D")

_STYLE: dict[str, Any] = {
    "axes.spines.top": False, "axes.spines.right": False, "axes.grid": True,
    "grid.color": "#e3e3e3", "grid.linewidth": 0.7, "axes.edgecolor": "#555555",
    "axes.axisbelow": True, "axes.formatter.use_mathtext": True, "axes.formatter.useoffset": False,
    "axes.formatter.limits": (-4, 5), "lines.linewidth": 1.6, "legend.frameon": False,
}  # fmt: skip


@contextmanager
def figure_style(font_size: float = 10) -> Iterator[None]:
    """Style of figures while they are drawn; also a decorator of a function that draws them.

    EnvironmentFailure without the extra `plot`.
    """
    figure_class()
    import matplotlib as mpl

    style: Any = {"font.size": font_size, **_STYLE}
    with mpl.rc_context(style):
        yield


def figure_class(what: str = "a picture") -> Any:
    """Class `matplotlib.figure.Figure`, registered for display in notebooks.

    The notebook needs no magic command for that.  EnvironmentFailure without the extra `plot`.
    """
    try:
        from matplotlib import figure
    except ImportError as error:
        raise missing_package_error("plot", what, error) from None
    Figure = figure.Figure
    ipython = sys.modules.get("IPython")
    shell = None if ipython is None else ipython.get_ipython()
    if shell is not None and hasattr(shell, "kernel"):
        formatter = shell.display_formatter.formatters["image/png"]
        if Figure not in formatter.type_printers:
            formatter.for_type(Figure, _png)
    return Figure


def _png(figure: Any) -> bytes:
    buffer = BytesIO()
    figure.savefig(buffer, format="png", bbox_inches="tight")
    return buffer.getvalue()


def new_figure(width: float, height: float) -> Any:
    """Empty figure of a width and height in inches.  EnvironmentFailure without the extra."""
    return figure_class()(figsize=(width, height), layout="constrained")


def curve_style(colour: int, style: int = 0) -> dict[str, Any]:
    """Colour and line style of a curve by their numbers, which repeat."""
    return {"color": _COLOURS[colour % len(_COLOURS)], "linestyle": _cycled(_DASHES, colour, style)}


def curve_marker(colour: int, style: int = 0) -> str:
    """Marker of a curve that is a single point, as in `curve_style`."""
    return str(_cycled(_MARKERS, colour, style))


def _cycled(kinds: Sequence[Any], colour: int, style: int) -> Any:
    """Kind of a curve: the next one when the colours repeat."""
    return kinds[(style + colour // len(_COLOURS)) % len(kinds)]


def write_figure(
    figure: Any, path: str | Path | None, what: str = "picture", dpi: float = 150
) -> Any:
    """Write a figure in the format of the suffix, unless `path` is None; returns the figure.

    SceneError, which names `what`, for a suffix that matplotlib does not know.
    """
    if path is not None:
        path = require_path(path)
        kind = path.suffix.lower().lstrip(".")
        if kind not in figure.canvas.get_supported_filetypes():
            raise SceneError(f'{what} "{path}": expected a name that ends in .png, .svg or .pdf')
        with replace_atomically(path) as temporary:
            figure.savefig(temporary, format=kind, dpi=dpi)
    return figure
