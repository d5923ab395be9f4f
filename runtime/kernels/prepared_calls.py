"""Prepared calls of C with the lowest overhead: only rows of numbers are passed at each call.

Their extension module is in the library of the compiled kernels, next to the module written by
cffi; its text is runtime/engine/state_evaluation/c/prepared_calls.c.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from importlib import import_module
from importlib.machinery import ExtensionFileLoader
from importlib.util import module_from_spec, spec_from_loader
from typing import Any, Protocol

from . import prebuilt_kernels

_NAME = "mstmm.generated._prepared"


class PreparedCall(Protocol):
    """Prepared call: rows of doubles in, one or several new arrays out.

    A call that is `numbered` has a float before the rows.  Returns None for any other arguments and
    for a failure in C: the caller then uses the general call, which reports what is wrong.
    """

    def __call__(self, *given: Any) -> Any: ...


def unavailable_call(*given: Any) -> None:
    """Return None, so that the caller uses the general call."""
    return


def prepare_call(
    function: str,
    record: Any,
    widths: Sequence[int],
    *shapes: Sequence[int],
    numbered: bool = False,
    optional: bool = False,
    released: bool = False,
    kept: object = None,
) -> PreparedCall:
    """Prepare a call of the C function of that name on a record.

    `widths` are the widths of the rows, `shapes` the shapes of the results.  With `numbered` a
    number precedes the rows; with `optional` the last row may be None.  With `released` other
    threads run during the call, and each thread needs its own record; otherwise one record serves
    all.  `kept` is the memory to which the record points.
    """
    ffi, lib = prebuilt_kernels.module()

    def address(pointer: Any) -> int:
        return int(ffi.cast("intptr_t", pointer))

    call: PreparedCall = _module().prepare(
        address(ffi.addressof(lib, function)), address(record), tuple(widths),
        tuple(map(tuple, shapes)), numbered, optional, released, (record, kept),
    )  # fmt: skip
    return call


@cache
def _module() -> Any:
    prebuilt_kernels.module()
    path = str(import_module("mstmm.generated._kernels").__file__)
    spec = spec_from_loader(_NAME, ExtensionFileLoader(_NAME, path))
    assert spec is not None and spec.loader is not None
    prepared_module = module_from_spec(spec)
    spec.loader.exec_module(prepared_module)
    return prepared_module
