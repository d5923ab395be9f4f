"""Accelerations of any small scene at 60 digits: its Riccati sweep as one kernel, replayed."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
from numpy.typing import NDArray

import mstmm
from mstmm.bridge.fusion import Fusion
from mstmm.derive.audit.evaluate import evaluate

Array = NDArray[np.float64]
DIGITS = 60


def precise_accelerations(scene: dict[str, Any], q: Array, u: Array, t: float = 0.0) -> list[Any]:
    """udot (nu,) as numbers of 60 digits; the scene's own numbers are the doubles they are packed
    to."""
    model = mstmm.compile(mstmm.Scene(**scene))
    fusion = model.fusion
    assert isinstance(fusion, Fusion) and not fusion.obstacle
    kernel = fusion.fused(fusion.structure).kernels["accelerations"]
    given: dict[str, Any] = {
        "p": fusion.numbers, "t": [t], "q": q, "u": u,
        "memory": np.zeros(model.packed.system.n_memory), "efforts": np.zeros(model.nu),
    }  # fmt: skip
    numbers = {name: [float(x) for x in values] for name, values in given.items()}
    return list(evaluate(kernel, numbers, DIGITS)["udot"])


def error(found: Array, precise: list[Any]) -> float:
    """Largest difference over the largest acceleration."""
    with mpmath.workdps(DIGITS):
        gaps = [abs(mpmath.mpf(float(a)) - b) for a, b in zip(found, precise, strict=True)]
        return float(max(gaps) / max(map(abs, precise)))
