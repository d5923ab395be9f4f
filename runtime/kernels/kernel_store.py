"""User's kernel store: elements generated from files outside the package, one folder each.

A folder `hinge_knee/` contains the stored element (JSON), its C text and, if a compiler was found,
an entry with its library (`entry.py`), built and checked like those of the cache.  Loading reads
these files and executes none of the definitions.  Hinges without a library are interpreted from
their IR.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import replace
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

import cffi

from mstmm.abi import element_library as abi
from mstmm.errors import ElementError, EnvironmentFailure
from mstmm.ir.element_spec import ElementSpec, element_from_json, element_to_json, kernel_from_json
from mstmm.ir.hinge_properties import builtin_hinges, is_same_motion
from mstmm.ir.tape import compile_tape
from mstmm.scene import Scene
from mstmm.scene.checks.user_types import used_types

from ..libraries.build_extension import COMPILE_ARGS
from ..libraries.cache_files import (
    DESCRIPTION_FILE,
    DamagedEntryError,
    folder_problem,
    parent_problem,
    read_private,
)
from ..libraries.library_build import BuildOrder, BuiltLibrary, find_library, get_or_build, remove
from ..libraries.toolchain import time_limit
from ..platform_support.safe_files import write_text
from . import prebuilt_kernels
from .prebuilt_kernels import Element

Key = tuple[str, str]

_TRUSTED_OWNERS = (0,)  # user who may own a store that all can read
#: File name of a stored definition; reading a scene never executes it.
DEFINITION_FILE = "definition.py"
_LABEL = "kernel store"
_REMEDY = "set MSTMM_KERNELS to a folder that you own"


def folder() -> Path:
    """Folder of the store: $MSTMM_KERNELS, or the user's data folder."""
    configured_folder = os.environ.get("MSTMM_KERNELS")
    if configured_folder:
        return Path(configured_folder)
    import platformdirs

    return Path(platformdirs.user_data_path("mstmm")) / "kernels"


def _element_folder(key: Key) -> Path:
    return folder() / f"{key[0]}_{key[1]}"


def _check_trusted(place: Path) -> None:
    """Raise EnvironmentFailure if other users could have written to a folder of the store.

    Its files become equations and code of this process.
    """
    with suppress(OSError):  # the folder does not exist: nothing to check
        for checked_folder in (folder(), place):
            problem = folder_problem(
                checked_folder, os.stat(checked_folder), _LABEL, _REMEDY, _TRUSTED_OWNERS
            )
            problem = problem or parent_problem(checked_folder, _LABEL, _REMEDY)
            if problem:
                raise EnvironmentFailure(problem)


def store_element(spec: ElementSpec, files: dict[str, str]) -> tuple[Path, str]:
    """Write a generated element (`files`: name -> C text) into the store and compile it.

    Returns its folder and a phrase that says whether it is compiled or interpreted.  Raises
    EnvironmentFailure if the folder cannot be written, or if a body or force element cannot be
    compiled.
    """
    place = _element_folder((spec.kind, spec.name))
    _check_trusted(place)
    replacement_note = _replacement_note(place, spec)
    try:
        folder().parent.mkdir(parents=True, exist_ok=True)
        for new_folder in (folder(), place):
            new_folder.mkdir(mode=0o700, exist_ok=True)
        for name, text in {**files, "element.json": element_to_json(spec)}.items():
            write_text(place / name, text)
            (place / name).chmod(0o600)
    except (OSError, EnvironmentFailure) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise EnvironmentFailure(
            f"the kernel store {folder()} cannot be written ({reason}); {_REMEDY}"
        ) from error
    open_element.cache_clear()
    try:
        get_or_build(_library_folder(spec), _build_order(spec), time_limit())
        _remove_old_libraries(place, _library_folder(spec))
        return place, f"compiled{replacement_note}"
    except EnvironmentFailure as error:
        if spec.kind != "hinge":
            raise
        return place, f"interpreted, several times slower than compiled: {error}{replacement_note}"


def definition_path(key: Key) -> Path:
    """File from which an element of the store was generated.

    ElementError if there is none or other users could have written it.
    """
    place = _element_folder(key)
    _check_trusted(place)
    try:
        read_private(place / DEFINITION_FILE)
    except (OSError, DamagedEntryError) as error:
        raise ElementError(
            f"{key[0]}_{key[1]}: the kernel store has no definition of it ({error}); show its file "
            "instead: mstmm show MY_FILE.py, or regenerate it"
        ) from None
    return place / DEFINITION_FILE


