"""Waterfall: one frequency response over frequency and over a parameter of the scene."""

from __future__ import annotations

import cmath
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from mstmm.array_validation import Array
from mstmm.errors import SceneError
from mstmm.risk import AssessedResult, DeferredRisks, Risk

from ..result.checks.answer_checks import merge_over_values
from . import file_formats
from .frequency_response import frequency_response
from .modes import Complex

if TYPE_CHECKING:
    from .linear_equations import LinearEquations


@dataclass(frozen=True, eq=False)
class Waterfall(AssessedResult):
    """Frequency response of one output to one input, over a parameter and frequency.

    Attributes:
        parameter_values: (m,) values of the parameter.
        omega: (k,) angular frequencies, rad/s.
        response: (m, k) complex amplitudes.
    """

    parameter_name: str
    parameter_values: Array = field(repr=False)
    omega: Array = field(repr=False)
    input: str
    output: str
    response: Complex = field(repr=False)
    findings: Iterable[Risk] = field(default=(), repr=False)

    def plot(self, path: str | Path | None = None) -> Any:
        """Magnitudes in dB as colours in a `matplotlib.figure.Figure`, written to `path` if given.

        Raises EnvironmentFailure without the extra `plot`.
        """
        from .plots.linear_plots import waterfall

        frequency, up = self.omega / (2 * np.pi), np.argsort(self.parameter_values)
        return waterfall(
            frequency, self.parameter_values[up], self.response[up], self.parameter_name, path
        )

    def to_xarray(self) -> Any:
        """`xarray.Dataset` with real and imaginary parts; EnvironmentFailure without the extra."""
        along = ("value", "omega")
        arrays: dict[str, Any] = {
            "real": (along, self.response.real), "imag": (along, self.response.imag),
        }  # fmt: skip
        coords: dict[str, Any] = {
            "value": self.parameter_values, "omega": ("omega", self.omega, {"units": "rad/s"}),
        }  # fmt: skip
        about = {"parameter": self.parameter_name, "input": self.input, "output": self.output}
        return file_formats.xarray().Dataset(arrays, coords, about)

    def _rows(self) -> Iterator[tuple[str, ...]]:
        """Header, then one row per parameter value and frequency."""
        yield self.parameter_name, "omega [rad/s]", "frequency [Hz]", "magnitude", "phase [rad]"
        for point, row in zip(self.parameter_values.tolist(), self.response, strict=True):
            for omega, value in zip(self.omega.tolist(), row.tolist(), strict=True):
                numbers = point, omega, omega / (2 * np.pi), abs(value), cmath.phase(value)
                yield tuple(map(repr, numbers))

    def save(self, path: str | Path) -> Path:
        """Save the responses: .nc (extra io), or .csv with one row per value and frequency.

        Raises SceneError for another file extension, EnvironmentFailure without the extra.
        """
        return file_formats.save(path, self.to_xarray, self._rows())


def waterfall(
    at: Callable[[float], LinearEquations],
    parameter: str,
    points: Array,
    omega: ArrayLike,
    names: Sequence[str],
) -> Waterfall:
    """Frequency response at each parameter value; `names` are those of input and output.

    Raises SceneError unless each is a single name.
    """
    pushed, shown = names
    for what, name in (("input", pushed), ("output", shown)):
        if not isinstance(name, str):
            raise SceneError(f"{what} = {name!r}: expected one name, not a list of them")
    responses = [frequency_response(at(x), omega, [pushed], [shown]) for x in points.tolist()]
    rows = np.array([response.response[:, 0, 0] for response in responses])
    first = responses[0]
    each = list(zip(points.tolist(), responses, strict=True))
    return Waterfall(
        parameter, points, first.omega, first.input_names[0], first.output_names[0], rows,
        DeferredRisks(lambda: merge_over_values(parameter, [(x, row.risks) for x, row in each])),
    )  # fmt: skip
