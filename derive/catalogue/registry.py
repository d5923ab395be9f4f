"""Registry of elements: the classes in `derive/elements/` and those of user files."""

from __future__ import annotations

import importlib
import importlib.util
import pkgutil
import sys
from functools import cache
from importlib.metadata import entry_points
from pathlib import Path
from types import ModuleType

from mstmm.argument_validation import require_path
from mstmm.errors import ElementError
from mstmm.ir.element_spec import ENTRY_POINTS

from .. import elements
from ..definition.element import Body, ForceElement, Hinge

Element = Hinge | Body | ForceElement
KINDS: tuple[tuple[str, type], ...] = (("hinge", Hinge), ("body", Body), ("force", ForceElement))
#: Base classes of elements.
BASES = (Hinge, Body, ForceElement)


def kind_of(element: Element) -> str:
    """Kind of an element: hinge, body or force."""
    return next(name for name, base in KINDS if isinstance(element, base))


def elements_in(module: ModuleType) -> list[Element]:
    """One instance of every element class that the module defines, in order of definition.

    Raises ElementError for a class that cannot be made without arguments or whose name is no text.
    """
    classes = [
        value
        for value in vars(module).values()
        if isinstance(value, type)
        and issubclass(value, BASES)
        and value.__module__ == module.__name__
        and "name" in vars(value)
    ]
    return [instance(value) for value in dict.fromkeys(classes)]


def instance(element: type[Element]) -> Element:
    """Create an element from its class.  Raises ElementError if that is not possible."""
    if not (isinstance(element, type) and issubclass(element, BASES)):
        raise ElementError(
            "expected a subclass of mstmm.derive.Hinge, Body or ForceElement, "
            f"found {element!r:.80}"
        )
    if not isinstance(getattr(element, "name", None), str):
        raise ElementError(
            f'{element.__name__}: name: expected text such as "knee", '
            f"found {getattr(element, 'name', None)!r:.40}"
        )
    try:
        return element()
    except Exception as error:
        raise ElementError(
            f"{element.__name__}: {element.__name__}() raises {type(error).__name__}: {error}; "
            "the class must be callable without arguments"
        ) from error


def builtin_elements() -> list[Element]:
    """All elements of `derive/elements/` with their own kernels, by file name.

    Every call returns the same instances.  Raises ElementError for a name used twice.
    """
    return [e for e in _builtin_elements() if not (isinstance(e, Hinge) and e.equivalent_builtin)]


def builtin_hinges() -> list[Hinge]:
    """All hinges of `derive/elements/`, including those that use the kernels of another."""
    return [element for element in _builtin_elements() if isinstance(element, Hinge)]


@cache
def _builtin_elements() -> tuple[Element, ...]:
    modules: dict[tuple[str, str], str] = {}
    result: list[Element] = []
    for info in sorted(pkgutil.iter_modules(elements.__path__), key=lambda i: i.name):
        module = importlib.import_module(f"{elements.__name__}.{info.name}")
        for element in elements_in(module):
            key = (kind_of(element), element.name)
            if key in modules:
                raise ElementError(
                    f"{key[0]} {key[1]!r} is defined in {modules[key]} and in {info.name}"
                )
            modules[key] = info.name
            result.append(element)
    return tuple(result)


def load_file(path: str | Path) -> list[Element]:
    """Elements of a Python file (trusted code: it is executed).

    Raises ElementError if the file cannot be run, defines no element, or defines one twice.
    """
    path = require_path("elements", path)
    if not path.is_file():
        raise ElementError(f"{path}: no such file")
    name = f"mstmm_user_{path.stem}"
    spec = importlib.util.spec_from_file_location(name, path)
    if path.suffix != ".py" or spec is None or spec.loader is None:
        raise ElementError(f'{path}: expected a Python file (".py")')
    _refuse_null_bytes(path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:
        del sys.modules[name]
        cause = f"{type(error).__name__}: {error}".rstrip(": ")
        raise ElementError(f"{path}: running the file failed with {cause}") from error
    try:
        return _require_distinct(elements_in(module))
    except ElementError as error:
        raise ElementError(f"{path}: {error}") from error


def _refuse_null_bytes(path: Path) -> None:
    """Reject null bytes early, because Python versions raise different errors for them."""
    try:
        content = path.read_bytes()
    except OSError as error:
        raise ElementError(f"{path}: cannot be read ({error.strerror})") from error
    if b"\0" in content:
        raise ElementError(
            f"{path}: expected Python text, found null bytes; save the file as UTF-8"
        )


def _require_distinct(loaded: list[Element]) -> list[Element]:
    if not loaded:
        raise ElementError(
            "defines no element; subclass mstmm.derive.Hinge, Body or ForceElement "
            "and give it a name"
        )
    keys = [(kind_of(e), e.name) for e in loaded]
    for key in keys:
        if keys.count(key) > 1:
            raise ElementError(f"defines {key[0]} {key[1]!r} twice")
    return loaded


def installed_elements() -> list[tuple[str, list[Element]]]:
    """(distribution, its elements) of installed packages that publish elements by entry points.

    Their modules are imported.  Raises ElementError naming the package that fails.
    """
    by_package: dict[str, list[Element]] = {}
    for entry in sorted(entry_points(group=ENTRY_POINTS), key=lambda e: e.name):
        owner = entry.dist.name if entry.dist is not None else entry.value
        try:
            value = entry.load()
            loaded = elements_in(value) if isinstance(value, ModuleType) else [instance(value)]
        except Exception as error:
            cause = (
                f"{type(error).__name__}: {error}" if not isinstance(error, ElementError) else error
            )
            raise ElementError(
                f"package {owner}: entry point {entry.name} = {entry.value}: {cause}"
            ) from error
        by_package.setdefault(owner, []).extend(loaded)
    return [(owner, _require_distinct(elements)) for owner, elements in by_package.items()]
