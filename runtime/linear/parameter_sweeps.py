"""Responses over a parameter of the scene: waterfall and unbalance response."""

from __future__ import annotations

import cmath
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from mstmm.argument_validation import abbreviate
from mstmm.array_validation import Array, finite_float
from mstmm.errors import SceneError
from mstmm.risk import DeferredRisks, Risk

from ..engine.quantity_registry import BodyReferences
from ..result.checks.answer_checks import merge_over_values
from .file_formats import SavedResult, xarray
from .frequency_response import frequency_response
from .modes import Complex
from .rotors import angular_velocity

if TYPE_CHECKING:
    from .frequency_response import FrequencyResponse
    from .linear_equations import LinearEquations
    from .linear_model import Linear


# --- waterfall: one frequency response over a parameter -------------------------------------------


@dataclass(frozen=True, eq=False)
class Waterfall(SavedResult):
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
        return xarray().Dataset(arrays, coords, about)

    def _rows(self) -> Iterator[tuple[str, ...]]:
        """Header, then one row per parameter value and frequency."""
        yield self.parameter_name, "omega [rad/s]", "frequency [Hz]", "magnitude", "phase [rad]"
        for point, row in zip(self.parameter_values.tolist(), self.response, strict=True):
            for omega, value in zip(self.omega.tolist(), row.tolist(), strict=True):
                numbers = point, omega, omega / (2 * np.pi), abs(value), cmath.phase(value)
                yield tuple(map(repr, numbers))


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


# --- unbalance response of rotors over their spin speed -------------------------------------------


@dataclass(frozen=True, eq=False)
class UnbalanceResponse(SavedResult):
    """Whirl of points due to an unbalance m e that rotates with a body, in the fixed frame.

    Attributes:
        parameter_name, parameter_values: the parameter and its values (m,).
        spin: (m,) spin speed of the body and frequency of the whirl, rad/s.
        at, unbalance: end with the unbalance, and m e in kg m.
        end_names: names of the observed ends.
        displacements: (m, points, 3) complex, m, inertial axes: the motion is the real part of
            displacements * exp(i spin t); the unbalance rotates from the first of `directions`
            towards the second.
        directions: (2, 3) unit vectors normal to the spin axis.
    """

    parameter_name: str
    parameter_values: Array = field(repr=False)
    spin: Array = field(repr=False)
    at: str
    unbalance: float
    end_names: tuple[str, ...]
    displacements: Complex = field(repr=False)
    directions: Array = field(repr=False)
    findings: Iterable[Risk] = field(default=(), repr=False)

    @property
    def amplitude(self) -> Array:
        """Major semi-axis (m, points) of the orbits, m."""
        d = self.displacements
        total, square = (np.abs(d) ** 2).sum(axis=2), np.abs((d * d).sum(axis=2))
        return np.sqrt((total + square) / 2)

    @property
    def minor_axis(self) -> Array:
        """Minor semi-axis (m, points) of the orbits, m; negative for backward whirl."""
        d, across = self.displacements, self.directions
        along, beside = np.einsum("mpi,ki->kmp", d, across)
        total, square = (np.abs(d) ** 2).sum(axis=2), np.abs((d * d).sum(axis=2))
        sense = np.sign((along * np.conj(beside)).imag)
        return np.asarray(sense * np.sqrt(np.maximum(total - square, 0.0) / 2))

    def plot(self, path: str | Path | None = None) -> Any:
        """Plot amplitudes over spin as a `matplotlib.figure.Figure`; save it to `path` if given.

        Raises EnvironmentFailure without the extra `plot`.
        """
        from .plots.linear_plots import unbalance

        return unbalance(self.spin, self.amplitude, self.end_names, path)

    def to_xarray(self) -> Any:
        """`xarray.Dataset` with displacements split into real and imaginary parts.

        Raises EnvironmentFailure without the extra.
        """
        along = ("value", "point", "axis")
        arrays: dict[str, Any] = {
            "spin": ("value", self.spin, {"units": "rad/s"}),
            "amplitude": (along[:2], self.amplitude, {"units": "m"}),
            "minor_axis": (along[:2], self.minor_axis, {"units": "m"}),
            "real": (along, self.displacements.real), "imag": (along, self.displacements.imag),
        }  # fmt: skip
        coords = {
            "value": self.parameter_values,
            "point": list(self.end_names),
            "axis": ["x", "y", "z"],
        }
        about = {"parameter": self.parameter_name, "at": self.at, "unbalance": self.unbalance}
        return xarray().Dataset(arrays, coords, about)

    def _rows(self) -> Iterator[tuple[str, ...]]:
        """Header, then one row of text for each value of the parameter."""
        kinds = ("amplitude [m]", "minor axis [m]")
        yield (
            self.parameter_name,
            "spin [rad/s]",
            *(f"{p} {kind}" for p in self.end_names for kind in kinds),
        )
        both = np.stack([self.amplitude, self.minor_axis], axis=2).reshape(
            len(self.parameter_values), -1
        )
        for value, spin, row in zip(self.parameter_values, self.spin, both, strict=True):
            yield tuple(repr(float(x)) for x in (value, spin, *row))


