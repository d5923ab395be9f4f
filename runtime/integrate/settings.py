"""Settings of a run, and their validation for all integrators."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from numbers import Real

import numpy as np
from numpy.typing import ArrayLike

from mstmm.arguments import word_of
from mstmm.arrays import numbers, real, whole
from mstmm.defaults import ATOL, METHOD, RTOL
from mstmm.errors import SceneError

from .steppers import AUTO, AUTO_EXPLICIT, TANGENTS, check_radius, check_tangent

#: Smaller absolute tolerances are raised to this: squares of scaled errors must not overflow.
_LEAST = 1e-100


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


def times_of(output_times: ArrayLike | Sequence[float] | None) -> tuple[float, ...] | None:
    """Output times (s) as a tuple, also from a single number.

    Raises SceneError for times that do not increase and for a single integer, which could be a
    number of samples.
    """
    if output_times is None:
        return None
    found = numbers("output_times", output_times)
    if found.ndim == 0 and np.asarray(output_times).dtype.kind in "iu":
        n = int(found)
        raise SceneError(
            f"output_times = {n}: expected times in s, found an integer, which may be a time "
            f"or a number of samples; write [{n:.1f}] for one sample at {n} s, or "
            f"numpy.linspace(t_start, t_end, {max(n, 2)}) for equally spaced samples"
        )
    if found.ndim > 1:
        raise SceneError(f"output_times have shape {found.shape}, expected (n,): times in s")
    times = np.atleast_1d(found)
    rises = times[1:] > times[:-1]
    if not rises.all():
        falls = np.flatnonzero(~rises)
        before, after = times[falls[0]], times[falls[0] + 1]
        raise SceneError(
            f"output_times: {after:g} s follows {before:g} s; expected increasing times in s"
        )
    return tuple(times.tolist())


def checked(settings: Settings) -> Settings:
    """Validate settings and convert them to plain finite numbers.

    Raises SceneError that names the first invalid one.
    """
    t_start = real("t_start", settings.t_start, "a time in s")
    t_end = real("t_end", settings.t_end, "a time in s, not before t_start")
    if t_end < t_start:
        raise SceneError(f"t_end = {t_end:g}: expected a time in s, not before t_start")
    word_of("method", settings.method, "a name such as dop853")
    word_of("scheme", settings.scheme, "a name such as hht:0.3")
    if settings.method == AUTO and settings.step is not None:
        raise SceneError(
            f'step = {settings.step!r}: method "{AUTO}" chooses its steps; omit step, or name a '
            "method"
        )
    _times_within(settings.output_times, t_start, t_end)
    longest = settings.max_step
    if settings.step is not None and _longest(longest):
        raise SceneError(
            f"max_step = {longest!r}: limits steps that the method chooses, but step = "
            f"{settings.step!r} fixes all steps; omit one of the two"
        )
    return replace(
        settings,
        t_start=t_start, t_end=t_end,
        rtol=_above_zero("rtol", settings.rtol, "a relative tolerance above zero"),
        atol=max(_LEAST, _above_zero("atol", settings.atol, "an absolute tolerance above zero")),
        step=None if settings.step is None
        else _above_zero("step", settings.step, "a time above zero, in s"),
        max_step=_longest(longest),
        max_steps=whole(
            "max_steps", settings.max_steps, 0, "a whole number of steps, or 0 for no limit"
        ),
        tangent=_tangent(settings),
        radius=None if settings.radius is None else _radius(settings.method, settings.radius),
        iterations=whole(
            "iterations", settings.iterations, 1, "a whole number of iterations, 1 or more"
        ),
    )  # fmt: skip


def _longest(value: float) -> float:
    """Longest step, s, 0 for no limit."""
    if isinstance(value, Real) and value in (0, np.inf):
        return 0.0
    return _above_zero("max_step", value, "a time above zero in s, or 0 for no limit")


def _tangent(settings: Settings) -> str:
    word_of("tangent", settings.tangent, f"one of {', '.join(TANGENTS)}")
    check_tangent(settings.method, settings.tangent)
    return settings.tangent


def _radius(method: str, value: float) -> float:
    found = real("radius", value, "a spectral radius from 0 to 1")
    check_radius(method, found)
    return found


def _above_zero(name: str, value: float, expected: str) -> float:
    found = real(name, value, expected)
    if not found > 0:
        raise SceneError(f"{name} = {found:g}: expected {expected}")
    return found


def _times_within(times: tuple[float, ...] | None, t_start: float, t_end: float) -> None:
    """Raise SceneError for output times outside the run."""
    if times and (times[0] < t_start or times[-1] > t_end):
        raise SceneError(
            f"output_times from {times[0]:g} to {times[-1]:g} s: expected times between "
            f"t_start = {t_start:g} and t_end = {t_end:g}"
        )
