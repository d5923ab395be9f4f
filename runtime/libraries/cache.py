"""Cache of compiled libraries: one entry per content, shared by all processes of a user.

The key is a hash of everything that decides the machine code: the sources of the text, the flags,
the compiler (its file, not its version output: a hit runs no process), the processor, the platform,
mstmm.  No entry can therefore be out of date.  When the cache exceeds its limit, the least recently
used entries are removed.
"""

from __future__ import annotations

import hashlib
import json
import os
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from mstmm import version
from mstmm.abi.element_library import ABI_VERSION
from mstmm.errors import EnvironmentFailure

from . import cpu_features, toolchain
from .cache_entry import FORMAT, DamagedEntryError
from .cache_folder import VARIABLE, private_folder, size_limit
from .library_build import BuildOrder, BuiltLibrary, find_library, get_or_build, remove

__all__ = ["BuiltLibrary", "Recipe", "find", "library", "open_cached_library"]

T = TypeVar("T")


@dataclass(frozen=True)
class Recipe:
    """Recipe of a compiled library.

    Args:
        name: readable stem of its files, such as "fused".
        identity: everything that decides the text, available without generating it: hashes of the
            structure, of the generator and the kernels, the ABI of the descriptor, scalar type,
            lanes.
        sources: generates the text, file name -> content, for a key that the text may contain;
            runs only when a library is built.  Files that end in .c are compiled, others are only
            written to the same folder.
        flags: of the compiler, in addition to -fPIC and -shared.
        optional: flags that make code faster and are omitted if the compiler does not support
            them.
        symbols: names that the library must export.  If it also exports
            `int mstmm_self_test(void)`, that is called once after the build, in a separate
            process; 0 is success.
    """

    name: str
    identity: Mapping[str, str]
    sources: Callable[[str], Mapping[str, str]]
    flags: tuple[str, ...]
    symbols: tuple[str, ...] = ("mstmm_fused_library",)
    optional: tuple[str, ...] = ()


def find(recipe: Recipe) -> BuiltLibrary | None:
    """Find a valid library in the cache without compiling, else None.  Never raises."""
    try:
        place, order = _place_and_order(recipe)
        return find_library(place, order.key)
    except (EnvironmentFailure, DamagedEntryError):
        return None


def library(recipe: Recipe, *, timeout: float | None = None) -> BuiltLibrary:
    """Library of a recipe, from the cache or newly built.

    `timeout` limits the compiler, s (300 by default, $MSTMM_COMPILE_TIMEOUT overrides the default).
    Raises EnvironmentFailure, one line with a remedy: no compiler; one that fails, hangs or is
    killed; a cache folder that cannot be written, belongs to another user, or is full;
    an invalid $MSTMM_CACHE_SIZE.
    """
    size_limit()  # report an invalid limit before a compiler runs
    place, order = _place_and_order(recipe)
    built = get_or_build(place, order, toolchain.time_limit() if timeout is None else timeout)
    if built.how == "compiled":
        from .cache_maintenance import limit_cache

        limit_cache(place.parent, keep=place)
    return built


def open_cached_library(
    recipe: Recipe,
    opener: Callable[[Path, str], T],
    *,
    known: BuiltLibrary | None = None,
    timeout: float | None = None,
) -> tuple[T, BuiltLibrary]:
    """Open the library of a recipe with `opener(path, key)`; rebuild it once if that fails.

    `known` is the result of a preceding `find`, which saves a second search.

    The opener raises OSError (it cannot be loaded) or EnvironmentFailure (unexpected ABI number or
    key) after closing the library.  Raises EnvironmentFailure if the rebuilt library fails too.
    """
    built = library(recipe, timeout=timeout) if known is None else known
    try:
        return opener(built.path, built.key), built
    except (OSError, EnvironmentFailure) as error:
        if built.how == "compiled":
            raise EnvironmentFailure(f"{built.path} cannot be used: {error}") from error
    remove(built.path.parent)
    built = library(recipe, timeout=timeout)
    try:
        return opener(built.path, built.key), built
    except OSError as error:
        raise EnvironmentFailure(f"{built.path} cannot be opened: {error}") from error


def _place_and_order(recipe: Recipe) -> tuple[Path, BuildOrder]:
    """Place of the library of a recipe in the cache, and its build order."""
    description = {
        "identity": dict(sorted(recipe.identity.items())),
        "flags": list(recipe.flags),
        "optional": list(recipe.optional),
        "compiler": toolchain.find_compiler().identity(),
        "processor": cpu_features.features(),
        "platform": f"{sys.platform} {os.uname().machine} {sys.byteorder} {sys.maxsize}",
        "mstmm": version.__version__,
        "abi": f"{FORMAT} {ABI_VERSION}",
    }
    key = hashlib.sha256(
        json.dumps([recipe.name, description], sort_keys=True).encode()
    ).hexdigest()
    order = BuildOrder(
        recipe.name, key, recipe.sources, recipe.flags, recipe.symbols, VARIABLE, description,
        recipe.optional,
    )  # fmt: skip
    return private_folder() / f"{recipe.name}-{key[:32]}", order
