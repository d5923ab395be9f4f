"""Is a fixed step short enough for an explicit method?  The motions at a state, and what steps make
of them.

One step multiplies a motion, an eigenvalue lambda of the Jacobian of the right-hand side, by the
method's stability function R(h lambda) (Hairer and Wanner, Solving Ordinary Differential Equations
II, 1996, IV.2).  That is asked along the eigenvalue itself: how far a method is stable depends on
the direction.  A step that is short enough at the start may be too long later, where springs have
become stiffer or speeds larger; behind a run some of its samples are looked at.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure
from mstmm.risk import Risk

from ..engine.eigenvalues import MAX_DENSE_STATES, Complex, eigenvalues, fastest_eigenvalue
from ..engine.looped_engine import LoopedEngine
from ..integrate.steppers import get
from . import classical_run, external_integrators
from .scene_system import SceneSystem

if TYPE_CHECKING:
    from ..integrate.settings import Settings
    from ..integrate.steppers import Tableau
    from .trajectory import Trajectory


#: Growth over the whole run, or the part of it that a sample stands for, that counts as unstable,
#: of a motion that does not grow by itself.
_GROWTH = 1.1

#: Samples of a run that are looked at.
_SAMPLES = 8

#: h |lambda| beyond which no explicit method is stable.
_FARTHEST = 12.0

#: The step that is named instead, in the longest one that is stable: motions may become faster.
_SURE = 0.9


@dataclass(frozen=True)
class StepCheck:
    """A fixed step against the motions at one time of a run: against the one that it amplifies
    most, else against the fastest one.

    Attributes:
        step: s.
        rate: |lambda| of that motion, 1/s.
        product: h |lambda|.
        amplification: |R(h lambda)|, the factor of that motion in one step.
        growth: the same over the part of the run that the time stands for, inf beyond numbers.
        hinge: whose efforts drive that motion most, a hinge or a flexible body.
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
        """That the step is too long; None where it is not."""
        if self.growth <= _GROWTH:
            return None
        when = "the start" if self.time is None else f"t = {self.time:.4g} s"
        return Risk(
            "step-stability", f'{self.kind} "{self.hinge}"',
            f"step = {self.step:.4g} s is too long for the fastest motion at {when} "
            f'({self.kind} "{self.hinge}", {self.rate:.4g} 1/s): one step multiplies it by '
            f"{self.amplification:.3g}, for h |lambda| = {self.product:.3g} is beyond the "
            f"{self.stable_step * self.rate:.3g} up to which the method is stable there",
            f"take a step below {_SURE * self.stable_step:.2g} s or leave step out for a method "
            "that chooses it",
            self.product, self.stable_step * self.rate, before=self.time is None,
        )  # fmt: skip

    def blamed(self, message: str) -> str:
        """Why a run failed, with the step named first where it is too long: what such a run runs
        into says nothing of the scene."""
        risk = self.risk
        if risk is None:
            return message
        cause, *rest = message.split("; ")
        after = "".join(f"; {part}" for part in rest if part.startswith("last good state"))
        return f"{risk}; the run with it ended: {cause}{after}"


def check_step(engine: LoopedEngine, settings: Settings, q: Array, u: Array) -> StepCheck | None:
    """Check of a fixed step at the start (nq,), (nu,); None for adaptive runs, for implicit
    methods and the classical one, and where nothing moves."""
    tableau = _explicit(engine, settings)
    if tableau is None:
        return None
    system = SceneSystem(engine)
    y = system.start(settings.t_start, q, u)[: engine.nq + engine.nu]
    span = settings.t_end - settings.t_start
    return _checked(engine, tableau, settings, (settings.t_start, y, system.memory), span)


def check_later(engine: LoopedEngine, run: Trajectory) -> StepCheck | None:
    """The first of some samples of a run at which the step is too long; None where there is none,
    and for states of more than DENSE components."""
    tableau = _explicit(engine, run.settings)
    if tableau is None or engine.nq + engine.nu > MAX_DENSE_STATES:
        return None
    places = np.unique(np.linspace(0, len(run.t) - 1, _SAMPLES + 1)[1:].astype(int))
    for k in places if len(run.t) > 1 else ():
        state = float(run.t[k]), np.concatenate([run.q[k], run.u[k]]), run.memory[k]
        span = float(run.t[k] - run.t[0]) / _SAMPLES
        found = _checked(engine, tableau, run.settings, state, span)
        if found is not None and found.risk is not None:
            return replace(found, time=state[0])
    return None


