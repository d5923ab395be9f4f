"""Root locus over a parameter of a scene, and the stability limit.

Modes at successive parameter values are paired by eigenvalues and shapes, so that curves may cross.
Over the spin of a shaft the result is a Campbell diagram, over any other parameter a root locus.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import linear_sum_assignment

from mstmm.argument_validation import abbreviate
from mstmm.array_validation import Array, Integers, finite_array
from mstmm.errors import NumericalFailure, SceneError
from mstmm.risk import RUN, AssessedResult, DeferredRisks, Risk

from ..result.checks.answer_checks import merge_over_values
from .file_formats import SavedResult, xarray
from .modes import Complex, Modes

if TYPE_CHECKING:
    from .linear_model import Linear

#: Function that returns the linear model at a parameter value.
ModelAtValue = Callable[[float], "Linear"]

#: Accepted values of `frame` in `Model.locus`.
FRAMES = ("auto", "fixed", "rotating")
#: Tolerance of a stability limit, relative to the search range.
_NEAR = 1e-12
#: Fraction of its initial value below which the lowest frequency indicates a limit point.
_VANISHING = 0.03
#: Ratio of buckling loads in two planes up to which both planes buckle together.
_ALIKE = 1.02


@dataclass(frozen=True, eq=False)
class RootLocus(SavedResult):
    """Eigenvalues over a parameter.

    Attributes:
        parameter_values: (m,) values of the parameter.
        eigenvalues: (m, k), one column per mode; nan where a mode is missing at a value.
        frame: frame of frequencies and whirl, "fixed" or "rotating".  In the rotating frame, in
            which coordinates rotate with the spinning bodies, a whirl of frequency f in the fixed
            frame has |f - spin|.
        whirl: (m, k) whirl direction of the modes about the spin; see `Modes.whirl`.
        findings: risks at each value, and of the diagram.
    """

    parameter_name: str
    parameter_values: Array = field(repr=False)
    eigenvalues: Complex = field(repr=False)
    frame: str = "fixed"
    whirl: Array = field(default_factory=lambda: np.zeros((0, 0)), repr=False)
    findings: Iterable[Risk] = field(default=(), repr=False)

    @property
    def frequency(self) -> Array:
        """Frequencies (m, k) in Hz."""
        return np.abs(self.eigenvalues.imag) / (2 * np.pi)

    @property
    def growth_rate(self) -> Array:
        """Growth rates (m, k) in 1/s; negative for decay."""
        return np.asarray(self.eigenvalues.real)

    def plot(self, path: str | Path | None = None, orders: ArrayLike = ()) -> Any:
        """Root locus or Campbell diagram as a `matplotlib.figure.Figure`.

        It shows frequencies and growth rates over the parameter.  If this is a spin in rad/s,
        `orders` adds lines at multiples of it, in the same frame.  The figure is written to `path`
        if given.

        Raises EnvironmentFailure without the extra `plot`.
        """
        from .plots.linear_plots import locus

        lines = np.atleast_1d(finite_array("orders", orders)).tolist()
        return locus(
            self.parameter_name,
            self.parameter_values,
            self.eigenvalues,
            path,
            lines,
            self.frame,
            self.whirl,
        )

    def to_xarray(self) -> Any:
        """`xarray.Dataset` of frequency, growth and whirl; EnvironmentFailure without the extra."""
        along = ("value", "motion")
        arrays: dict[str, Any] = {
            "frequency": (along, self.frequency, {"units": "Hz"}),
            "growth": (along, self.growth_rate, {"units": "1/s"}),
            "whirl": (along, self.whirl),
        }
        coords = {
            "value": self.parameter_values,
            "motion": np.arange(1, self.eigenvalues.shape[1] + 1),
        }
        about = {"parameter": self.parameter_name, "frame": self.frame}
        return xarray().Dataset(arrays, coords, about)

    def _rows(self) -> Iterator[tuple[str, ...]]:
        """Header, then one row per parameter value."""
        motions = range(1, self.eigenvalues.shape[1] + 1)
        yield (
            self.parameter_name,
            *(f"{k} {part}" for k in motions for part in ("frequency [Hz]", "growth [1/s]")),
        )
        pairs = np.stack([self.frequency, self.growth_rate], axis=2).reshape(
            len(self.parameter_values), -1
        )
        for value, row in zip(self.parameter_values.tolist(), pairs.tolist(), strict=True):
            yield tuple(map(repr, (value, *row)))


def trace_modes(
    at: ModelAtValue,
    parameter: str,
    values: Array,
    count: int | None,
    damped: bool | None,
    frame: str,
) -> RootLocus:
    """Modes at each parameter value, paired in columns; `frame` as in `Model.locus`."""
    models, risks = _in_frame([at(value) for value in values.tolist()], parameter, frame)
    modes_by_value = [linear.modes(count, damped) for linear in models]
    width = max(len(modes) for modes in modes_by_value)
    if not width:
        raise SceneError("the scene has no degrees of freedom, so that it has no modes")
    rows = np.full((len(modes_by_value), width), np.nan + 0j)
    turns = np.full(rows.shape, np.nan)
    order: Integers = np.arange(len(modes_by_value[0]))
    rows[0, order], turns[0, order] = modes_by_value[0].eigenvalues, modes_by_value[0].whirl
    for row, (before, now) in enumerate(pairwise(modes_by_value), start=1):
        order = _pair_modes(before, now, order, width)
        rows[row, order], turns[row, order] = now.eigenvalues, now.whirl
    rotating = any(modes.frame == "rotating" for modes in modes_by_value)
    frame = "rotating" if rotating else "fixed"
    each = list(zip(values.tolist(), modes_by_value, strict=True))
    findings = DeferredRisks(
        lambda: (*risks, *merge_over_values(parameter, [(x, modes.risks) for x, modes in each]))
    )
    return RootLocus(parameter, values, rows, frame, turns, findings)


def _in_frame(
    models: list[Linear], parameter: str, frame: str
) -> tuple[list[Linear], tuple[Risk, ...]]:
    """Models in the requested frame, with a risk if "auto" cannot use the fixed frame."""
    if frame not in FRAMES:
        raise SceneError(f'frame = {abbreviate(frame)}: expected "auto", "fixed" or "rotating"')
    if frame == "rotating":
        return models, ()
    try:
        return [linear.to_fixed_frame() for linear in models], ()
    except SceneError as error:
        if frame == "fixed":
            raise
        return models, (_rotating_frame_risk(parameter, str(error)),)


def _rotating_frame_risk(parameter: str, why: str) -> Risk:
    return Risk(
        "rotating-frame", parameter,
        f"frequencies refer to the rotating frame and do not show critical speeds "
        f"({why.removeprefix('fixed frame: ')})",
        'give frame="rotating" to accept this, or make the rotor axisymmetric',
    )  # fmt: skip


def _pair_modes(before: Modes, now: Modes, order: Integers, width: int) -> Integers:
    """Column of each mode: that of the most similar mode at the previous value."""
    apart = np.abs(before.eigenvalues[:, None] - now.eigenvalues[None, :])
    apart /= np.maximum(1e-300, np.maximum(before.omega[:, None], now.omega[None, :]))
    unit = [x / np.linalg.norm(x, axis=0) for x in (before.shapes, now.shapes)]
    unlike = 1 - np.abs(np.conj(unit[0]).T @ unit[1])
    rows, columns = linear_sum_assignment(apart + unlike)
    columns_of_modes = np.full(len(now), -1)
    columns_of_modes[columns] = order[rows]
    spare = iter(sorted(set(range(width)) - set(columns_of_modes.tolist())))
    return np.array([next(spare) if column < 0 else column for column in columns_of_modes])


@dataclass(frozen=True)
class StabilityLimit(AssessedResult):
    """Parameter value at the stability limit, beyond which a mode is unstable.

    Attributes:
        kind: "divergence" (loss of stiffness, as in buckling) or "flutter".
        frequency: of the unstable mode, Hz, in `frame`.
        dominant_coordinates: dominant coordinates of the unstable mode.
        findings: risks of the last stable state below the limit.
        frame: "fixed" or "rotating".
    """

    parameter_name: str
    value: float
    kind: str
    frequency: float
    dominant_coordinates: tuple[str, ...]
    findings: Iterable[Risk] = field(default=(), repr=False)
    frame: str = "fixed"


def critical(at: ModelAtValue, parameter: str, low: float, high: float) -> StabilityLimit:
    """Stability limit between a stable value `low` and an unstable value `high`, by bisection.

    One of several limits between them is found.

    Raises SceneError if `low` is unstable or `high` is stable.
    """
    first, last = _modes_at(at, low), _modes_at(at, high)
    if first is None or _most_unstable_mode(first) is not None:
        raise SceneError(
            f"{parameter} = {low:g}: expected a value at which the scene is stable, found a "
            "growing motion"
        )
    if last is not None and _most_unstable_mode(last) is None:
        raise SceneError(
            f"{parameter} = {high:g}: expected a value above the stability limit, found a stable "
            "scene"
        )
    below, span = first, high - low
    while abs(high - low) > _NEAR * abs(span):
        middle = (low + high) / 2
        if middle in (low, high):
            break
        middle_modes = _modes_at(at, middle)
        if middle_modes is not None and _most_unstable_mode(middle_modes) is None:
            low, below = middle, middle_modes
        else:
            high, last = middle, middle_modes
    growing = None if last is None else _most_unstable_mode(last)
    value, names = (0j, ()) if last is None or growing is None else (
        complex(last.eigenvalues[growing]), tuple(last.dominant_coordinates(growing))
    )  # fmt: skip
    kind = "divergence" if value.imag == 0 else "flutter"
    lost = _lost_equilibrium(parameter, high, first, below) if last is None else ()
    return StabilityLimit(
        parameter, (low + high) / 2, kind, abs(value.imag) / (2 * np.pi), names,
        DeferredRisks(lambda: (*lost, *_risks_below(parameter, low, below))),
        "fixed" if last is None else last.frame,
    )  # fmt: skip


def _modes_at(at: ModelAtValue, value: float) -> Modes | None:
    """All modes at a parameter value; None where the scene has no equilibrium."""
    try:
        (linear,), _ = _in_frame([at(value)], "", "auto")
        modes = linear.modes()
    except NumericalFailure:
        return None
    if not len(modes):
        raise SceneError("the scene has no degrees of freedom, so that it has no stability limit")
    return modes


def _most_unstable_mode(modes: Modes) -> int | None:
    """Index of the mode with the largest growth rate; None if no mode is unstable."""
    k = int(modes.eigenvalues.real.argmax())
    return k if modes.eigenvalues[k].real > 0 else None


def _risks_below(parameter: str, value: float, below: Modes) -> Iterator[Risk]:
    """Risks of the last stable state that concern the stability limit.

    Omitted are loss of stiffness and buckling, which are the result itself (also where another
    plane buckles at the same value), and limits at high frequencies, which do not affect it.
    """
    own = (
        risk for risk in below.risks
        if risk.name not in ("unstable", "unrestrained", "frequency-range")
        and not (risk.name == "buckling" and risk.value is not None and risk.value < _ALIKE)
    )  # fmt: skip
    return merge_over_values(parameter, [(value, own)])


def _lost_equilibrium(parameter: str, high: float, first: Modes, below: Modes) -> tuple[Risk, ...]:
    """Risk that a missing equilibrium is no limit point, where a stiffness would vanish first."""
    if float(below.omega.min()) <= _VANISHING * float(first.omega.min()):
        return ()
    return (
        Risk(
            "no-equilibrium", RUN,
            f"no equilibrium was found at {parameter} = {high:g}, but no stiffness vanishes below "
            "it: the search may have failed there, so that this is not the stability limit",
            "check equilibrium() on both sides of the value",
        ),
    )  # fmt: skip
