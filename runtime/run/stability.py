"""Is a fixed step short enough for an explicit method?  The motions at a state, and what steps make
of them.

Motions are the eigenvalues of the Jacobian of the right-hand side, taken by central differences;
for a hinge with stiffness k, damping c and effective inertia mu the fastest is about
c/mu + sqrt(k/mu).  One step multiplies a motion by the method's stability function R(h lambda)
(Hairer and Wanner, Solving Ordinary Differential Equations II, 1996, IV.2), which is asked along
the eigenvalue itself: how far a method is stable depends on the direction.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from mstmm.arrays import Array
from mstmm.errors import NumericalFailure
from mstmm.risk import Risk

from ..engine.engine import Engine
from ..integrate.steppers import get
from . import classical, second_opinion
from .system import SceneSystem

if TYPE_CHECKING:
    from ..integrate.settings import Settings
    from ..integrate.steppers import Tableau


#: Growth over the whole run that counts as unstable, of a motion that does not grow by itself.
_GROWTH = 1.1

#: h |lambda| beyond which no explicit method is stable.
_FARTHEST = 12.0

#: The step that is named instead, in the longest one that is stable: motions may become faster.
_SURE = 0.9

#: States with more components than this get their fastest motion from a Krylov method.
_DENSE = 160


@dataclass(frozen=True)
class StepCheck:
    """A fixed step against the motions at the start of a run: against the one that it amplifies
    most, else against the fastest one.

    Attributes:
        step: s.
        rate: |lambda| of that motion, 1/s.
        product: h |lambda|.
        amplification: |R(h lambda)|, the factor of that motion in one step.
        growth: the same over the whole run, inf where that is beyond numbers.
        hinge: whose efforts drive that motion most, a hinge or a flexible body.
        stable_step: the longest step up to which that motion does not grow, s.
        kind: "hinge" or "flexible body".
    """

    step: float
    rate: float
    product: float
    amplification: float
    growth: float
    hinge: str
    stable_step: float
    kind: str = "hinge"

    @property
    def risk(self) -> Risk | None:
        """That the step is too long; None where it is not."""
        if self.growth <= _GROWTH:
            return None
        return Risk(
            "step-stability", f'{self.kind} "{self.hinge}"',
            f"step = {self.step:.4g} s is too long for the fastest motion at the start "
            f'({self.kind} "{self.hinge}", {self.rate:.4g} 1/s): one step multiplies it by '
            f"{self.amplification:.3g}, for h |lambda| = {self.product:.3g} is beyond the "
            f"{self.stable_step * self.rate:.3g} up to which the method is stable there",
            f"take a step below {_SURE * self.stable_step:.2g} s or leave step out for a method "
            "that chooses it",
            self.product, self.stable_step * self.rate, before=True,
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


def check_step(engine: Engine, settings: Settings, q: Array, u: Array) -> StepCheck | None:
    """Check of a fixed step at the start (nq,), (nu,); None for adaptive runs, for implicit
    methods and the classical one, and where nothing moves."""
    others = (*classical.METHODS, *second_opinion.METHODS)
    if settings.step is None or settings.method in others or engine.nu == 0:
        return None
    tableau = get(settings.method)
    if tableau.implicit:
        return None
    system = SceneSystem(engine)
    y, memory = system.start(settings.t_start, q, u)[: engine.nq + engine.nu], system.memory
    span = max(settings.t_end - settings.t_start, settings.step)
    try:
        values, vectors = motions(engine, settings.t_start, y, memory)
        growth = _growth(tableau, values, settings.step, span)
        k = int(growth.argmax() if growth.max() > np.log(_GROWTH) else np.abs(values).argmax())
        shares = _shares(engine, settings.t_start, y, memory, vectors[engine.nq :, k])
    except (NumericalFailure, np.linalg.LinAlgError):  # the run itself will say what is wrong
        return None
    rate = float(abs(values[k]))
    if not rate > 0.0 or not np.isfinite(rate):
        return None
    layout = engine.packed.layout
    hinge = max(layout.owners, key=lambda s: float(shares[s.u_slice].sum()))
    with np.errstate(over="ignore"):  # a step may be too long beyond numbers
        factor, over_run = np.exp([growth[k] * settings.step / span, growth[k]]).tolist()
    return StepCheck(
        settings.step, rate, settings.step * rate, factor, over_run, hinge.name,
        _longest(tableau, complex(values[k]), span),
        "flexible body" if hinge.name in layout.modal else "hinge",
    )  # fmt: skip


def _growth(tableau: Tableau, values: Array, step: ArrayLike, span: float) -> Array:
    """Logarithm (n,) of what steps (s) multiply motions (n, complex) by over a time (s), inf where
    that is beyond numbers."""
    steps = np.asarray(step)
    with np.errstate(all="ignore"):
        grown = np.log(np.abs(tableau.amplification(steps * values))) * span / steps
    return np.asarray(np.where(np.isnan(grown), np.inf, grown))


def _shares(engine: Engine, t: float, y: Array, memory: Array, speeds: Array) -> Array:
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


def fastest(engine: Engine, t: float, y: Array, memory: Array) -> tuple[complex, Array]:
    """(lambda, eigenvector (nq + nu)) of the fastest motion at a state that does not just grow."""
    values, vectors = motions(engine, t, y, memory)
    k = int(np.abs(values).argmax())
    return complex(values[k]), np.asarray(vectors[:, k])


def motions(engine: Engine, t: float, y: Array, memory: Array) -> tuple[Array, Array]:
    """(lambda (k,), eigenvectors (nq + nu, k)) of the motions at a state, 0 for those that just
    grow and without what others grow; of large scenes the fastest one alone."""
    n = len(y)
    sizes = np.maximum(1e-6, 1e-6 * np.abs(y))
    if n <= _DENSE:
        values, vectors = np.linalg.eig(_differences(engine, t, y, memory, np.diag(sizes)) / sizes)
    else:
        values, vectors = _krylov(engine, t, y, memory)
    grows = values.real > np.abs(values.imag)  # by itself, not by the method
    kept = np.minimum(values.real, 0.0) + 1j * values.imag
    return np.where(grows, 0.0, kept), vectors


def _differences(engine: Engine, t: float, y: Array, memory: Array, moves: Array) -> Array:
    """Central differences (n, k) of the right-hand side along the columns of `moves` (n, k)."""
    rates = _rates(engine, t, np.concatenate([y + moves.T, y - moves.T]), memory)
    half = len(rates) // 2
    return np.asarray((rates[:half] - rates[half:]).T / 2)


def _rates(engine: Engine, t: float, states: Array, memory: Array) -> Array:
    """Right-hand sides (k, n) of states (k, n)."""
    q, u = (np.ascontiguousarray(x) for x in np.split(states, [engine.nq], axis=1))
    return np.hstack(engine.accelerations(t, q, u, np.tile(memory, (len(states), 1))))


def _krylov(engine: Engine, t: float, y: Array, memory: Array) -> tuple[Array, Array]:
    """The fastest motion alone, from products of the Jacobian with vectors."""
    from scipy.sparse.linalg import ArpackError, ArpackNoConvergence, LinearOperator, eigs

    n, rest = len(y), _rates(engine, t, y[None], memory)[0]

    def product(vector: Any) -> Array:
        size = float(np.linalg.norm(vector)) or 1.0
        move = 1e-6 * np.sqrt(n) * np.asarray(vector, dtype=float).reshape(1, n) / size
        change = _rates(engine, t, y + move, memory)[0] - rest  # a hundredth is all that is asked
        return np.asarray(change * size / (1e-6 * np.sqrt(n)))

    operator = LinearOperator((n, n), matvec=product, dtype=np.float64)
    start = np.random.default_rng(0).standard_normal(n)
    nothing = np.zeros(1, dtype=np.complex128), start[:, None]
    try:
        values, vectors = eigs(
            operator, k=1, which="LM", tol=1e-2, maxiter=40, v0=start, ncv=min(n, 12)
        )
    except ArpackNoConvergence as error:
        values, vectors = error.eigenvalues, error.eigenvectors
    except ArpackError:  # a motion without any rate: nothing that a step could be too long for
        return nothing
    return (values, vectors) if len(values) else nothing
