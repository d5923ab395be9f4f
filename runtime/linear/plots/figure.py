"""Creation, formatting and saving of figures."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from mstmm.errors import SceneError
from mstmm.optional_packages import figure_class

from ...platform_support.safe_files import replace_atomically, require_path

_FORMATS = (".png", ".svg", ".pdf")


def figure(height: float = 4.5, width: float = 7.5) -> Any:
    """Empty figure of a height and width in inches.

    Raises EnvironmentFailure without the extra.
    """
    return figure_class()(figsize=(width, height), layout="constrained")


def write(drawing: Any, path: str | Path | None) -> None:
    """Save the figure as .png, .svg or .pdf, by file extension; do nothing if `path` is None.

    Raises SceneError for another extension.
    """
    if path is None:
        return
    path = require_path(path)
    if path.suffix.lower() not in _FORMATS:
        raise SceneError(f'picture "{path}": expected a name ending in {", ".join(_FORMATS)}')
    with replace_atomically(path) as temporary:
        drawing.savefig(temporary, dpi=150, format=path.suffix[1:].lower())


def require_columns(values: NDArray[Any]) -> None:
    """Raise SceneError if `values` has no column to draw."""
    if not values.shape[1]:
        raise SceneError("nothing to draw: the scene has no degrees of freedom")


def finish_axes(*axes: Any) -> None:
    """Add a light grid and remove the top and right spines."""
    for axis in axes:
        axis.grid(alpha=0.3, which="both", lw=0.5)
        axis.spines[["top", "right"]].set_visible(False)
