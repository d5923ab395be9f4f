"""Prebuilt kernels: the compiled module, loaded once, its elements, and their fingerprint."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from importlib.resources import files
from pathlib import Path
from typing import Any

from mstmm.abi import element_library as abi
from mstmm.errors import ElementError, EnvironmentFailure, SceneError
from mstmm.ir.element_spec import ElementSpec, Param
from mstmm.ir.scene_structure import Key
from mstmm.ir.tape import Tape

from ..libraries.build_extension import BUILT_FROM, source_hash


@dataclass(frozen=True)
class Element:
    """Compiled element as its descriptor states it; `functions` by kernel name."""

    kind: str
    name: str
    nq: int
    nu: int
    parameters: tuple[str, ...]
    functions: dict[str, Any]
    guards: dict[str, dict[int, str]]
    descriptor: Any
    tape: Tape | None = None  # hinge kernel of an element without a library
    slope_tape: Tape | None = None  # derivative of that kernel
    declared: tuple[Param, ...] = ()  # parameters of a user-defined element, bounds and defaults
    hash: str = ""  # of its definition
    spec: ElementSpec | None = None  # definition, of an element that a scene generates itself
    owner: Any = None  # keeps the library or the arrays of the descriptor alive


@cache
def module() -> tuple[Any, Any]:
    """Load (ffi, lib) of the compiled kernels.  EnvironmentFailure if missing or out of date."""
    try:
        kernels: Any = import_module("mstmm.generated._kernels")
    except ImportError as error:
        raise EnvironmentFailure(
            f"the compiled kernels cannot be loaded ({error}); give the process more memory, or "
            "reinstall mstmm: pip install -e . (a C compiler is needed)"
        ) from error
    _check_source_hash(kernels)
    return kernels.ffi, kernels.lib


def _check_source_hash(kernels: Any) -> None:
    """Reject a module that was not built from the installed C text, as after an update."""
    try:
        built_from_hash = text(kernels.ffi, getattr(kernels.lib, BUILT_FROM))
    except AttributeError:  # an older module without this string
        built_from_hash = ""
    if built_from_hash != source_hash(Path(str(files("mstmm")))):
        raise EnvironmentFailure(
            f"the compiled kernels {kernels.__file__} belong to another version of mstmm; rebuild "
            "them: pip install -e . in the checkout, or pip install --force-reinstall mstmm "
            "(a C compiler is needed)"
        )


def text(ffi: Any, pointer: Any) -> str:
    """C string as str; empty for NULL."""
    return "" if pointer == ffi.NULL else ffi.string(pointer).decode()


def read_element(ffi: Any, descriptor: Any) -> Element:
    """Element of a C descriptor.  EnvironmentFailure if it was built for another layout."""
    name = text(ffi, descriptor.name)
    if descriptor.abi != abi.ABI_VERSION:
        raise EnvironmentFailure(
            f"element {name!r} was built for layout {descriptor.abi}, this mstmm has "
            f"{abi.ABI_VERSION}; regenerate it: mstmm generate FILE"
        )
    functions, guards = {}, {}
    for i in range(descriptor.n_kernels):
        kernel = descriptor.kernels[i]
        functions[text(ffi, kernel.name)] = kernel.function
        guards[text(ffi, kernel.name)] = {
            int(kernel.guards[k].code): text(ffi, kernel.guards[k].message)
            for k in range(kernel.n_guards)
        }
    parameters = tuple(text(ffi, descriptor.p_names[i]) for i in range(descriptor.np))
    return Element(
        text(ffi, descriptor.kind), name, int(descriptor.nq), int(descriptor.nu), parameters,
        functions, guards, descriptor, hash=text(ffi, descriptor.hash),
    )  # fmt: skip


@cache
def elements() -> dict[tuple[str, str], Element]:
    """All prebuilt elements by (kind, name)."""
    ffi, lib = module()
    all_elements = (
        read_element(ffi, lib.mstmm_elements[i]) for i in range(lib.mstmm_element_count)
    )
    return {(element.kind, element.name): element for element in all_elements}


def element(kind: str, name: str) -> Element:
    """Prebuilt element by kind and name.  ElementError if there is none."""
    try:
        return elements()[kind, name]
    except KeyError:
        raise ElementError(f"there is no prebuilt {kind} called {name!r}") from None


Known = Mapping[Key, Element]


class Elements:
    """Prebuilt and user-defined elements, by kind and name."""

    def __init__(self, known: Known) -> None:
        self.known = known

    def __getitem__(self, key: Key) -> Element:
        """Element with this key; KeyError if it is not defined."""
        return self.known[key] if key in self.known else elements()[key]

    def __contains__(self, key: Key) -> bool:
        return key in self.known or key in elements()

    def get(self, kind: str, name: str, user: str) -> Element:
        """Element that the part `user` names as its type; SceneError if it is not defined."""
        try:
            return self[kind, name]
        except KeyError:
            raise SceneError(
                f'scene: {kind} "{user}": type: unknown type "{name}"; generate it with: '
                "mstmm generate FILE, or use one of: mstmm list"
            ) from None


def declared_numbers(
    declared: Sequence[Param], given: Mapping[str, float], where: str
) -> tuple[float, ...]:
    """Values of declared parameters in their order, with defaults.

    Raises SceneError with the name of the element (`where`) for missing or invalid values.
    """
    numbers = []
    for p in declared:
        value = given.get(p.name, p.default)
        problem = ""
        if value is None:
            problem = "missing; expected a number"
        elif p.minimum is not None and value < p.minimum:
            problem = f"expected {p.minimum:g} {p.unit} or more, found {value:g}"
        elif p.maximum is not None and value > p.maximum:
            problem = f"expected {p.maximum:g} {p.unit} or less, found {value:g}"
        if value is None or problem:
            raise SceneError(f"scene: {where}: parameters.{p.name}: {problem}")
        numbers.append(value)
    return tuple(numbers)


@cache
def _manifest() -> bytes:
    return files("mstmm.generated").joinpath("manifest.json").read_bytes()


def kernels_hash(known: Mapping[Key, Element] | None) -> str:
    """SHA-256 of the hashes of all generated kernels, and of elements that are not prebuilt."""
    digest = hashlib.sha256(_manifest())
    for (kind, name), element in sorted((known or {}).items()):
        digest.update(f"{kind} {name} {element.hash}\n".encode())
    return digest.hexdigest()
