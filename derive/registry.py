"""Which elements there are: each class in `derive/elements/`, and those of a file of the user's."""

from __future__ import annotations

import importlib
import importlib.util
import pkgutil
import sys
from pathlib import Path
from types import ModuleType

from mstmm.errors import ElementError

from . import elements
from .element import Body, ForceElement, Hinge

Element = Hinge | Body | ForceElement
KINDS: tuple[tuple[str, type], ...] = (("hinge", Hinge), ("body", Body), ("force", ForceElement))


def kind_of(element: Element) -> str:
    """hinge, body or force."""
    return next(name for name, base in KINDS if isinstance(element, base))


def elements_in(module: ModuleType) -> list[Element]:
    """One instance of every element class that the module itself defines, in order of the text."""
    return [
        value()
        for value in vars(module).values()
        if isinstance(value, type)
        and issubclass(value, (Hinge, Body, ForceElement))
        and value.__module__ == module.__name__
        and isinstance(vars(value).get("name"), str)
    ]


def builtin_elements() -> list[Element]:
    """All elements of `derive/elements/`, by file name; ElementError for a name used twice."""
    found: dict[tuple[str, str], str] = {}
    result: list[Element] = []
    for info in sorted(pkgutil.iter_modules(elements.__path__), key=lambda i: i.name):
        module = importlib.import_module(f"{elements.__name__}.{info.name}")
        for element in elements_in(module):
            key = (kind_of(element), element.name)
            if key in found:
                raise ElementError(
                    f"{key[0]} {key[1]!r} is defined in {found[key]} and in {info.name}"
                )
            found[key] = info.name
            result.append(element)
    return result


def load_file(path: str | Path) -> list[Element]:
    """Elements of a Python file (trusted code: it is executed).

    Raises ElementError if the file cannot be run or defines no element.
    """
    path = Path(path)
    name = f"mstmm_user_{path.stem}"
    spec = importlib.util.spec_from_file_location(name, path)
    if not path.is_file() or spec is None or spec.loader is None:
        raise ElementError(f"{path}: no such Python file")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        raise ElementError(
            f"{path}: running the file failed with {type(error).__name__}: {error}"
        ) from error
    found = elements_in(module)
    if not found:
        raise ElementError(
            f"{path}: defines no element; subclass mstmm.derive.Hinge, Body or ForceElement "
            "and give it a name"
        )
    return found
