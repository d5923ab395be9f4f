"""Jacobian of the equations of motion, for implicit integrators: exact, else by differences.

The exact Jacobian is the derivative of the fused kernel (`mstmm.ir.tangent`), run by the
interpreter.  Central differences are used for scenes without that kernel (releases change its form)
or with so many bodies that its generation takes longer than it saves, and for states at which a
derivative does not exist.  Their increments never grow: larger ones give no information along a
coordinate that the equations do not contain.
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

#: Function from a time (s) and the memory of a run to the numbers p of compiled code.
Numbers = Callable[[float, Array], Array]

#: Scenes with more bodies use differences: generating the tangent kernel would take many seconds.
MOST_BODIES = 64

#: Increment of a difference, in rad, m and their rates, or relative to a larger number.
_INCREMENT = 1e-6


class Jacobian:
    """Jacobian d(dy/dt)/dy for the state y = (q, u), with `with_work` followed by the work.

    `rates(t, y)` are the equations, nan where they cannot be evaluated; `memory` (m,) is read at
    every call.  `exact` says which kind it is.
    """

    def __init__(self, model: Compiled, with_work: bool, memory: Array, rates: Rates) -> None:
        self._rates, self._memory, self._nq = rates, memory, model.nq
        self._outputs = ["qdot", "udot", *(["power"] if with_work else [])]
        self._tape, self._numbers = _tape(model, self._outputs)
        #: Held inputs and states of controllers follow what the kernel reads.
        self._n_memory = model.packed.system.held.first

    @property
    def exact(self) -> bool:
        """True if the equations are differentiated, False for differences."""
        return self._tape is not None

    def __call__(self, t: float, y: Array) -> Array:
        """Jacobian (n, n) at y (n,); columns that cannot be evaluated are zero."""
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
            given = {}  # the kernel keeps the inputs of the state
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
    """Tangent kernel of the equations with respect to q and u, or None, and its numbers p."""
    packed, known = model.packed, model.known or {}
    if packed.releases or packed.system.count > MOST_BODIES:
        return None, _nothing
    structure, numbers = structure_of(packed.system, known, floors=packed.floors)
    try:
        kernels = model.fusion.fused(structure).kernels
    except (ElementError, EnvironmentFailure):
        return None, _nothing
    kernel = kernels["accelerations"]
    if "power" in outputs:  # zero in a scene without that kernel: only impacts do work there
        kernel = kernels.get("accelerations_power", kernel)
    there = [port.name for port in kernel.outputs if port.name in outputs]
    tape = TapeKernel(tangent(kernel, ["q", "u"], there, values=False, guards=False))
    live = LiveInputs(packed.system, structure.inputs)
    return tape, lambda t, memory: live.now(numbers, t, memory)


def _nothing(_t: float, _memory: Array) -> Array:
    return np.zeros(0)
