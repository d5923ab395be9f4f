"""Cases of the atlas: one file per case with its `CASE`, found by folder."""

from __future__ import annotations

import pkgutil
from collections.abc import Sequence
from importlib import import_module

from ...errors import SceneError
from ...scene.validators.validation_messages import did_you_mean
from ..case_definition import CaseDefinition

#: Folders of the cases, in the order of the page.
GROUPS = ("products", "sweeps", "steps", "classical", "rotations", "loops", "flexible")


def _modules_by_name() -> dict[str, str]:
    """Module of each case, by name."""
    modules = {}
    for group in GROUPS:
        folder = import_module(f".{group}", __name__)
        for file in sorted(module.name for module in pkgutil.iter_modules(folder.__path__)):
            modules[file.replace("_", "-")] = f".{group}.{file}"
    return modules


def case_names() -> tuple[str, ...]:
    """Names of all cases."""
    return tuple(_modules_by_name())


def select_cases(names: Sequence[str] | None) -> tuple[CaseDefinition, ...]:
    """Definitions of the cases of these names, without duplicates; default: all cases.

    Raises SceneError, with the nearest name, for an unknown name.
    """
    modules = _modules_by_name()
    for name in names or ():
        if name not in modules:
            raise SceneError(
                f'case "{name:.60}": unknown case{did_you_mean(name, modules)} '
                "(mstmm stability --list shows all cases)"
            )
    selected = dict.fromkeys(names or modules)
    return tuple(import_module(modules[name], __name__).CASE for name in selected)