def _explicit(engine: LoopedEngine, settings: Settings) -> Tableau | None:
    """The method of fixed explicit steps of a scene that moves; None for other runs."""
    others = (*classical_run.METHODS, *external_integrators.METHODS)
    if settings.step is None or settings.method in others or engine.nu == 0:
        return None
    tableau = get(settings.method)
    return None if tableau.implicit else tableau


def _checked(
    engine: LoopedEngine,
    tableau: Tableau,
    settings: Settings,
    state: tuple[float, Array, Array],
    span: float,
) -> StepCheck | None:
    """The check at a state (t, y, memory), over a time (s); None where nothing moves."""
    assert settings.step is not None
    step, (t, y, memory) = settings.step, state
    span = max(span, step)
    try:
        values, vectors = eigenvalues(engine, t, y, memory)
        growth = _growth(tableau, values, step, span)
        k = int(growth.argmax() if growth.max() > np.log(_GROWTH) else np.abs(values).argmax())
        kind, name = _element(engine, t, y, memory, vectors[engine.nq :, k])
    except (NumericalFailure, np.linalg.LinAlgError):  # the run itself will say what is wrong
        return None
    rate = float(abs(values[k]))
    if not rate > 0.0 or not np.isfinite(rate):
        return None
    with np.errstate(over="ignore"):  # a step may be too long beyond numbers
        factor, over_all = np.exp([growth[k] * step / span, growth[k]]).tolist()
    return StepCheck(
        step, rate, step * rate, factor, over_all, name,
        _longest(tableau, complex(values[k]), span), kind,
    )  # fmt: skip


def find_fastest_motion(engine: LoopedEngine, q: Array, u: Array) -> tuple[float, str] | None:
    """|lambda| (1/s) of the fastest motion at the state q (nq,), u (nu,), and the hinge or flexible
    body that drives it most, in words; None where nothing moves or the state cannot be evaluated.
    """
    if not engine.nu:
        return None
    y, memory = np.concatenate([q, u]), engine.start_memory()
    try:
        value, vector = fastest_eigenvalue(engine, 0.0, y, memory)
        kind, name = _element(engine, 0.0, y, memory, vector[engine.nq :])
    except (NumericalFailure, np.linalg.LinAlgError):
        return None
    rate = float(abs(value))
    return (rate, f'{kind} "{name}"') if np.isfinite(rate) and rate > 0.0 else None


def _element(
    engine: LoopedEngine, t: float, y: Array, memory: Array, speeds: Complex
) -> tuple[str, str]:
    """Kind and name of the hinge or flexible body that drives a motion (nu, complex) most."""
    shares, layout = _shares(engine, t, y, memory, speeds), engine.packed.layout
    most = max(layout.owners, key=lambda s: float(shares[s.u_slice].sum()))
    return "flexible body" if most.name in layout.modal else "hinge", most.name


def _growth(tableau: Tableau, values: Complex, step: ArrayLike, span: float) -> Array:
    """Logarithm (n,) of what steps (s) multiply motions (n, complex) by over a time (s), inf where
    that is beyond numbers."""
    steps = np.asarray(step)
    with np.errstate(all="ignore"):
        grown = np.log(np.abs(tableau.amplification(steps * values))) * span / steps
    return np.asarray(np.where(np.isnan(grown), np.inf, grown))


def _shares(engine: LoopedEngine, t: float, y: Array, memory: Array, speeds: Complex) -> Array:
    """(nu,) how much each speed's own effort drives the motion v (nu, complex): |v_k (M v)_k|.

    lambda M v is the effort behind a motion v exp(lambda t): zero along speeds without spring or
    damper, however much these are moved along.
    """
    q, u = y[: engine.nq].copy(), y[engine.nq : engine.nq + engine.nu].copy()

    def efforts(udot: Array) -> Array:
        return engine.inverse_dynamics(t, q, u, np.ascontiguousarray(udot), memory)

    rest = efforts(np.zeros(engine.nu))
    moved = efforts(speeds.real) - rest + 1j * (efforts(speeds.imag) - rest)
    return np.asarray(np.abs(speeds * moved))


def _longest(tableau: Tableau, value: complex, span: float) -> float:
    """The longest step (s) up to which a motion does not grow over a time (s)."""
    low, width = 0.0, _FARTHEST / abs(value)
    for _ in range(3):  # the first unstable of a thousand steps, then a thousand times finer
        steps = low + width * np.arange(1, 1001) / 1000
        grows = _growth(tableau, np.full(1000, value), steps, span) > np.log(_GROWTH)
        if not grows.any():
            return float(steps[-1])
        low, width = float(steps[grows.argmax()]) - width / 1000, width / 1000
    return low
