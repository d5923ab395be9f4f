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

from mstmm.border import elements as abi
from mstmm.errors import ElementError, EnvironmentFailure
from mstmm.ir.facts import builtin_hinges, same_motion
from mstmm.ir.spec import ElementSpec
from mstmm.ir.stored import element_from_json, element_to_json, kernel_from_json
from mstmm.ir.tape import compile_tape
from mstmm.scene import Scene
from mstmm.scene.checks.types import types

from ..host.files import write_text
from ..libraries.build import Built, Order, fetched, found, remove
from ..libraries.build_extension import COMPILE_ARGS
from ..libraries.entry import ABOUT, Damaged, read_private
from ..libraries.folder import objection, parent_objection
from ..libraries.toolchain import time_limit
from . import prebuilt
from .prebuilt import Element

Key = tuple[str, str]

_ROOT = (0,)  # user who may own a store that all can read
#: File name of a stored definition; reading a scene never executes it.
DEFINITION = "definition.py"
_WHAT = "kernel store"
_WAY_OUT = "set MSTMM_KERNELS to a folder that you own"


def folder() -> Path:
    """Folder of the store: $MSTMM_KERNELS, or the user's data folder."""
    named = os.environ.get("MSTMM_KERNELS")
    if named:
        return Path(named)
    import platformdirs

    return Path(platformdirs.user_data_path("mstmm")) / "kernels"


def _place(key: Key) -> Path:
    return folder() / f"{key[0]}_{key[1]}"


def _trusted(place: Path) -> None:
    """Raise EnvironmentFailure if other users could have written to a folder of the store.

    Its files become equations and code of this process.
    """
    with suppress(OSError):  # the folder does not exist: nothing to check
        for each in (folder(), place):
            problem = objection(each, os.stat(each), _WHAT, _WAY_OUT, _ROOT)
            problem = problem or parent_objection(each, _WHAT, _WAY_OUT)
            if problem:
                raise EnvironmentFailure(problem)


def keep(spec: ElementSpec, files: dict[str, str]) -> tuple[Path, str]:
    """Write a generated element (`files`: name -> C text) into the store and compile it.

    Returns its folder and a phrase that says whether it is compiled or interpreted.  Raises
    EnvironmentFailure if the folder cannot be written, or if a body or force element cannot be
    compiled.
    """
    place = _place((spec.kind, spec.name))
    _trusted(place)
    replaced = _replaces(place, spec)
    try:
        folder().parent.mkdir(parents=True, exist_ok=True)
        for made in (folder(), place):
            made.mkdir(mode=0o700, exist_ok=True)
        for name, text in {**files, "element.json": element_to_json(spec)}.items():
            write_text(place / name, text)
            (place / name).chmod(0o600)
    except (OSError, EnvironmentFailure) as error:
        said = error.strerror if isinstance(error, OSError) else error
        raise EnvironmentFailure(
            f"the kernel store {folder()} cannot be written ({said}); {_WAY_OUT}"
        ) from error
    opened.cache_clear()
    try:
        fetched(_library_place(spec), _order(spec), time_limit())
        _remove_old(place, _library_place(spec))
        return place, f"compiled{replaced}"
    except EnvironmentFailure as error:
        if spec.kind != "hinge":
            raise
        return place, f"interpreted, several times slower than compiled: {error}{replaced}"


def definition(key: Key) -> Path:
    """File from which an element of the store was generated.

    ElementError if there is none or other users could have written it.
    """
    place = _place(key)
    _trusted(place)
    try:
        read_private(place / DEFINITION)
    except (OSError, Damaged) as error:
        raise ElementError(
            f"{key[0]}_{key[1]}: the kernel store has no definition of it ({error}); show its file "
            "instead: mstmm show MY_FILE.py, or regenerate it"
        ) from None
    return place / DEFINITION