def unbalance_response(
    linear_at: Callable[[float], Linear],
    parameter: str,
    values: Array,
    at: str,
    unbalance: float,
    points: Sequence[str],
) -> UnbalanceResponse:
    """Unbalance response; see `Model.unbalance_response`."""
    size = finite_float("unbalance", unbalance, "m e in kg m")
    models = [linear_at(value).to_fixed_frame() for value in values.tolist()]
    end_names = [_end(models[0], name) for name in (at, *points)]
    axes = [angular_velocity(linear, at) for linear in models]
    spins = np.array([np.linalg.norm(axis) for axis in axes])
    across = _normal_vectors(axes[int(spins.argmax())])
    responses = [
        _response(linear, spin, end_names)
        for linear, spin in zip(models, spins.tolist(), strict=True)
    ]
    whirls = [
        _whirl(response, spin, size * across, len(points))
        for response, spin in zip(responses, spins.tolist(), strict=True)
    ]
    assessed = [
        (value, response)
        for value, response in zip(values.tolist(), responses, strict=True)
        if response is not None
    ]
    findings = DeferredRisks(
        lambda: merge_over_values(
            parameter, [(value, response.risks) for value, response in assessed]
        )
    )
    return UnbalanceResponse(
        parameter, values, spins, end_names[0], size, tuple(end_names[1:]), np.array(whirls),
        across,
        findings,
    )  # fmt: skip


def _end(linear: Linear, name: str) -> str:
    ends = BodyReferences(linear.model.scene.skeleton)
    if not isinstance(name, str) or name not in ends:
        raise SceneError(f'{abbreviate(name)}: expected a body or an end of one, such as "disc"')
    return ends.canonical(name) or name


def _normal_vectors(axis: Array) -> Array:
    """Unit vectors (2, 3) normal to an axis; with it they form a right-handed triad."""
    size = float(np.linalg.norm(axis))
    if not size:
        raise SceneError("unbalance response: the body does not spin at any value of the parameter")
    along = axis / size
    first = np.eye(3)[int(np.abs(np.roll(along, -1)).argmin() + 1) % 3]
    first = first - along * (along @ first)
    first /= np.linalg.norm(first)
    return np.array([first, np.cross(along, first)])


def _response(linear: Linear, spin: float, end_names: Sequence[str]) -> FrequencyResponse | None:
    """Response of the points to forces at the first place, at the spin; None without spin."""
    if not spin:
        return None
    inputs = [f"{end_names[0]}.force.{axis}" for axis in "xyz"]
    outputs = [f"{point}.position.{axis}" for point in end_names[1:] for axis in "xyz"]
    return linear.frequency_response([spin], inputs, outputs)


def _whirl(
    response: FrequencyResponse | None, spin: float, unbalance: Array, count: int
) -> Complex:
    """Displacements (points, 3), m, due to m e spin^2 rotating from the first direction."""
    if response is None:
        return np.zeros((count, 3), dtype=np.complex128)
    force = spin**2 * (unbalance[0] - 1j * unbalance[1])
    return np.asarray((response.response[0] @ force).reshape(count, 3))
