"""Kernel compiled in float, double or quadruple precision, called with numpy arrays."""

from __future__ import annotations

import ctypes
import os
from collections.abc import Mapping
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mstmm.abi.scalar_types import SCALARS, SYMBOL
from mstmm.errors import EnvironmentFailure
from mstmm.ir import KernelIR


class ScalarKernel:
    """Kernel in one scalar type.

    Arrays have the shapes of the ports.  In quadruple precision they have an additional last axis
    of length 2: the high and the low double of each value, which is their exact sum (`fractions`).
    """

    def __init__(self, kernel: KernelIR, scalar: str, path: Path) -> None:
        """Load the library; raises EnvironmentFailure if that fails."""
        self.kernel, self.scalar = kernel, scalar
        self._type = SCALARS[scalar]
        try:
            self._library = ctypes.CDLL(os.fspath(path), mode=os.RTLD_NOW | os.RTLD_LOCAL)
        except OSError as error:
            raise EnvironmentFailure(
                f"{kernel.name} cannot be computed in {scalar} precision here ({error}); "
                "use another scalar type"
            ) from error
        self._function = getattr(self._library, SYMBOL)

    def __call__(
        self, inputs: Mapping[str, ArrayLike], start: Mapping[str, ArrayLike] | None = None
    ) -> tuple[int, dict[str, NDArray[Any]]]:
        """Evaluate (guard code or 0, outputs by name) for inputs by name.

        In quadruple precision an input may also be given in doubles (without the last axis).
        `start` contains the initial values of outputs that accumulate, zero by default.
        Raises ValueError for an input that is missing or of a wrong shape.
        """
        input_arrays = []
        for port in self.kernel.inputs:
            if port.name not in inputs:
                raise ValueError(f"{self.kernel.name}: no value for the input {port.name!r}")
            input_arrays.append(
                self._array(port.name, inputs[port.name], _integer_shape(port.shape))
            )
        outputs = {
            port.name: self._array(
                port.name, (start or {}).get(port.name), _integer_shape(port.shape)
            )
            for port in self.kernel.outputs
        }
        code = int(
            self._function(_pointer_array(input_arrays), _pointer_array(list(outputs.values())))
        )
        return code, outputs

    def _array(self, name: str, value: ArrayLike | None, shape: tuple[int, ...]) -> NDArray[Any]:
        """Contiguous copy of an array, with the additional axis in quadruple precision."""
        parts = self._type.parts
        full_shape = (*shape, parts) if parts > 1 else shape
        if value is None:
            return np.zeros(full_shape, dtype=self._type.array)
        array = np.array(value, dtype=self._type.array, order="C")
        if (
            parts > 1
            and array.size * parts == np.prod(full_shape, dtype=int)
            and array.shape != full_shape
        ):
            array = np.stack([array, np.zeros_like(array)], axis=-1)
        if array.size != np.prod(full_shape, dtype=int):
            raise ValueError(
                f"{self.kernel.name}: {name} has shape {array.shape}, not {full_shape}"
            )
        return np.ascontiguousarray(array.reshape(full_shape))


def fractions(array: NDArray[Any]) -> list[Fraction]:
    """Exact values of a quadruple array, row by row; finite values only."""
    return [Fraction(float(high)) + Fraction(float(low)) for high, low in array.reshape(-1, 2)]


def _integer_shape(shape: tuple[int | str, ...]) -> tuple[int, ...]:
    return tuple(int(extent) for extent in shape)


def _pointer_array(arrays: list[NDArray[Any]]) -> Any:
    return (ctypes.c_void_p * max(1, len(arrays)))(*(array.ctypes.data for array in arrays))
