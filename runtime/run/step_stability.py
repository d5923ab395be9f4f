"""Stability check of fixed steps of an explicit method against the eigenvalues at a state.

One step multiplies the motion of an eigenvalue lambda of the Jacobian of the right-hand side by the
method's stability function R(h lambda) (Hairer and Wanner, Solving Ordinary Differential Equations
II, 1996, IV.2).  The stable step is searched along the ray of the eigenvalue, because the stability
limit depends on its direction.  A step that is stable at the start may be too long later, where
springs are stiffer or speeds larger; after a run some of its samples are checked.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure
from mstmm.risk import Risk

from ..engine.jacobian import MAX_DENSE_STATES, Complex, eigenvalues, fastest_eigenvalue
from ..engine.looped_engine import LoopedEngine
from ..integrate.steppers import get
from . import classical_run, external_integrators
from .scene_system import SceneSystem

if TYPE_CHECKING:
    from ..integrate.settings import Settings
    from ..integrate.steppers import Tableau
    from .trajectory import Trajectory


#: Growth due to the method, over the whole run or the part that a sample represents, that counts as
#: unstable.
_UNSTABLE_GROWTH = 1.1

#: Number of samples of a run that are checked.
_SAMPLES = 8

#: h |lambda| beyond which no explicit method is stable.
_MAX_PRODUCT = 12.0

#: Recommended step relative to the longest stable one: motions may become faster.
_STEP_MARGIN = 0.9


@dataclass(frozen=True)
class StepCheck:
    """Check of a fixed step against the critical motion at one time of a run.

    The critical motion is the one that the step amplifies most; if none grows, the fastest one.

    Attributes:
        step: s.
        rate: |lambda| of the critical motion, 1/s.
        product: h |lambda|.
        amplification: |R(h lambda)|, the factor of that motion in one step.
        growth: the factor over the part of the run that the time represents; inf on overflow.
        hinge: hinge or flexible body whose efforts drive that motion most.
        stable_step: the longest step up to which that motion does not grow, s.
        kind: "hinge" or "flexible body".
        time: s; None for the start.
    """

    step: float
    rate: float
    product: float
    amplification: float
    growth: float
    hinge: str
    stable_step: float
    kind: str = "hinge"
    time: float | None = None

    @property
    def risk(self) -> Risk | None:
        """Risk that the step is too long; None where it is stable."""
        if self.growth <= _UNSTABLE_GROWTH:
            return None
        when = "the start" if self.time is None else f"t = {self.time:.4g} s"
        return Risk(
            "step-stability", f'{self.kind} "{self.hinge}"',
            f"step = {self.step:.4g} s is too long for the fastest motion at {when} "
            f'({self.kind} "{self.hinge}", {self.rate:.4g} 1/s): one step multiplies it by '
            f"{self.amplification:.3g}, because h |lambda| = {self.product:.3g} exceeds the "
            f"stability limit {self.stable_step * self.rate:.3g} of the method",
            f"use a step below {_STEP_MARGIN * self.stable_step:.2g} s, or leave step out for a "
            "method that chooses it",
            self.product, self.stable_step * self.rate, seen_before_run=self.time is None,
        )  # fmt: skip

    def explain_failure(self, message: str) -> str:
        """Message of a failed run, preceded by the risk of the step where that is too long.

        The failure itself is then an effect of the step, not of the scene.
        """
        risk = self.risk
        if risk is None:
            return message
        cause, *parts = message.split("; ")
        last_state = "".join(f"; {part}" for part in parts if part.startswith("last good state"))
        return f"{risk}; the run with it ended: {cause}{last_state}"


def check_step(engine: LoopedEngine, settings: Settings, q: Array, u: Array) -> StepCheck | None:
    """Check of a fixed step at the start (nq,), (nu,).

    None for adaptive runs, for implicit and classical methods, and where nothing moves.
    """
    tableau = _fixed_explicit_method(engine, settings)
    if tableau is None:
        return None
    system = SceneSystem(engine)
    y = system.start(settings.t_start, q, u)[: engine.nq + engine.nu]
    span = settings.t_end - settings.t_start
    return _check_state(engine, tableau, settings, (settings.t_start, y, system.memory), span)


def check_later(engine: LoopedEngine, run: Trajectory) -> StepCheck | None:
    """First check after the start that finds the step too long, at a few samples of a run.

    None without one, and for states of more than MAX_DENSE_STATES components.
    """
    tableau = _fixed_explicit_method(engine, run.settings)
    if tableau is None or engine.nq + engine.nu > MAX_DENSE_STATES:
        return None
    samples = np.unique(np.linspace(0, len(run.t) - 1, _SAMPLES + 1)[1:].astype(int))
    for k in samples if len(run.t) > 1 else ():
        state = float(run.t[k]), np.concatenate([run.q[k], run.u[k]]), run.memory[k]
        span = float(run.t[k] - run.t[0]) / _SAMPLES
        check = _check_state(engine, tableau, run.settings, state, span)
        if check is not None and check.risk is not None:
            return replace(check, time=state[0])
    return None


def _fixed_explicit_method(engine: LoopedEngine, settings: Settings) -> Tableau | None:
    """Method of a run with fixed explicit steps of a scene that can move; None for other runs."""
    other_methods = (*classical_run.METHODS, *external_integrators.METHODS)
    if settings.step is None or settings.method in other_methods or engine.nu == 0:
        return None
    tableau = get(settings.method)
    return None if tableau.implicit else tableau


def _check_state(
    engine: LoopedEngine,
    tableau: Tableau,
    settings: Settings,
    state: tuple[float, Array, Array],
    span: float,
) -> StepCheck | None:
    """Check at a state (t, y, memory) over a time span (s); None where nothing moves."""
    assert settings.step is not None
    step, (t, y, memory) = settings.step, state
    span = max(span, step)
    try:
        values, vectors = eigenvalues(engine, t, y, memory)
        growth = _log_growth(tableau, values, step, span)
        grows = growth.max() > np.log(_UNSTABLE_GROWTH)
        k = int(growth.argmax() if grows else np.abs(values).argmax())
        kind, name = _driving_element(engine, t, y, memory, vectors[engine.nq :, k])
    except (NumericalFailure, np.linalg.LinAlgError):  # the run itself reports the failure
        return None
    rate = float(abs(values[k]))
    if not rate > 0.0 or not np.isfinite(rate):
        return None
    with np.errstate(over="ignore"):  # growth may overflow for a step far too long
        step_factor, span_factor = np.exp([growth[k] * step / span, growth[k]]).tolist()
    return StepCheck(
        step, rate, step * rate, step_factor, span_factor, name,
        _longest_stable_step(tableau, complex(values[k]), span), kind,
    )  # fmt: skip


def find_fastest_motion(engine: LoopedEngine, q: Array, u: Array) -> tuple[float, str] | None:
    """|lambda| (1/s) of the fastest motion at a state q (nq,), u (nu,), and what drives it most.

    The latter is text such as 'hinge "pin"' or 'flexible body "beam"'.  None where nothing moves or
    the state cannot be evaluated.
    """
    if not engine.nu:
        return None
    y, memory = np.concatenate([q, u]), engine.start_memory()
    try:
        value, vector = fastest_eigenvalue(engine, 0.0, y, memory)
        kind, name = _driving_element(engine, 0.0, y, memory, vector[engine.nq :])
    except (NumericalFailure, np.linalg.LinAlgError):
        return None
    rate = float(abs(value))
    return (rate, f'{kind} "{name}"') if np.isfinite(rate) and rate > 0.0 else None


def _driving_element(
    engine: LoopedEngine, t: float, y: Array, memory: Array, speeds: Complex
) -> tuple[str, str]:
    """Kind and name of the hinge or flexible body that drives a motion (nu, complex) most."""
    shares, layout = _effort_shares(engine, t, y, memory, speeds), engine.packed.layout
    element = max(layout.owners, key=lambda slots: float(shares[slots.u_slice].sum()))
    return "flexible body" if element.name in layout.modal else "hinge", element.name


def _log_growth(tableau: Tableau, values: Complex, step: ArrayLike, span: float) -> Array:
    """Logarithm (n,) of the growth factors of eigenvalues (n, complex) over a time span (s).

    Factors of the method with the given steps (s); inf on overflow.
    """
    steps = np.asarray(step)
    with np.errstate(all="ignore"):
        log_growth = np.log(np.abs(tableau.amplification(steps * values))) * span / steps
    return np.asarray(np.where(np.isnan(log_growth), np.inf, log_growth))


def _effort_shares(
    engine: LoopedEngine, t: float, y: Array, memory: Array, speeds: Complex
) -> Array:
    """Share (nu,) of each speed's effort in driving the motion v (nu, complex): |v_k (M v)_k|.

    lambda M v is the effort of the motion v exp(lambda t): zero along speeds without spring or
    damper, however large these are.
    """
    q, u = y[: engine.nq].copy(), y[engine.nq : engine.nq + engine.nu].copy()

    def efforts(udot: Array) -> Array:
        return engine.inverse_dynamics(t, q, u, np.ascontiguousarray(udot), memory)

    bias = efforts(np.zeros(engine.nu))
    inertia_efforts = efforts(speeds.real) - bias + 1j * (efforts(speeds.imag) - bias)
    return np.asarray(np.abs(speeds * inertia_efforts))


def _longest_stable_step(tableau: Tableau, value: complex, span: float) -> float:
    """Longest step (s) up to which the motion of an eigenvalue does not grow over a span (s)."""
    low, width = 0.0, _MAX_PRODUCT / abs(value)
    for _ in range(3):  # the first unstable of a thousand steps, then a thousand times finer
        steps = low + width * np.arange(1, 1001) / 1000
        growth = _log_growth(tableau, np.full(1000, value), steps, span)
        grows = growth > np.log(_UNSTABLE_GROWTH)
        if not grows.any():
            return float(steps[-1])
        low, width = float(steps[grows.argmax()]) - width / 1000, width / 1000
    return low
