"""Expressions of a scene over a run: efforts of laws, components of loads."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array
from mstmm.expression.derivatives import INPUTS
from mstmm.numerics.piecewise_polynomial import NUMBERS_PER_PIECE

from ...engine.looped_engine import Probe
from ...kernels import numpy_kernels
from ...packing.system import System

if TYPE_CHECKING:
    from ..observations import Observations

_IDENTITY_AXES = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)

#: Largest number of values of the motion of all loads together, about 130 MB.
MAX_MOTION_NUMBERS = 2**24


class AppliedLoads:
    """Expression values at all samples, computed on first use and cached."""

    def __init__(self, observed: Observations) -> None:
        self.observations = observed
        self.system: System = observed.engine.packed.system

    @cached_property
    def expression_inputs(self) -> dict[str, Array]:
        """Values that expressions read: t, q, u and the inputs, held inputs from memory."""
        run, held = self.observations.run, self.system.held_inputs
        inputs = np.array([self.system.inputs_at(t) for t in run.t.tolist()])
        inputs = inputs.reshape(len(run.t), NUMBERS_PER_PIECE * len(self.system.inputs))
        for k, slot in enumerate(held.memory_indices):
            if slot >= 0:
                inputs[:, NUMBERS_PER_PIECE * k : NUMBERS_PER_PIECE * (k + 1)] = 0.0
                inputs[:, NUMBERS_PER_PIECE * k + 1] = run.memory[:, slot]
        return {"t": run.t[:, None], "q": run.q, "u": run.u, INPUTS: inputs}

    @cached_property
    def _values(self) -> Array:
        kernel = self.system.values
        assert kernel is not None
        return numpy_kernels.evaluate(kernel, self.expression_inputs)["values"]

    @cached_property
    def _loads(self) -> Array | None:
        """Motion (n, 2 loads, 24) of the point and of the axes of each load.

        None if the array would be too large.
        """
        probes = [probe for number in range(len(self.system.loads)) for probe in self._pair(number)]
        is_small = len(self.observations.run.t) * 24 * len(probes) <= MAX_MOTION_NUMBERS
        return self._observe(probes) if is_small else None

    def load(self, number: int) -> tuple[Array, Array]:
        """Motion (n, 24) of the point of a load and of its axes, see `Observation`."""
        motions, first = self._loads, 2 * number
        if motions is None:
            motions, first = self._observe(self._pair(number)), 0
        return motions[:, first], motions[:, first + 1]

    def _pair(self, number: int) -> tuple[Probe, Probe]:
        load = self.system.loads[number]
        axes = load.axes_own if load.axes >= 0 else _IDENTITY_AXES
        return Probe(load.body, _IDENTITY_AXES, load.offset), Probe(
            load.axes, axes, (0.0, 0.0, 0.0)
        )

    def _observe(self, probes: Sequence[Probe]) -> Array:
        run, engine = self.observations.run, self.observations.engine
        return engine.observe(run.t, run.q, run.u, run.memory, probes, ("points",)).points

    def values_at(self, indices: tuple[int, ...]) -> Array:
        """Values (n, places) at some indices, 0 at index -1."""
        result = np.zeros((len(self.observations.run.t), len(indices)))
        for k, slot in enumerate(indices):
            if slot >= 0:
                result[:, k] = self._values[:, slot]
        return result
