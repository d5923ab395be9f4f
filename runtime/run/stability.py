"""Is a fixed step short enough for an explicit method?  The fastest motion at a state, and the
amplification of one step on it.

The fastest motion is the eigenvalue of largest modulus of the Jacobian of the right-hand side,
taken by central differences.  For a hinge with stiffness k, damping c and effective inertia mu it
is about c/mu + sqrt(k/mu).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

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


#: h |lambda| above which a fixed step of an explicit method is not trusted.
LIMIT = 2.5

#: Growth of a decaying motion per step that counts as unstable.
_GROWTH = 1.01

#: States with more components than this get their fastest motion from a Krylov method.
_DENSE = 160


@dataclass(frozen=True)
class StepCheck:
    """A fixed step against the fastest motion at the start of a run.

    Attributes:
        step: s.
        rate: |lambda| of the fastest motion, 1/s.
        product: h |lambda|.
        amplification: |R(h lambda)|, the factor of that motion in one step.
        hinge: whose efforts drive that motion most, a hinge or a flexible body.
        stable_step: the longest step that is stable for it and keeps h |lambda| <= LIMIT, s.
        kind: "hinge" or "flexible body".
    """

    step: float
    rate: float
    product: float
    amplification: float
    hinge: str
    stable_step: float
    kind: str = "hinge"

    @property
    def risk(self) -> Risk | None:
        """That the step is too long; None where it is not."""
        if self.product <= LIMIT and self.amplification <= _GROWTH:
            return None
        return Risk(
            "step-stability", f'{self.kind} "{self.hinge}"',
            f"step = {self.step:.4g} s is too long for the fastest motion at the start "
            f'({self.kind} "{self.hinge}", {self.rate:.4g} 1/s): h |lambda| = {self.product:.3g}, '
            f"one step multiplies it by {self.amplification:.3g}",
            f"take a step below {self.stable_step:.3g} s or leave step out for a method that "
            "chooses it",
            self.product, LIMIT, before=True,
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
    try:
        value, vector = fastest(engine, settings.t_start, y, memory)
        shares = _shares(engine, settings.t_start, y, memory, vector[engine.nq :])
    except (NumericalFailure, np.linalg.LinAlgError):  # the run itself will say what is wrong
        return None
    value = complex(min(value.real, 0.0), value.imag)
    rate = abs(value)
    if not rate > 0.0 or not np.isfinite(rate):
        return None
    layout = engine.packed.layout
    hinge = max(layout.owners, key=lambda s: float(shares[s.u_slice].sum()))
    with np.errstate(over="ignore", invalid="ignore"):  # a step may be too long beyond numbers
        factor = float(abs(tableau.amplification(settings.step * value)))
    return StepCheck(
        settings.step, rate, settings.step * rate, factor, hinge.name, _longest(tableau, value),
        "flexible body" if hinge.name in layout.modal else "hinge",
    )  # fmt: skip


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


def _longest(tableau: Tableau, value: complex) -> float:
    """The first step at which the motion grows, at most LIMIT / |lambda|."""
    products = np.linspace(0.0, LIMIT, 501)[1:]
    grows = np.abs(tableau.amplification(products * value / abs(value))) > _GROWTH
    longest = products[grows.argmax() - 1] if grows.any() else LIMIT
    return float(longest / abs(value))


def fastest(engine: Engine, t: float, y: Array, memory: Array) -> tuple[complex, Array]:
    """(lambda, eigenvector (nq + nu)) of the fastest motion at a state that does not just grow."""
    n = len(y)
    sizes = np.maximum(1e-6, 1e-6 * np.abs(y))
    if n <= _DENSE:
        values, vectors = np.linalg.eig(_differences(engine, t, y, memory, np.diag(sizes)) / sizes)
        grows = values.real > np.abs(values.imag)  # by itself, not by the method
        k = int(np.where(grows, 0.0, np.abs(values)).argmax())
        return complex(values[k]), np.asarray(vectors[:, k])
    return _krylov(engine, t, y, memory)


def _differences(engine: Engine, t: float, y: Array, memory: Array, moves: Array) -> Array:
    """Central differences (n, k) of the right-hand side along the columns of `moves` (n, k)."""
    rates = _rates(engine, t, np.concatenate([y + moves.T, y - moves.T]), memory)
    half = len(rates) // 2
    return np.asarray((rates[:half] - rates[half:]).T / 2)


def _rates(engine: Engine, t: float, states: Array, memory: Array) -> Array:
    """Right-hand sides (k, n) of states (k, n)."""
    q, u = (np.ascontiguousarray(x) for x in np.split(states, [engine.nq], axis=1))
    return np.hstack(engine.accelerations(t, q, u, np.tile(memory, (len(states), 1))))


def _krylov(engine: Engine, t: float, y: Array, memory: Array) -> tuple[complex, Array]:
    """The same for large states, from products of the Jacobian with vectors."""
    from scipy.sparse.linalg import ArpackError, ArpackNoConvergence, LinearOperator, eigs

    n, rest = len(y), _rates(engine, t, y[None], memory)[0]

    def product(vector: Any) -> Array:
        size = float(np.linalg.norm(vector)) or 1.0
        move = 1e-6 * np.sqrt(n) * np.asarray(vector, dtype=float).reshape(1, n) / size
        change = _rates(engine, t, y + move, memory)[0] - rest  # a hundredth is all that is asked
        return np.asarray(change * size / (1e-6 * np.sqrt(n)))

    operator = LinearOperator((n, n), matvec=product, dtype=np.float64)
    start = np.random.default_rng(0).standard_normal(n)
    try:
        values, vectors = eigs(
            operator, k=1, which="LM", tol=1e-2, maxiter=40, v0=start, ncv=min(n, 12)
        )
    except ArpackNoConvergence as error:
        values, vectors = error.eigenvalues, error.eigenvectors
    except ArpackError:  # a motion without any rate: nothing that a step could be too long for
        return 0j, start
    if not len(values):
        return 0j, start
    return complex(values[0]), np.asarray(vectors[:, 0])
