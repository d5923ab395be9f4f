"""Accelerations of a small scene in extended precision, to measure rounding of doubles."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import mpmath

from ..arrays import Array
from ..derive.audit.evaluate import evaluate
from ..derive.fuse.scene import fuse
from ..ir import KernelIR
from ..ir.spec import ElementSpec
from ..ir.structure import Key, Structure
from ..runtime.engine.compiled import Compiled
from ..runtime.kernels import store
from ..runtime.pack.structure import structure_of
from .fusion import kernels_of

#: Digits of the evaluation; a Riccati sweep loses as many digits as the mass ratio has.
DIGITS = 60


def precise(model: Compiled, t: float = 0.0) -> Callable[[Array, Array], list[Any]]:
    """Function (q (nq,), u (nu,)) -> udot (nu,) with DIGITS digits, at the time t (s).

    It interprets the Riccati sweep as one kernel.  The numbers of the scene are the doubles that
    the engines use.
    """
    elements, definitions = store.known(store.needed(model.scene))
    structure, numbers = structure_of(model.packed.system, elements, False)
    kernel = _fused(structure, definitions)
    still = {"memory": [0.0] * structure.n_memory, "efforts": [0.0] * structure.nu}
    given = {"p": _floats(numbers), "t": [t], **still}

    def accelerations(q: Array, u: Array) -> list[Any]:
        found = evaluate(kernel, given | {"q": _floats(q), "u": _floats(u)}, DIGITS)
        return list(found["udot"])

    return accelerations


#: Kernel of the last structure: subsequent calls mostly have other numbers of the same scene.
_last: dict[str, KernelIR] = {}


def _fused(structure: Structure, definitions: Mapping[Key, ElementSpec]) -> KernelIR:
    key = structure.identity()
    if key not in _last:
        _last.clear()
        _last[key] = fuse(structure, kernels_of(definitions)).kernels["accelerations"]
    return _last[key]


def relative_error(found: Array, exact: Sequence[Any]) -> float:
    """Largest difference divided by the largest entry of `exact`, which must not be zero."""
    with mpmath.workdps(DIGITS):
        gaps = [abs(mpmath.mpf(float(a)) - b) for a, b in zip(found, exact, strict=True)]
        return float(max(gaps) / max(map(abs, exact)))


def _floats(numbers: Array) -> list[float]:
    return [float(x) for x in numbers]
