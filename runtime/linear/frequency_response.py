"""Frequency response H(i omega) of a linear model, O(bodies) per frequency.

An input r exp(s t) has the amplitudes x = Z(s)^-1 r with Z(s) = s^2 M + s C + K, from one
elimination from the tips to the root per s.  The elimination has a pole, and loses digits, where
the subtree outboard of a locked hinge resonates although the whole tree does not (an absorber).
The response is analytic there: it is the mean over a circle about the frequency in the s-plane.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure, SceneError
from mstmm.risk import DeferredRisks, Risk

from ..engine.compiled_scene import speed_scales
from ..engine.tangent_matrix import HarmonicResponse
from ..result.checks.shape_range import response_range_risks
from .file_formats import SavedResult, xarray
from .harmonic.damping import (
    Losses,
    Ratios,
    check_state_at_rest,
    is_requested,
    modal_damping,
    reject_drives,
    reject_modal_damping,
    stiffer,
)
from .harmonic.exact_beams import (
    BeamSelection,
    ExactBeams,
    exact_beams,
    reject_distributed,
    reject_inner_names,
)
from .harmonic.harmonic_solve import Amplitudes, HarmonicLoads
from .harmonic.response_risks import (
    check_steady,
    find_time_risks,
    reject_rotating_balls,
    unshaped_response_risks,
)
from .input_channels import Channel, channel, some_names
from .mck_matrices import Matrices
from .outputs import LinearQuantity, outputs_of, read_by, rows_of
from .validity import find_response_risks

if TYPE_CHECKING:
    from ..engine.looped_engine import LoopedEngine
    from .linear_equations import LinearEquations

Complex = NDArray[np.complex128]

#: Largest number of values in a batch of frequencies.
_BATCH = 2**20
#: Growth of inertia in the elimination above which means over circles are tried.
_GROWN = 1e6
#: Radii of circles relative to the frequency, points per circle, and the number of negative powers
#: of the distance from the centre that these points separate from positive ones.
_CIRCLES, _POINTS, _POLES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7), 8, 3
#: Relative errors of a response: sufficient, and too large for a result.
_GOOD, _LOST = 1e-11, 1e-3
#: Responses below this fraction of the bound by the amplitudes of all coordinates are rounding.
_NOISE = 1e-11
_ROUNDING = 2.0**-52
#: Limit of frequencies: their squares times masses must not overflow.
_FASTEST = 1e100


@dataclass(frozen=True, eq=False)
class FrequencyResponse(SavedResult):
    """Amplitudes of outputs under inputs cos(omega t) of unit amplitude.

    Attributes:
        omega: (k,) requested angular frequencies, rad/s.
        input_names, output_names: names.
        input_units, output_units: their units.
        response: (k, outputs, inputs) complex; an output is Re(values exp(i omega t)).
        findings: risks of the linear model and of this response.
    """

    omega: Array = field(repr=False)
    input_names: tuple[str, ...]
    output_names: tuple[str, ...]
    input_units: tuple[str, ...] = field(repr=False)
    output_units: tuple[str, ...] = field(repr=False)
    response: Complex = field(repr=False)
    findings: Iterable[Risk] = field(default=(), repr=False)

    @property
    def frequency(self) -> Array:
        """Frequencies (k,) in Hz."""
        return self.omega / (2 * np.pi)

    @property
    def magnitude(self) -> Array:
        """Magnitude (k, outputs, inputs) in output units per input unit."""
        return np.abs(self.response)

    @property
    def phase(self) -> Array:
        """Phase (k, outputs, inputs), rad in (-pi, pi]; negative where the output lags."""
        return np.angle(self.response)

    def plot(self, path: str | Path | None = None) -> Any:
        """Bode plot as a `matplotlib.figure.Figure`, written to `path` if given.

        It shows the magnitude and phase of each output for each input.

        Raises EnvironmentFailure without the extra `plot`.
        """
        from .plots.linear_plots import bode

        units = [_ratio(y, u) for y in self.output_units for u in self.input_units]
        values, labels = self._curves()
        if len(set(units)) > 1:
            labels = [f"{label}, {unit}" for label, unit in zip(labels, units, strict=True)]
        unit = units[0] if len(set(units)) == 1 else "units of the curves"
        return bode(self.frequency, values, labels, unit, path)

    def plot_nyquist(self, path: str | Path | None = None) -> Any:
        """Nyquist plot as a `matplotlib.figure.Figure`; see `plot`."""
        from .plots.linear_plots import nyquist

        return nyquist(*self._curves(), path)

    def _curves(self) -> tuple[Complex, list[str]]:
        """Values (k, curves) and the label of each curve."""
        labels = [f"{y} / {u}" for y in self.output_names for u in self.input_names]
        return self.response.reshape(len(self.omega), -1), labels

    def to_dict(self) -> dict[str, Any]:
        """All data as a dictionary for JSON, with real and imaginary parts."""
        return {
            "omega": self.omega.tolist(), "frequency": self.frequency.tolist(),
            "inputs": list(self.input_names), "outputs": list(self.output_names),
            "input_units": list(self.input_units), "output_units": list(self.output_units),
            "real": self.response.real.tolist(), "imag": self.response.imag.tolist(),
            **self.assessment(),
        }  # fmt: skip

    def to_xarray(self) -> Any:
        """`xarray.Dataset` with real and imaginary parts; EnvironmentFailure without the extra."""
        along = ("omega", "output", "input")
        arrays: dict[str, Any] = {
            "real": (along, self.response.real), "imag": (along, self.response.imag),
            "magnitude": (along, self.magnitude), "phase": (along, self.phase, {"units": "rad"}),
        }  # fmt: skip
        coords: dict[str, Any] = {
            "omega": ("omega", self.omega, {"units": "rad/s"}),
            "output": list(self.output_names), "input": list(self.input_names),
        }  # fmt: skip
        return xarray().Dataset(arrays, coords)

    def _rows(self) -> Iterator[tuple[str, ...]]:
        """Header, then one row per frequency."""
        curves, labels = self._curves()
        parts = [f"{label} {part}" for label in labels for part in ("magnitude", "phase [rad]")]
        yield "omega [rad/s]", "frequency [Hz]", *parts
        for omega, row in zip(self.omega.tolist(), curves, strict=True):
            numbers = [x for value in row for x in (abs(value), np.angle(value))]
            yield tuple(repr(float(x)) for x in (omega, omega / (2 * np.pi), *numbers))


def frequency_response(
    linear: LinearEquations,
    omega: ArrayLike,
    inputs: Sequence[str] | None,
    outputs: Sequence[str] | None,
    structural: Losses = 0.0,
    modal: Ratios = 0.0,
    exact: BeamSelection = False,
) -> FrequencyResponse:
    """Frequency response of a linear model; see `Linear.frequency_response`."""
    frequencies = angular_frequencies(omega)
    beams = None
    if exact is not False:
        reject_rotating_balls(linear)
        reject_modal_damping(modal)
        beams = exact_beams(linear, exact, structural)
        reject_inner_names(beams, [*(inputs or ()), *read_by(linear, outputs)])
        linear = beams.linear
        if outputs is None and not linear.model.scene.output:
            outputs = [name for name in linear.coordinate_names if not beams.has_coordinate(name)]
            if not outputs:
                raise SceneError(
                    "exact: all coordinates are those of beam shapes; give outputs, such as "
                    f'"{beams.names[0]}.tip.y"'
                )
    pushes = select_inputs(linear, inputs)
    if beams is not None:
        reject_distributed(beams, pushes)
    reject_drives(pushes, beams is not None or is_requested(structural))
    shown = outputs_of(linear, None if outputs is None else some_names("outputs", outputs))
    check_steady(linear, pushes, shown)
    values = _Sweep(linear, pushes, shown, structural, modal, beams).values(frequencies)
    exact_names = () if beams is None else beams.names

    def find_risks() -> Iterator[Risk]:
        yield from find_response_risks(linear, pushes, outputs is not None)
        yield from find_time_risks(linear, pushes, shown)
        yield from response_range_risks(linear.model, frequencies, exact_names)
        if beams is None:
            yield from unshaped_response_risks(linear, pushes, frequencies, respond)

    def respond(of: LinearEquations, by: Sequence[Channel], at: Array) -> tuple[Complex, Array]:
        read = outputs_of(of, [quantity.name for quantity in shown])
        ratio = modal if isinstance(modal, (int, float)) else 0.0
        return _Sweep(of, by, read, structural, ratio, None).values_and_rounding(at)

    return FrequencyResponse(
        frequencies, tuple(entry.name for entry in pushes), tuple(entry.name for entry in shown),
        tuple(entry.unit for entry in pushes), tuple(entry.unit for entry in shown), values,
        DeferredRisks(find_risks),
    )  # fmt: skip


def _ratio(output: str, pushed: str) -> str:
    """Unit of an output per unit of an input."""
    return f"{output}/({pushed})" if "*" in pushed else f"{output}/{pushed}"


def angular_frequencies(omega: ArrayLike) -> Array:
    """Validated angular frequencies (k,) in rad/s; SceneError for invalid values."""
    try:
        frequencies = np.array(omega, dtype=np.float64).reshape(-1)
    except (TypeError, ValueError):
        raise SceneError(f"omega = {omega!r}: expected angular frequencies in rad/s") from None
    if not frequencies.size:
        raise SceneError("omega is empty: give angular frequencies in rad/s")
    wrong = frequencies[~((frequencies > 0) & (frequencies < _FASTEST))]
    if wrong.size:
        raise SceneError(
            f"omega = {wrong[0]:.9g}: expected angular frequencies above 0 and below "
            f"{_FASTEST:g} in rad/s (2 pi times the frequency in Hz)"
        )
    return frequencies


def select_inputs(linear: LinearEquations, inputs: Sequence[str] | None) -> Sequence[Channel]:
    """Named inputs, else those of the model, else its disturbances; SceneError for none."""
    if inputs is not None:
        return [channel(linear.model, name) for name in some_names("inputs", inputs)]
    pushes = linear.input_channels or linear.disturbance_channels
    if not pushes:
        raise SceneError("frequency response: the model has no inputs; give inputs")
    return pushes


def _efforts(linear: LinearEquations, pushes: Sequence[Channel]) -> Array:
    """Efforts (n, pushes) per unit of each input; matrices cached by the model are reused."""
    if pushes is linear.input_channels:
        return linear.V
    if pushes is linear.disturbance_channels:
        return linear.W
    return linear.input_matrix(pushes)


class _Sweep:
    """Response of given outputs to given inputs, evaluated for each s."""

    def __init__(
        self, linear: LinearEquations, pushes: Sequence[Channel], outputs: Sequence[LinearQuantity],
        structural: Losses, modal: Ratios, beams: ExactBeams | None,
    ) -> None:  # fmt: skip
        engine, free = linear.open_tree, list(linear.free_speed_indices)
        check_state_at_rest(linear, structural, modal)
        lossy = stiffer(linear, structural) if is_requested(structural) else None
        self.modal = modal_damping(linear, modal) if is_requested(modal) else None
        self.engine, self.response = engine, _response(linear, lossy, beams)
        efforts = np.zeros((len(pushes), engine.nu))
        efforts[:, free] = _efforts(linear, pushes).T
        self.loads = HarmonicLoads.from_efforts(linear, pushes, efforts)
        self.columns, self.count = self.loads.columns, len(self.loads.columns)
        if self.modal is not None:
            damping = np.zeros((self.modal.columns.shape[1], engine.nu))
            damping[:, free] = self.modal.columns.T
            self.columns = np.concatenate([self.columns, damping])
        self.free, rows = free, rows_of(linear, outputs, pushes)
        self.sizes = speed_scales(linear.model)
        self.rows = {order: wide[:, free] for order, wide in rows.orders.items()}
        self.drive_contributions = {
            order: self.loads.drive_contributions(wide) for order, wide in rows.orders.items()
        }
        self.feedthrough = rows.feedthrough

    def values(self, omega: Array) -> Complex:
        """Response (k, outputs, inputs) at angular frequencies (k,)."""
        batch = max(1, _BATCH // max(1, self.columns.size))
        parts = [self._batch(omega[k : k + batch]) for k in range(0, len(omega), batch)]
        return np.concatenate(parts)

    def values_and_rounding(self, omega: Array) -> tuple[Complex, Array]:
        """Response as by `values`, and its rounding level (outputs, inputs)."""
        s = np.asarray(1j * omega, dtype=np.complex128)
        return self.values(omega), _NOISE * self._response_bound(s, self._evaluate(s)[-1])

    def _batch(self, omega: Array) -> Complex:
        values, growth, grown, _ = self._evaluate(np.asarray(1j * omega, dtype=np.complex128))
        for k in np.flatnonzero(~(growth < _GROWN)):
            values[k] = self._circle_mean(float(omega[k]), values[k], growth[k], int(grown[k]))
        return values

    def _evaluate(self, s: Complex) -> tuple[Complex, Array, NDArray[np.int32], Complex]:
        """Response at s (k,), with the growth of the elimination.

        Returns values (k, outputs, inputs), growth (k,), the bodies (k,) of largest growth, and
        amplitudes (k, columns, n).
        """
        x, growth, grown = self.response.amplitudes(s, self.columns)
        moved = x[:, : self.count, self.free]
        if self.modal is not None:
            moved = self.modal.damp(s, moved, x[:, self.count :, self.free])
        values = np.zeros((len(s), *self.feedthrough.shape), dtype=np.complex128)
        values += self.feedthrough
        for order, rows in self.rows.items():
            answers = rows @ moved.swapaxes(1, 2)
            values += s[:, None, None] ** order * self.loads.sum_by_input(s, answers)
            for j, (power, column) in self.drive_contributions[order].items():
                values[:, :, j] += s[:, None] ** (order + power) * column
        growth[~np.isfinite(values).all(axis=(1, 2))] = np.inf
        return values, growth, grown, moved

    def _circle_mean(self, omega: float, straight: Complex, growth: float, body: int) -> Complex:
        """Response where the elimination lost digits: the most accurate of it and circle means.

        Raises NumericalFailure at a resonance without damping.
        """
        best, unknown = straight, _ROUNDING * growth
        turns = np.exp(2j * np.pi * (np.arange(_POINTS) + 0.5) / _POINTS)
        for part in _CIRCLES:
            s = np.asarray(omega * (1j + part * turns), np.complex128)
            values, growths, _, moved = self._evaluate(s)
            lost = max(
                _pole_share(values, turns, _NOISE * self._response_bound(s, moved)),
                _ROUNDING * float(growths.max()),
            )
            if lost < unknown:
                best, unknown = values.mean(axis=0), lost
            if unknown < _GOOD:
                break
        if not unknown < _LOST:
            hinge_text = f' of hinge "{self.engine.hinge_name(body)}" and its outboard bodies'
            where = hinge_text if body >= 0 else ""
            raise NumericalFailure(
                f"frequency response: omega = {omega:.9g} rad/s is an undamped resonance{where}; "
                "add damping, or leave this frequency out"
            )
        return best

    def _response_bound(self, s: Complex, moved: Complex) -> Array:
        """Bound (outputs, inputs) of the response at s (k,).

        It assumes that every coordinate moves as far, relative to its scale, as the one that moves
        most.
        """
        sizes = self.sizes[self.free]
        most = (np.abs(moved) / sizes).max(axis=(0, 2), initial=0.0)
        size = float(np.abs(s).max())
        inputs = self.loads.sum_by_input(np.array([size]), most[None, None]).real[0, 0]
        outputs = [size**order * (np.abs(rows) @ sizes) for order, rows in self.rows.items()]
        return np.outer(np.sum(outputs, axis=0), inputs)


def _response(
    linear: LinearEquations, lossy: LoopedEngine | None, beams: ExactBeams | None
) -> HarmonicResponse | Amplitudes:
    """Solver for amplitudes: elimination for a tree at rest, else from matrices."""
    state, loops = linear.state, linear.constrained_motion
    if loops is not None or linear.rate_matrix is not None or linear.frame_transform is not None:
        lost = None if loops is None or lossy is None else loops.matrices(lossy, state)
        return Amplitudes(linear.free_speed_indices, Matrices(linear.M, linear.C, linear.K), lost)
    return HarmonicResponse(
        linear.open_tree, state.t, state.q, state.u, state.udot, stiffer=lossy,
        exact=None if beams is None else beams.bodies,
    )  # fmt: skip


def _pole_share(values: Complex, turns: Complex, noise: Array) -> float:
    """Largest relative share of poles within a circle in the responses on it.

    `values` are the responses (k, outputs, inputs) on the circle.  An analytic function has no
    negative powers of the distance from the centre.  The share is relative to the magnitude on the
    circle because the value at the centre may be zero (an antiresonance).
    """
    powers = turns[None] ** np.arange(1, _POLES + 1)[:, None]
    poles = np.abs(np.einsum("pk,kij->pij", powers, values) / len(turns)).max(axis=0)
    sizes = np.abs(values).max(axis=0)
    share = np.divide(poles, sizes, out=np.zeros_like(sizes), where=poles > noise)
    return float(share.max(initial=0.0))
