"""Compilation of one KernelIR into a function in float, double or quadruple precision.

The source text comes from derive, the library from the cache.
"""

from __future__ import annotations

from hashlib import sha256

from ..abi.scalar_types import COMPILER_FLAGS, EXTRA_FLAGS, SCALARS, SYMBOL
from ..derive.codegen.scalar_library import library_source
from ..ir import KernelIR
from ..runtime.kernels.scalar_kernel import ScalarKernel
from ..runtime.libraries.cache import Recipe, open_cached_library


def compile_kernel(kernel: KernelIR, scalar: str = "double") -> ScalarKernel:
    """Compile a kernel without loops in "float", "double" or "quadruple" precision.

    Quadruple is IEEE binary128.  Raises ValueError for another scalar type or a kernel of run-time
    size, EnvironmentFailure if there is no compiler or it does not support the type.
    """
    if scalar not in SCALARS:
        raise ValueError(f"scalar type {scalar!r}: expected one of {', '.join(SCALARS)}")
    text = library_source(kernel, scalar)
    identity = {"text": sha256(text.encode()).hexdigest(), "scalar": scalar}
    flags = (*COMPILER_FLAGS, *EXTRA_FLAGS.get(scalar, ()))
    recipe = Recipe("kernel", identity, lambda key: {"kernel.c": text}, flags, (SYMBOL,))
    return open_cached_library(recipe, lambda path, key: ScalarKernel(kernel, scalar, path))[0]
