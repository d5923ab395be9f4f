"""Packages that come with an extra, imported when they are needed."""

from __future__ import annotations

import sys
from importlib.util import find_spec
from io import BytesIO
from typing import Any

from .errors import EnvironmentFailure

#: Extra -> what is imported for it.
PACKAGES = {
    "io": ("xarray", "h5netcdf", "h5py"), "plot": ("matplotlib",), "view": ("viser",),
    "fem": ("skfem", "meshio"),
}  # fmt: skip


def absent(extra: str) -> list[str]:
    """Packages of an extra that are not installed; asked before anything is computed."""
    return [name for name in PACKAGES[extra] if find_spec(name) is None]


def missing(name: str, what: str, error: ImportError) -> EnvironmentFailure:
    """A package of an extra is missing or does not load: which one, what for, and how to get it."""
    package = (error.name or "").partition(".")[0]
    if not isinstance(error, ModuleNotFoundError) or (
        package in sys.modules and find_spec(package)
    ):
        return EnvironmentFailure(
            f"{what} needs the package {error.name or 'of an extra'}, which does not load "
            f"({error}); give the process more memory, or install it anew: "
            f"pip install 'mstmm[{name}]'"
        )
    return EnvironmentFailure(
        f"{what} needs the package {error.name or 'of an extra'}, which is not installed; "
        f"install it with: pip install 'mstmm[{name}]'"
    )


def figures(what: str = "a picture") -> Any:
    """The class `matplotlib.figure.Figure`, which from then on a notebook shows; the one in which
    this runs need not have asked for pictures.  EnvironmentFailure without the extra `plot`."""
    try:
        from matplotlib import figure
    except ImportError as error:
        raise missing("plot", what, error) from None
    Figure = figure.Figure
    ipython = sys.modules.get("IPython")
    shell = None if ipython is None else ipython.get_ipython()
    if shell is not None and hasattr(shell, "kernel"):
        formatter = shell.display_formatter.formatters["image/png"]
        if Figure not in formatter.type_printers:
            formatter.for_type(Figure, _png)
    return Figure


def _png(figure: Any) -> bytes:
    written = BytesIO()
    figure.savefig(written, format="png", bbox_inches="tight")
    return written.getvalue()
