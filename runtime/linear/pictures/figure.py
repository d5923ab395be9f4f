"""Figures: made empty, settled, written."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from mstmm.errors import SceneError
from mstmm.extras import figures

from ...host.files import path_of, replacing

_FORMATS = (".png", ".svg", ".pdf")


def figure(height: float = 4.5, width: float = 7.5) -> Any:
    """An empty figure.  EnvironmentFailure without the extra."""
    return figures()(figsize=(width, height), layout="constrained")


def write(made: Any, path: str | Path | None) -> None:
    """The figure into a file (None: none); its ending says how.  SceneError for another ending."""
    if path is None:
        return
    path = path_of(path)
    if path.suffix.lower() not in _FORMATS:
        raise SceneError(f'picture "{path}": expected a name ending in {", ".join(_FORMATS)}')
    with replacing(path) as temporary:
        made.savefig(temporary, dpi=150, format=path.suffix[1:].lower())


def refuse_none(values: NDArray[Any]) -> None:
    """SceneError where there is no column of numbers to draw."""
    if not values.shape[1]:
        raise SceneError("nothing moves in this scene, so that there is nothing to draw")


def settled(*axes: Any) -> None:
    """A light grid, and no frame above and to the right."""
    for axis in axes:
        axis.grid(alpha=0.3, which="both", lw=0.5)
        axis.spines[["top", "right"]].set_visible(False)