def _replaces(place: Path, spec: ElementSpec) -> str:
    """Remark for messages if another definition of this name is in the store, else ""."""
    try:
        earlier = element_from_json((place / "element.json").read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return ""
    if earlier.hash() == spec.hash():
        return ""
    return f", replacing another definition of {spec.kind} {spec.name}"


#: Flags of user-defined kernels: those of the prebuilt ones, but with an exported descriptor.
_FLAGS = tuple(flag for flag in COMPILE_ARGS if flag != "-fvisibility=hidden")


def _library_place(spec: ElementSpec) -> Path:
    return _place((spec.kind, spec.name)) / f"{spec.hash()[:16]}-{abi.ABI}"


def _order(spec: ElementSpec) -> Order:
    """Build order of an element's library from the texts in the store."""
    place = _place((spec.kind, spec.name))
    decides = " ".join((spec.hash(), str(abi.ABI), *_FLAGS))

    def sources(key: str) -> dict[str, str]:
        names = ("mstmm.h", f"{spec.kind}_{spec.name}.c")
        try:
            return {name: read_private(place / name).decode() for name in names}
        except (OSError, Damaged) as error:
            why = getattr(error, "strerror", None) or error
            raise EnvironmentFailure(
                f"{place} lacks its C text ({why}); regenerate it: mstmm generate FILE"
            ) from None

    return Order(
        f"{spec.kind}_{spec.name}", hashlib.sha256(decides.encode()).hexdigest(), sources,
        _FLAGS, (abi.element_symbol(spec.kind, spec.name),), "MSTMM_KERNELS",
    )  # fmt: skip


def _remove_old(place: Path, current: Path) -> None:
    for path in place.glob(f"*/{ABOUT}"):
        if path.parent != current:
            remove(path.parent)


def specs() -> dict[Key, ElementSpec]:
    """All elements in the store; files that cannot be read are skipped."""
    found: dict[Key, ElementSpec] = {}
    for path in sorted(folder().glob("*/element.json")):
        _trusted(path.parent)
        try:
            spec = _read(path)
        except ElementError:
            continue
        found[spec.kind, spec.name] = spec
    return found


def spec(key: Key) -> ElementSpec | None:
    """Element of the store by kind and name, or None.  ElementError if its file is damaged."""
    path = _place(key) / "element.json"
    if not path.is_file():
        return None
    _trusted(path.parent)
    return _read(path)


def _read(path: Path) -> ElementSpec:
    try:
        return element_from_json(read_private(path).decode())
    except Damaged as damage:
        raise EnvironmentFailure(f"{path}: {damage}; regenerate it: mstmm generate FILE") from None
    except (OSError, ValueError, LookupError, TypeError, AttributeError, RecursionError) as error:
        said = f"{type(error).__name__}: {error}"
        raise ElementError(
            f"{path}: the stored element is damaged ({said}); regenerate it: mstmm generate FILE"
        ) from error


@cache
def opened(key: Key, content: str) -> Element:
    """Open the element of the store with the hash `content` for calls."""
    stored = spec(key)
    assert stored is not None and stored.hash() == content
    try:
        element = _compiled(stored)
    except EnvironmentFailure:  # damaged, and it cannot be rebuilt
        if stored.kind != "hinge":
            raise
        element = None
    if element is not None:
        return element
    if stored.kind == "hinge":
        return _interpreted(stored)
    raise EnvironmentFailure(
        f"{stored.kind} {stored.name!r} is not compiled; install a C compiler and run: "
        "mstmm generate FILE"
    )


def _compiled(stored: ElementSpec) -> Element | None:
    """Element from its compiled library, None if there is none.

    A library that is damaged or cannot be opened (of another machine) is rebuilt from its text.
    """
    place, order = _library_place(stored), _order(stored)
    try:
        built: Built | None = found(place, order.key)
        return None if built is None else _from_library(stored, built.path)
    except (Damaged, EnvironmentFailure):
        remove(place)
    return _from_library(stored, fetched(place, order, time_limit()).path)


def _from_library(stored: ElementSpec, library: Path) -> Element:
    separate = cffi.FFI()
    separate.cdef(abi.cdef(registry=False))
    symbol = abi.element_symbol(stored.kind, stored.name)
    separate.cdef(f"extern mstmm_element {symbol};")  # without const: cffi cannot read it otherwise
    try:
        lib = separate.dlopen(str(library))
        pointer: Any = separate.addressof(lib, symbol)  # type: ignore[arg-type]
        address = int(separate.cast("uintptr_t", pointer))
    except (OSError, AttributeError) as error:
        raise EnvironmentFailure(
            f"{library} cannot be opened ({error}); delete it and run: mstmm generate FILE"
        ) from error
    ffi, _ = prebuilt.module()
    element = prebuilt.describe(ffi, ffi.cast("mstmm_element *", address))
    return replace(element, declared=stored.parameters, owner=(separate, lib))


def _interpreted(stored: ElementSpec) -> Element:
    ffi, _ = prebuilt.module()
    kernel = next(k for k in stored.kernels if k.name == "hinge")
    slope = [k for k in stored.kernels if k.name == "hinge_slope"]
    names = {
        "q": stored.coordinates, "u": stored.speeds, "p": stored.parameters,
    }  # fmt: skip
    arrays: dict[str, Any] = {"nq": len(names["q"]), "nu": len(names["u"]), "np": len(names["p"])}
    kept: list[Any] = []
    for letter, group in names.items():
        for what, texts in (
            ("names", [p.name for p in group]),
            ("units", [p.unit for p in group]),
        ):
            strings = [ffi.new("char[]", t.encode()) for t in texts]
            array = ffi.new("const char *[]", strings or [ffi.NULL])
            kept += [strings, array]
            arrays[f"{letter}_{what}"] = array
    descriptor = ffi.new("mstmm_element *", arrays)
    return Element(
        stored.kind, stored.name, arrays["nq"], arrays["nu"],
        tuple(p.name for p in stored.parameters), {}, {}, descriptor,
        tape=compile_tape(kernel), slope_tape=compile_tape(slope[0]) if slope else None,
        declared=stored.parameters, owner=kept,
    )  # fmt: skip


def needed(scene: Scene) -> list[Key]:
    """Types of a scene that are not built in, sorted."""
    elements = prebuilt.elements()
    return sorted(
        key
        for key in types(scene)
        if key not in elements and not (key[0] == "hinge" and key[1] in builtin_hinges())
    )


def known(keys: Iterable[Key]) -> tuple[dict[Key, Element], dict[Key, ElementSpec]]:
    """Load those elements and definitions of these types that are in the store."""
    elements: dict[Key, Element] = {}
    definitions: dict[Key, ElementSpec] = {}
    for key in keys:
        stored = spec(key)
        if stored is not None:
            definitions[key] = stored = recognised(stored)
            if stored.facts is None or stored.facts.runs_as == stored.name:
                elements[key] = opened(key, stored.hash())
    return elements, definitions


def recognised(stored: ElementSpec) -> ElementSpec:
    """Element that runs as a built-in hinge if it has the same kernel, else the element itself.

    Built-in hinges are compiled, and the sweep has specialised code for them.
    """
    mine = stored.facts
    if mine is None:
        return stored
    for name, built in builtin_hinges().items():
        if built.runs_as != name or (mine.varies, mine.straight) != (built.varies, built.straight):
            continue
        text = files("mstmm.generated").joinpath(f"hinge_{name}.json").read_text(encoding="utf-8")
        own = next(kernel for kernel in stored.kernels if kernel.name == "hinge")
        if same_motion(own, kernel_from_json(text, "hinge")):
            return replace(stored, facts=replace(mine, runs_as=name))
    return stored
