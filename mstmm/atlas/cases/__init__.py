"""One file a case, each with its `CASE`; the folders are the list."""

from __future__ import annotations

import pkgutil
from collections.abc import Sequence
from importlib import import_module

from ...errors import SceneError
from ...scene.rules.messages import near
from ..definition import Definition

#: The folders, in the order of the page.
GROUPS = ("products", "sweeps", "steps", "classical", "rotations", "loops", "flexible")


def _files() -> dict[str, str]:
    """Name of every case -> its module."""
    found = {}
    for group in GROUPS:
        folder = import_module(f".{group}", __name__)
        for file in sorted(module.name for module in pkgutil.iter_modules(folder.__path__)):
            found[file.replace("_", "-")] = f".{group}.{file}"
    return found


def names() -> tuple[str, ...]:
    """The names of all cases."""
    return tuple(_files())


def chosen(wanted: Sequence[str] | None) -> tuple[Definition, ...]:
    """The cases of these names, of all where none is given, each once.

    Raises SceneError with the nearest name for one that there is not.
    """
    files = _files()
    for name in wanted or ():
        if name not in files:
            raise SceneError(
                f'case "{name:.60}": the atlas has no such case{near(name, files)} '
                "(mstmm stability --list shows all)"
            )
    each = dict.fromkeys(wanted or files)
    return tuple(import_module(files[name], __name__).CASE for name in each)
