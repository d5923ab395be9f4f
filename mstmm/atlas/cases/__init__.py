"""One file a case, each with its `CASE`; the folder is the list."""

from __future__ import annotations

import pkgutil
from collections.abc import Sequence
from importlib import import_module

from ...errors import SceneError
from ...scene.rules.messages import near
from ..definition import Definition


def names() -> tuple[str, ...]:
    """The names of all cases."""
    files = sorted(module.name for module in pkgutil.iter_modules(__path__))
    return tuple(file.replace("_", "-") for file in files)


def chosen(wanted: Sequence[str] | None) -> tuple[Definition, ...]:
    """The cases of these names, of all where none is given, each once.

    Raises SceneError with the nearest name for one that there is not.
    """
    known = names()
    for name in wanted or ():
        if name not in known:
            raise SceneError(
                f'case "{name:.60}": the atlas has no such case{near(name, known)} '
                "(mstmm stability --list shows all)"
            )
    files = (name.replace("-", "_") for name in dict.fromkeys(wanted or known))
    return tuple(import_module(f".{file}", __name__).CASE for file in files)
