"""Settings of a run, and their validation for all integrators."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from numbers import Real

import numpy as np
from numpy.typing import ArrayLike

from mstmm.argument_validation import require_word
from mstmm.array_validation import finite_array, finite_float, integer
from mstmm.defaults import ATOL, METHOD, RTOL
from mstmm.errors import SceneError

from .steppers import AUTO, AUTO_EXPLICIT, TANGENTS, check_radius, check_tangent

#: Smaller absolute tolerances are raised to this: squares of scaled errors must not overflow.
_MIN_ATOL = 1e-100


@dataclass(frozen=True)
class Settings:
    """Settings of a run: times in s, `step` for fixed steps, else `rtol` and `atol`.

    The loop chooses `first_step`, `min_step` and `max_step` (s) if they are 0; `max_steps` 0 is no
    limit.  `radius` is the spectral radius at infinity, 0 to 1, of generalised alpha, None for its
    default.  `scheme` and `iterations` (maximum number of linear solutions per step) are for the
    methods dttmm-classical.  `tangent` is the tangent of implicit methods, one of
    `steppers.TANGENTS`.
    """

    t_end: float
    t_start: float = 0.0
    method: str = METHOD
    step: float | None = None
    rtol: float = RTOL
    atol: float = ATOL
    output_times: tuple[float, ...] | None = None
    max_step: float = 0.0
    max_steps: int = 0
    first_step: float = 0.0
    min_step: float = 0.0
    radius: float | None = None
    scheme: str = ""
    iterations: int = 1
    tangent: str = TANGENTS[0]

    @property
    def first_method(self) -> str:
        """Method with which the run starts."""
        return AUTO_EXPLICIT if self.method == AUTO else self.method


def to_output_times(output_times: ArrayLike | Sequence[float] | None) -> tuple[float, ...] | None:
    """Output times (s) as a tuple, also from a single number.

    Raises SceneError for times that do not increase and for a single integer, which could be a
    number of samples.
    """
    if output_times is None:
        return None
    given_times = finite_array("output_times", output_times)
    if given_times.ndim == 0 and np.asarray(output_times).dtype.kind in "iu":
        count = int(given_times)
        raise SceneError(
            f"output_times = {count}: expected times in s, found an integer, which may be a time "
            f"or a number of samples; write [{count:.1f}] for one sample at {count} s, or "
            f"numpy.linspace(t_start, t_end, {max(count, 2)}) for equally spaced samples"
        )
    if given_times.ndim > 1:
        raise SceneError(f"output_times have shape {given_times.shape}, expected (n,): times in s")
    times = np.atleast_1d(given_times)
    is_increasing = times[1:] > times[:-1]
    if not is_increasing.all():
        descents = np.flatnonzero(~is_increasing)
        previous, following = times[descents[0]], times[descents[0] + 1]
        raise SceneError(
            f"output_times: {following:g} s follows {previous:g} s; expected increasing times in s"
        )
    return tuple(times.tolist())


def validate(settings: Settings) -> Settings:
    """Validate settings and convert them to plain finite numbers.

    Raises SceneError that names the first invalid one.
    """
    t_start = finite_float("t_start", settings.t_start, "a time in s")
    t_end = finite_float("t_end", settings.t_end, "a time in s, not before t_start")
    if t_end < t_start:
        raise SceneError(f"t_end = {t_end:g}: expected a time in s, not before t_start")
    require_word("method", settings.method, "a name such as dop853")
    require_word("scheme", settings.scheme, "a name such as hht:0.3")
    if settings.method == AUTO and settings.step is not None:
        raise SceneError(
            f'step = {settings.step!r}: method "{AUTO}" chooses its steps; omit step, or name a '
            "method"
        )
    _check_output_times(settings.output_times, t_start, t_end)
    max_step = settings.max_step
    if settings.step is not None and _max_step(max_step):
        raise SceneError(
            f"max_step = {max_step!r}: limits steps that the method chooses, but step = "
            f"{settings.step!r} fixes all steps; omit one of the two"
        )
    return replace(
        settings,
        t_start=t_start,
        t_end=t_end,
        rtol=_require_positive("rtol", settings.rtol, "a relative tolerance above zero"),
        atol=max(
            _MIN_ATOL, _require_positive("atol", settings.atol, "an absolute tolerance above zero")
        ),
        step=None
        if settings.step is None
        else _require_positive("step", settings.step, "a time above zero, in s"),
        max_step=_max_step(max_step),
        max_steps=integer(
            "max_steps", settings.max_steps, 0, "a whole number of steps, or 0 for no limit"
        ),
        tangent=_checked_tangent(settings),
        radius=None
        if settings.radius is None
        else _checked_radius(settings.method, settings.radius),
        iterations=integer(
            "iterations", settings.iterations, 1, "a whole number of iterations, 1 or more"
        ),
    )


def _max_step(value: float) -> float:
    """Longest step, s, 0 for no limit."""
    if isinstance(value, Real) and value in (0, np.inf):
        return 0.0
    return _require_positive("max_step", value, "a time above zero in s, or 0 for no limit")


def _checked_tangent(settings: Settings) -> str:
    require_word("tangent", settings.tangent, f"one of {', '.join(TANGENTS)}")
    check_tangent(settings.method, settings.tangent)
    return settings.tangent


def _checked_radius(method: str, value: float) -> float:
    spectral_radius = finite_float("radius", value, "a spectral radius from 0 to 1")
    check_radius(method, spectral_radius)
    return spectral_radius


def _require_positive(name: str, value: float, expected: str) -> float:
    number = finite_float(name, value, expected)
    if not number > 0:
        raise SceneError(f"{name} = {number:g}: expected {expected}")
    return number


def _check_output_times(times: tuple[float, ...] | None, t_start: float, t_end: float) -> None:
    """Raise SceneError for output times outside the run."""
    if times and (times[0] < t_start or times[-1] > t_end):
        raise SceneError(
            f"output_times from {times[0]:g} to {times[-1]:g} s: expected times between "
            f"t_start = {t_start:g} and t_end = {t_end:g}"
        )
