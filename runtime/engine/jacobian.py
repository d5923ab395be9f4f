"""Jacobian of the equations of motion, for implicit integrators: exact, else by differences.

Exact is the fused kernel differentiated (`mstmm.ir.tangent`), run on the tape that is always there.
Scenes without that kernel (releases change its form) or with so many bodies that writing it takes
longer than it saves, and states in which a derivative does not exist, get central differences with
increments that never grow: nothing can be learnt from larger ones along a coordinate that the
equations do not contain.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from mstmm.arrays import Array
from mstmm.errors import ElementError, EnvironmentFailure
from mstmm.ir.tangent import PREFIX, tangent

from ..kernels.tape import TapeKernel
from ..pack.structure import structure_of
from .live import LiveInputs

if TYPE_CHECKING:
    from .compiled import Compiled

Rates = Callable[[float, Array], Array]

#: Numbers p of compiled code at a time (s) with the memory of a run.
Numbers = Callable[[float, Array], Array]

#: More bodies than this are differenced: writing the tangent kernel would take many seconds.
MOST_BODIES = 64

#: Increment of a difference, in rad, m and their rates or as part of a larger number.
_INCREMENT = 1e-6


class Jacobian:
    """d(dy/dt)/dy of a model's state y = (q, u) and, `with_work`, the work behind them.

    `rates(t, y)` are the equations themselves, nan where they cannot be evaluated; `memory` (m,) is
    read anew every time.  `exact` says which kind it is.
    """

    def __init__(self, model: Compiled, with_work: bool, memory: Array, rates: Rates) -> None:
        self._rates, self._memory, self._nq = rates, memory, model.nq
        self._outputs = ["qdot", "udot", *(["power"] if with_work else [])]
        self._tape, self._numbers = _tape(model, self._outputs)
        #: Held inputs and states of controllers follow what the kernel reads.
        self._n_memory = model.packed.system.held.first

    @property
    def exact(self) -> bool:
        """Whether the equations are differentiated; else they are differenced."""
        return self._tape is not None

    def __call__(self, t: float, y: Array) -> Array:
        """(n, n); columns along which the equations cannot be evaluated are zero."""
        if self._tape is not None:
            found = self._differentiated(self._tape, t, y)
            if np.isfinite(found).all():
                return found
        found = self._differenced(t, y)
        return np.where(np.isfinite(found), found, 0.0)

    def _differentiated(self, tape: TapeKernel, t: float, y: Array) -> Array:
        n, nq, nu = len(y), self._nq, len(y) - self._nq - (len(self._outputs) == 3)
        found = np.zeros((n, n))
        units = np.eye(nq + nu)
        given = {
            "p": self._numbers(t, self._memory), "t": np.array([t]), "q": y[:nq],
            "u": y[nq : nq + nu], "memory": self._memory[: self._n_memory],
        }  # fmt: skip
        for j, unit in enumerate(units):
            directions = {PREFIX + "q": unit[:nq], PREFIX + "u": unit[nq:]}
            _, outputs = tape.run({**given, **directions})
            given = {}  # the state stays
            column = np.concatenate(
                [outputs[PREFIX + name][:length]
                 for name, length in zip(self._outputs, (nq, nu, 1), strict=False)
                 if PREFIX + name in outputs]
            )  # fmt: skip
            found[: len(column), j] = column
        return found

    def _differenced(self, t: float, y: Array) -> Array:
        sizes = _INCREMENT * np.maximum(1.0, np.abs(y))
        columns = [
            (self._rates(t, y + step) - self._rates(t, y - step)) / (2 * size)
            for step, size in zip(np.diag(sizes), sizes, strict=True)
        ]
        return np.array(columns).T


def _tape(model: Compiled, outputs: list[str]) -> tuple[TapeKernel | None, Numbers]:
    """The tangent of the equations with respect to q and u, None where there is none; and the
    numbers that it reads."""
    packed, known = model.packed, model.known or {}
    if packed.releases or packed.system.count > MOST_BODIES:
        return None, _nothing
    structure, numbers = structure_of(packed.system, known, floors=packed.floors)
    try:
        kernels = model.fusion.fused(structure).kernels
    except (ElementError, EnvironmentFailure):
        return None, _nothing
    kernel = kernels["accelerations"]
    if "power" in outputs:  # of a scene without that kernel it is zero: only blows do work in it
        kernel = kernels.get("accelerations_power", kernel)
    there = [port.name for port in kernel.outputs if port.name in outputs]
    tape = TapeKernel(tangent(kernel, ["q", "u"], there, values=False, guards=False))
    live = LiveInputs(packed.system, structure.inputs)
    return tape, lambda t, memory: live.now(numbers, t, memory)


def _nothing(_t: float, _memory: Array) -> Array:
    return np.zeros(0)