def _replacement_note(place: Path, spec: ElementSpec) -> str:
    """Remark for messages if another definition of this name is in the store, else ""."""
    try:
        earlier = element_from_json((place / "element.json").read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return ""
    if earlier.hash() == spec.hash():
        return ""
    return f", replacing another definition of {spec.kind} {spec.name}"


#: Flags of user-defined kernels: those of the prebuilt ones, but with an exported descriptor.
_COMPILE_FLAGS = tuple(flag for flag in COMPILE_ARGS if flag != "-fvisibility=hidden")


def _library_folder(spec: ElementSpec) -> Path:
    return _element_folder((spec.kind, spec.name)) / f"{spec.hash()[:16]}-{abi.ABI_VERSION}"


def _build_order(spec: ElementSpec) -> BuildOrder:
    """Build order of an element's library from the texts in the store."""
    place = _element_folder((spec.kind, spec.name))
    identity = " ".join((spec.hash(), str(abi.ABI_VERSION), *_COMPILE_FLAGS))

    def sources(key: str) -> dict[str, str]:
        names = ("mstmm.h", f"{spec.kind}_{spec.name}.c")
        try:
            return {name: read_private(place / name).decode() for name in names}
        except (OSError, DamagedEntryError) as error:
            reason = getattr(error, "strerror", None) or error
            raise EnvironmentFailure(
                f"{place} lacks its C text ({reason}); regenerate it: mstmm generate FILE"
            ) from None

    return BuildOrder(
        f"{spec.kind}_{spec.name}", hashlib.sha256(identity.encode()).hexdigest(), sources,
        _COMPILE_FLAGS, (abi.element_symbol(spec.kind, spec.name),), "MSTMM_KERNELS",
    )  # fmt: skip


def _remove_old_libraries(place: Path, current: Path) -> None:
    for path in place.glob(f"*/{DESCRIPTION_FILE}"):
        if path.parent != current:
            remove(path.parent)


def all_specs() -> dict[Key, ElementSpec]:
    """All elements in the store; files that cannot be read are skipped."""
    specs_by_key: dict[Key, ElementSpec] = {}
    for path in sorted(folder().glob("*/element.json")):
        _check_trusted(path.parent)
        try:
            spec = _read_spec(path)
        except ElementError:
            continue
        specs_by_key[spec.kind, spec.name] = spec
    return specs_by_key


def find_spec(key: Key) -> ElementSpec | None:
    """Element of the store by kind and name, or None.  ElementError if its file is damaged."""
    path = _element_folder(key) / "element.json"
    if not path.is_file():
        return None
    _check_trusted(path.parent)
    return _read_spec(path)


def _read_spec(path: Path) -> ElementSpec:
    try:
        return element_from_json(read_private(path).decode())
    except DamagedEntryError as damage:
        raise EnvironmentFailure(f"{path}: {damage}; regenerate it: mstmm generate FILE") from None
    except (OSError, ValueError, LookupError, TypeError, AttributeError, RecursionError) as error:
        reason = f"{type(error).__name__}: {error}"
        raise ElementError(
            f"{path}: the stored element is damaged ({reason}); regenerate it: mstmm generate FILE"
        ) from error


@cache
def open_element(key: Key, content: str) -> Element:
    """Open the element of the store with the hash `content` for calls."""
    stored = find_spec(key)
    assert stored is not None and stored.hash() == content
    try:
        element = _open_compiled(stored)
    except EnvironmentFailure:  # damaged, and it cannot be rebuilt
        if stored.kind != "hinge":
            raise
        element = None
    if element is not None:
        return element
    if stored.kind == "hinge":
        return _interpreted_element(stored)
    raise EnvironmentFailure(
        f"{stored.kind} {stored.name!r} is not compiled; install a C compiler and run: "
        "mstmm generate FILE"
    )


def _open_compiled(stored: ElementSpec) -> Element | None:
    """Element from its compiled library, None if there is none.

    A library that is damaged or cannot be opened (of another machine) is rebuilt from its text.
    """
    place, order = _library_folder(stored), _build_order(stored)
    try:
        built: BuiltLibrary | None = find_library(place, order.key)
        return None if built is None else _element_from_library(stored, built.path)
    except (DamagedEntryError, EnvironmentFailure):
        remove(place)
    return _element_from_library(stored, get_or_build(place, order, time_limit()).path)


def _element_from_library(stored: ElementSpec, library: Path) -> Element:
    element_ffi = cffi.FFI()
    element_ffi.cdef(abi.cdef(registry=False))
    symbol = abi.element_symbol(stored.kind, stored.name)
    element_ffi.cdef(
        f"extern mstmm_element {symbol};"
    )  # without const: cffi cannot read it otherwise
    try:
        lib = element_ffi.dlopen(str(library))
        pointer: Any = element_ffi.addressof(lib, symbol)  # type: ignore[arg-type]
        address = int(element_ffi.cast("uintptr_t", pointer))
    except (OSError, AttributeError) as error:
        raise EnvironmentFailure(
            f"{library} cannot be opened ({error}); delete it and run: mstmm generate FILE"
        ) from error
    ffi, _ = prebuilt_kernels.module()
    element = prebuilt_kernels.read_element(ffi, ffi.cast("mstmm_element *", address))
    return replace(element, declared=stored.parameters, owner=(element_ffi, lib))


def _interpreted_element(stored: ElementSpec) -> Element:
    ffi, _ = prebuilt_kernels.module()
    kernel = next(k for k in stored.kernels if k.name == "hinge")
    slope_kernels = [k for k in stored.kernels if k.name == "hinge_slope"]
    names = {
        "q": stored.coordinates, "u": stored.speeds, "p": stored.parameters,
    }  # fmt: skip
    arrays: dict[str, Any] = {"nq": len(names["q"]), "nu": len(names["u"]), "np": len(names["p"])}
    kept_objects: list[Any] = []
    for letter, group in names.items():
        for list_name, texts in (
            ("names", [p.name for p in group]),
            ("units", [p.unit for p in group]),
        ):
            strings = [ffi.new("char[]", t.encode()) for t in texts]
            array = ffi.new("const char *[]", strings or [ffi.NULL])
            kept_objects += [strings, array]
            arrays[f"{letter}_{list_name}"] = array
    descriptor = ffi.new("mstmm_element *", arrays)
    return Element(
        stored.kind,
        stored.name,
        arrays["nq"],
        arrays["nu"],
        tuple(p.name for p in stored.parameters),
        {},
        {},
        descriptor,
        tape=compile_tape(kernel),
        slope_tape=compile_tape(slope_kernels[0]) if slope_kernels else None,
        declared=stored.parameters,
        owner=kept_objects,
    )


def required_types(scene: Scene) -> list[Key]:
    """Types of a scene that are not built in, sorted."""
    elements = prebuilt_kernels.elements()
    return sorted(
        key
        for key in used_types(scene)
        if key not in elements and not (key[0] == "hinge" and key[1] in builtin_hinges())
    )


def load_known(keys: Iterable[Key]) -> tuple[dict[Key, Element], dict[Key, ElementSpec]]:
    """Load those elements and definitions of these types that are in the store."""
    elements: dict[Key, Element] = {}
    definitions: dict[Key, ElementSpec] = {}
    for key in keys:
        stored = find_spec(key)
        if stored is not None:
            definitions[key] = stored = match_builtin(stored)
            if stored.facts is None or stored.facts.runs_as == stored.name:
                elements[key] = open_element(key, stored.hash())
    return elements, definitions


def match_builtin(stored: ElementSpec) -> ElementSpec:
    """Element that runs as a built-in hinge if it has the same kernel, else the element itself.

    Built-in hinges are compiled, and the sweep has specialised code for them.
    """
    own_facts = stored.facts
    if own_facts is None:
        return stored
    for name, builtin_facts in builtin_hinges().items():
        if builtin_facts.runs_as != name or (own_facts.varies, own_facts.straight) != (
            builtin_facts.varies,
            builtin_facts.straight,
        ):
            continue
        text = files("mstmm.generated").joinpath(f"hinge_{name}.json").read_text(encoding="utf-8")
        own_kernel = next(kernel for kernel in stored.kernels if kernel.name == "hinge")
        if is_same_motion(own_kernel, kernel_from_json(text, "hinge")):
            return replace(stored, facts=replace(own_facts, runs_as=name))
    return stored
