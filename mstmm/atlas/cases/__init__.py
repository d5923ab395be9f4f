"""Cases of the atlas: one file per case with its `CASE`, found by folder."""

from __future__ import annotations

import pkgutil
from collections.abc import Sequence
from importlib import import_module

from ...errors import SceneError
from ...scene.rules.messages import near
from ..definition import Definition

#: Folders of the cases, in the order of the page.
GROUPS = ("products", "sweeps", "steps", "classical", "rotations", "loops", "flexible")


def _files() -> dict[str, str]:
    """Module of each case, by name."""
    found = {}
    for group in GROUPS:
        folder = import_module(f".{group}", __name__)
        for file in sorted(module.name for module in pkgutil.iter_modules(folder.__path__)):
            found[file.replace("_", "-")] = f".{group}.{file}"
    return found


def names() -> tuple[str, ...]:
    """Names of all cases."""
    return tuple(_files())


def chosen(wanted: Sequence[str] | None) -> tuple[Definition, ...]:
    """Definitions of the cases of these names, without duplicates; default: all cases.

    Raises SceneError, with the nearest name, for an unknown name.
    """
    files = _files()
    for name in wanted or ():
        if name not in files:
            raise SceneError(
                f'case "{name:.60}": there is no such case{near(name, files)} '
                "(mstmm stability --list shows all)"
            )
    each = dict.fromkeys(wanted or files)
    return tuple(import_module(files[name], __name__).CASE for name in each)
