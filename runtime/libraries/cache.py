"""The cache of compiled libraries: one entry per content, shared by all processes of a user.

The key is a hash of everything that decides the machine code: what the text is made from, the
flags, the compiler (its file, not its answer: no process runs on a hit), the processor, the
platform, mstmm.  So nothing in here is ever out of date; what is not asked for any more is removed
when the cache grows beyond its limit.
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
from mstmm.border.elements import ABI
from mstmm.errors import EnvironmentFailure

from . import processor, toolchain
from .build import Built, Order, fetched, found, remove
from .entry import FORMAT, Damaged
from .folder import VARIABLE, limit, private_folder

__all__ = ["Built", "Recipe", "find", "library", "opened"]

T = TypeVar("T")


@dataclass(frozen=True)
class Recipe:
    """What a library is made of.

    Args:
        name: readable stem of its files, such as "fused".
        identity: everything that decides the text, known without printing it: hashes of the
            structure, of the generator and the kernels, the ABI of the descriptor, scalar type,
            lanes.
        sources: makes the text, file name -> content, for a key that the text may carry; runs
            only when a library is built.  Files that end in .c are compiled, others lie beside.
        flags: of the compiler, besides -fPIC and -shared.
        optional: those of the flags that make code faster and may be left out where the compiler
            does not know them.
        symbols: names that the library must export.  If it exports `int mstmm_self_test(void)` as
            well, that is called once after the build, in a process of its own: 0 if all is right.
    """

    name: str
    identity: Mapping[str, str]
    sources: Callable[[str], Mapping[str, str]]
    flags: tuple[str, ...]
    symbols: tuple[str, ...] = ("mstmm_fused_library",)
    optional: tuple[str, ...] = ()


def find(recipe: Recipe) -> Built | None:
    """The library if it is in the cache and whole; nothing is compiled.  Never raises."""
    try:
        place, order = _placed(recipe)
        return found(place, order.key)
    except (EnvironmentFailure, Damaged):
        return None


def library(recipe: Recipe, *, timeout: float | None = None) -> Built:
    """The library of a recipe, from the cache or built now.

    `timeout` limits the compiler, s (300 by default, $MSTMM_COMPILE_TIMEOUT overrides the default).
    Raises EnvironmentFailure, one line with a way out: no compiler; one that fails, hangs or is
    killed; a cache folder that cannot be written, is not ours, or is full;
    a $MSTMM_CACHE_SIZE that is no size.
    """
    limit()  # a wrong one is told before a compiler runs
    place, order = _placed(recipe)
    built = fetched(place, order, toolchain.time_limit() if timeout is None else timeout)
    if built.how == "compiled":
        from .upkeep import tidy

        tidy(place.parent, keep=place)
    return built


def opened(
    recipe: Recipe,
    opener: Callable[[Path, str], T],
    *,
    known: Built | None = None,
    timeout: float | None = None,
) -> tuple[T, Built]:
    """`opener(path, key)` of the recipe's library; one that it refuses is built again, once.

    `known` is what `find` has just found of it, which is not looked for again.

    The opener raises OSError (it cannot be loaded) or EnvironmentFailure (its ABI number or key
    are not the expected ones) after closing what it opened.  Raises EnvironmentFailure if the
    library built afresh is refused too.
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


def _placed(recipe: Recipe) -> tuple[Path, Order]:
    """Where the library of a recipe lies, and how it is made."""
    about = {
        "identity": dict(sorted(recipe.identity.items())),
        "flags": list(recipe.flags),
        "optional": list(recipe.optional),
        "compiler": toolchain.compiler().identity(),
        "processor": processor.features(),
        "platform": f"{sys.platform} {os.uname().machine} {sys.byteorder} {sys.maxsize}",
        "mstmm": version.__version__,
        "abi": f"{FORMAT} {ABI}",
    }
    key = hashlib.sha256(json.dumps([recipe.name, about], sort_keys=True).encode()).hexdigest()
    order = Order(
        recipe.name, key, recipe.sources, recipe.flags, recipe.symbols, VARIABLE, about,
        recipe.optional,
    )  # fmt: skip
    return private_folder() / f"{recipe.name}-{key[:32]}", order
