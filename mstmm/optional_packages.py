"""Optional packages of the extras of mstmm, imported when they are needed."""

from __future__ import annotations

import sys
from importlib.util import find_spec

from .errors import EnvironmentFailure

#: Extra -> packages that it provides.
PACKAGES_BY_EXTRA = {
    "io": ("xarray", "h5netcdf", "h5py"), "plot": ("matplotlib",), "view": ("viser",),
    "fem": ("skfem", "meshio"),
}  # fmt: skip


def missing_packages(extra: str) -> list[str]:
    """Packages of an extra that are not installed; to be checked before a computation."""
    return [name for name in PACKAGES_BY_EXTRA[extra] if find_spec(name) is None]


def missing_package_error(name: str, what: str, error: ImportError) -> EnvironmentFailure:
    """Error for a package of an extra that is not installed or cannot be loaded.

    The message names the package, its purpose `what`, and how to install it.
    """
    package = (error.name or "").partition(".")[0]
    if not isinstance(error, ModuleNotFoundError) or (
        package in sys.modules and find_spec(package)
    ):
        return EnvironmentFailure(
            f"{what} needs the package {error.name or 'of an extra'}, which cannot be loaded "
            f"({error}); give the process more memory, or reinstall the package: "
            f"pip install 'mstmm[{name}]'"
        )
    return EnvironmentFailure(
        f"{what} needs the package {error.name or 'of an extra'}, which is not installed; "
        f"install it with: pip install 'mstmm[{name}]'"
    )
