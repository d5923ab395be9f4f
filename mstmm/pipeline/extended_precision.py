"""Accelerations of a small scene in extended precision, to measure rounding of doubles."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from hashlib import sha256
from typing import Any

import mpmath

from ..abi.scalar_types import COMPILER_FLAGS, EXTRA_FLAGS, SCALARS, SYMBOL
from ..array_validation import Array
from ..derive.codegen.scalar_library import library_source
from ..derive.fuse.scene_kernels import fuse
from ..derive.verification.kernel_evaluation import evaluate
from ..ir import KernelIR
from ..ir.element_spec import ElementSpec
from ..ir.scene_structure import Key, Structure
from ..runtime.engine.compiled_scene import CompiledScene
from ..runtime.kernels import kernel_store
from ..runtime.kernels.scalar_kernel import ScalarKernel
from ..runtime.libraries.cache import Recipe, open_cached_library
from ..runtime.packing.fused_structure import structure_of
from .fused_code import kernel_lookup

# --- kernels --------------------------------------------------------------------------------------
# The source text comes from derive, the library from the cache.


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


# --- accelerations --------------------------------------------------------------------------------

#: Digits of the evaluation; a Riccati sweep loses as many digits as the mass ratio has.
DIGITS = 60


def extended_precision_accelerations(
    model: CompiledScene, t: float = 0.0
) -> Callable[[Array, Array], list[Any]]:
    """Function (q (nq,), u (nu,)) -> udot (nu,) with DIGITS digits, at the time t (s).

    It interprets the Riccati sweep as one kernel.  The numbers of the scene are the doubles that
    the engines use.
    """
    elements, definitions = kernel_store.load_known(kernel_store.required_types(model.scene))
    structure, numbers = structure_of(model.packed_scene.system, elements, False)
    kernel = _fused_kernel(structure, definitions)
    constant_inputs = {"memory": [0.0] * structure.n_memory, "efforts": [0.0] * structure.nu}
    fixed_inputs = {"p": _floats(numbers), "t": [t], **constant_inputs}

    def accelerations(q: Array, u: Array) -> list[Any]:
        outputs = evaluate(kernel, fixed_inputs | {"q": _floats(q), "u": _floats(u)}, DIGITS)
        return list(outputs["udot"])

    return accelerations


#: Kernel of the last structure: subsequent calls mostly have other numbers of the same scene.
_last_kernel: dict[str, KernelIR] = {}


def _fused_kernel(structure: Structure, definitions: Mapping[Key, ElementSpec]) -> KernelIR:
    key = structure.identity()
    if key not in _last_kernel:
        _last_kernel.clear()
        _last_kernel[key] = fuse(structure, kernel_lookup(definitions)).kernels["accelerations"]
    return _last_kernel[key]


def relative_error(found: Array, exact: Sequence[Any]) -> float:
    """Largest difference divided by the largest entry of `exact`, which must not be zero."""
    with mpmath.workdps(DIGITS):
        differences = [abs(mpmath.mpf(float(a)) - b) for a, b in zip(found, exact, strict=True)]
        return float(max(differences) / max(map(abs, exact)))


def _floats(numbers: Array) -> list[float]:
    return [float(x) for x in numbers]
