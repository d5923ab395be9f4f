"""Checks for optional packages, before anything is computed."""

from __future__ import annotations

from pathlib import Path

from mstmm import optional_packages
from mstmm.errors import EnvironmentFailure

_EXTRA_BY_SUFFIX = {
    ".nc": "io", ".png": "plot", ".svg": "plot", ".pdf": "plot", ".gif": "plot", ".mp4": "plot",
    ".html": "view",
}  # fmt: skip


def missing_packages(extra: str) -> list[str]:
    """Packages of an extra that are not installed."""
    return optional_packages.missing_packages(extra)


def install_command(extra: str) -> str:
    """Command that installs an extra."""
    return f"pip install 'mstmm[{extra}]'"


def require_extra_for(path: Path, option: str) -> None:
    """Raise EnvironmentFailure if writing this file needs a package that is not installed."""
    extra = _EXTRA_BY_SUFFIX.get(path.suffix.lower())
    if extra is not None and missing_packages(extra):
        alternative = "; or use a name ending in .csv" if extra == "io" else ""
        raise EnvironmentFailure(
            f"{option} {path}: this needs {', '.join(missing_packages(extra))}, not installed: "
            f"{install_command(extra)}{alternative}"
        )


def result_ending() -> str:
    """Default ending of a result file: .nc if NetCDF can be written, else .csv."""
    return ".csv" if missing_packages("io") else ".nc"
