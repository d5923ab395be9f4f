"""Cases of the atlas, by subject: each module has its `CASES`, and the methods that they need.

The failing methods are built from the kernels of the correct ones; no simulation uses them.
"""

from __future__ import annotations

import pkgutil
from collections.abc import Sequence
from functools import cache
from importlib import import_module

from ...errors import SceneError
from ...scene.validators.validation_messages import did_you_mean
from ..case_definition import CaseDefinition

#: Groups of cases in the order of the page; the name of a module starts with its group.
GROUPS = ("products", "sweeps", "steps", "classical", "rotations", "loops", "flexible")


@cache
def _cases_by_name() -> dict[str, CaseDefinition]:
    """All cases in the order of the page: by group, then by name."""
    groups: dict[str, list[CaseDefinition]] = {group: [] for group in GROUPS}
    for module in pkgutil.iter_modules(__path__):
        groups[module.name.partition("_")[0]] += import_module(f".{module.name}", __name__).CASES
    return {
        case.name: case
        for group in groups.values()
        for case in sorted(group, key=lambda case: case.name)
    }


def case_names() -> tuple[str, ...]:
    """Names of all cases."""
    return tuple(_cases_by_name())


def select_cases(names: Sequence[str] | None) -> tuple[CaseDefinition, ...]:
    """Definitions of the cases of these names, without duplicates; default: all cases.

    Raises SceneError, with the nearest name, for an unknown name.
    """
    cases = _cases_by_name()
    for name in names or ():
        if name not in cases:
            raise SceneError(
                f'case "{name:.60}": unknown case{did_you_mean(name, cases)} '
                "(mstmm stability --list shows all cases)"
            )
    return tuple(cases[name] for name in dict.fromkeys(names or cases))
