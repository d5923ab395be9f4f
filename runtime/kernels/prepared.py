"""Calls of C at the least cost: what stays the same is handed over once, rows at each call.

The module that makes them lies in the library of the compiled kernels, beside the one that cffi
writes; its text is runtime/engine/states/c/prepared.c.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from importlib import import_module
from importlib.machinery import ExtensionFileLoader
from importlib.util import module_from_spec, spec_from_loader
from typing import Any, Protocol

from . import prebuilt

_NAME = "mstmm.generated._prepared"


class Call(Protocol):
    """Rows of doubles in, a number (a float) before them where the call has one; a new array out,
    or several.  None where what is given is anything else, or where C gives up: then the general
    way serves, or says what is wrong."""

    def __call__(self, *given: Any) -> Any: ...


def nothing(*given: Any) -> None:
    """The call that always leaves it to the general way."""
    return


def prepared(
    function: str,
    record: Any,
    widths: Sequence[int],
    *shapes: Sequence[int],
    numbered: bool = False,
    optional: bool = False,
    released: bool = False,
    kept: object = None,
) -> Call:
    """A call of a function of C, by its name, on a record.

    `widths` are those of the rows, `shapes` those of the answers.  A number comes first where it is
    `numbered`; where it is `optional` the last row may be None.  Other threads run meanwhile where
    it is `released`: then each needs a record of its own; otherwise one serves all.  `kept` is what
    the record points to.
    """
    ffi, lib = prebuilt.module()

    def address(pointer: Any) -> int:
        return int(ffi.cast("intptr_t", pointer))

    found: Call = _module().prepare(
        address(ffi.addressof(lib, function)), address(record), tuple(widths),
        tuple(map(tuple, shapes)), numbered, optional, released, (record, kept),
    )  # fmt: skip
    return found


@cache
def _module() -> Any:
    prebuilt.module()
    path = str(import_module("mstmm.generated._kernels").__file__)
    spec = spec_from_loader(_NAME, ExtensionFileLoader(_NAME, path))
    assert spec is not None and spec.loader is not None
    found = module_from_spec(spec)
    spec.loader.exec_module(found)
    return found
