"""Who integrates a case, and how: curves of settings from loose to tight.

Methods of mstmm are taken by name; one that this mstmm does not know is left out with a word, so
that new ones take part as soon as they exist.  A peer that is not installed is left out alike.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

import mstmm

from .cases import Case
from .references import Array, places

#: What a run leaves: how to look where the watched ends are (n, 3; m), and what was counted.
Outcome = tuple[Callable[[], Array], dict[str, int]]
Run = Callable[[], Outcome]

METHODS = (
    "dop853", "dopri5", "auto", "rodas4p2", "rodas5p", "rodas4", "ros34pw2", "genalpha", "dttmm",
    "esdirk436", "kvaerno5",
)  # fmt: skip
#: Those that run on code of the scene's own too, and up to how many speeds there is any.
FUSED, MOST_FUSED = ("dop853", "rodas4p2", "rodas5p"), 20
#: rtol; atol is a hundredth of it, for everybody.
TOLERANCES = tuple(10.0 ** (-k / 2) for k in range(3, 21))
#: How many steps where they are fixed.
STEPS = tuple(12 * 2**k for k in range(12))
#: Absolute tolerance of speeds in that of coordinates: without slack the vibration of stiff
#: springs, which nobody asked for, sets the steps of SciPy and CVODE.
SLACKS = (1.0, 1e2, 1e4)


@dataclass(frozen=True)
class Curve:
    """One tool in one manner: `settings` are (tolerance or step in s, run), loose to tight."""

    tool: str
    manner: str
    settings: Sequence[tuple[float, Run]]


def of_case(case: Case, methods: Sequence[str], say: Callable[[str], None]) -> list[Curve]:
    """Everybody who can; `say` hears who cannot."""
    model = mstmm.compile(mstmm.Scene(**case.scene()), engine="looped")
    found = [curve for name in methods if (curve := own(model, case, name, say)) is not None]
    found += fused(model, case, methods, say)
    return found + radau(model, case) + cvode(model, case, say) + exudyn(case, say)


def own(model: mstmm.Model, case: Case, method: str, say: Callable[[str], None]) -> Curve | None:
    """A method of mstmm by its name, as a user calls it, one sample at the end."""

    def run(tolerance: float, step: float | None) -> Outcome:
        control: dict[str, Any] = {"rtol": tolerance, "atol": 1e-2 * tolerance}
        result = model.simulate(
            case.t_end, method=method, output_times=[case.t_end],
            **(control if step is None else {"step": step}),
        )  # fmt: skip
        if not result.success:
            raise RuntimeError(result.message)
        return lambda: places(result, case), counted(result.statistics)

    fixed = takes_steps(model, method)
    if isinstance(fixed, str):
        say(f"left out: {fixed}")
        return None
    if fixed:
        steps = [case.t_end / count for count in STEPS]
        return Curve(method, "", [(h, partial(run, 1.0, h)) for h in steps])
    return Curve(method, "", [(t, partial(run, t, None)) for t in TOLERANCES])


def fused(
    model: mstmm.Model, case: Case, methods: Sequence[str], say: Callable[[str], None]
) -> list[Curve]:
    """Methods on code of the scene's own, compiled before, where implicit steps have such code."""
    if model.nu > MOST_FUSED:
        return []
    compiled = mstmm.compile(mstmm.Scene(**case.scene()), engine="fused")
    curves = [own(compiled, case, name, say) for name in FUSED if name in methods]
    return [dataclasses.replace(c, tool=f"{c.tool}, fused") for c in curves if c is not None]


def takes_steps(model: mstmm.Model, method: str) -> bool | str:
    """Whether a method knows fixed steps alone; a sentence if this scene cannot be run by it."""
    refused = ""
    for step in (None, 1.0):
        try:
            model.simulate(0.0, method=method, step=step, output_times=[0.0])
        except mstmm.MstmmError as error:
            refused = str(error).partition(";")[0]
        else:
            return step is not None
    return refused


def counted(statistics: object) -> dict[str, int]:
    """The whole numbers of a run's statistics that are not zero."""
    if statistics is None or not dataclasses.is_dataclass(statistics):
        return {}
    return {name: value for name, value in vars(statistics).items()
            if type(value) is int and value}  # fmt: skip


# --- SciPy and SUNDIALS ---------------------------------------------------------------------------


class Equations:
    """mstmm's equations and their exact Jacobian, set up once, for integrators of others."""

    def __init__(self, model: mstmm.Model, case: Case) -> None:
        from mstmm.runtime.run.external_integrators import Equations as Calls

        self.model, self.case, self.calls = model, case, Calls(model)
        self.start = self.calls.scene.start(0.0, *model.initial_state())
        # The work of loads and dampers is integrated along; nobody asked for it here.
        self.slack = np.concatenate(
            [np.zeros(model.nq), np.ones(len(self.start) - model.nq)]
        ).astype(bool)

    def atol(self, rtol: float, slack: float) -> Array:
        """Of every component."""
        return 1e-2 * rtol * np.where(self.slack, slack, 1.0)

    def places(self, y: Array) -> Array:
        """Of the watched ends at the end."""
        nq, nu, t = self.model.nq, self.model.nu, self.case.t_end
        state = y[:nq], y[nq : nq + nu]
        return places(self.model.simulate(t, t_start=t, initial=state, output_times=[t]), self.case)


def radau(model: mstmm.Model, case: Case) -> list[Curve]:
    """SciPy's Radau on mstmm's equations; rods on bushings also in absolute coordinates with a
    sparse Jacobian, which is faster for many."""
    import scipy.integrate

    equations = Equations(model, case)

    def run(rtol: float, slack: float) -> Outcome:
        found = scipy.integrate.solve_ivp(
            equations.calls.rates, (0.0, case.t_end), equations.start, method="Radau",
            jac=equations.calls.jacobian, rtol=rtol, atol=equations.atol(rtol, slack),
            t_eval=[case.t_end],
        )  # fmt: skip
        if not found.success:
            raise RuntimeError(found.message)
        counts = {"rates": found.nfev, "jacobians": found.njev, "factors": found.nlu}
        return lambda: equations.places(found.y[:, -1]), counts

    curves = [_slackened("SciPy Radau", "exact Jacobian", run, slack) for slack in SLACKS]
    if case.bushings is not None:
        from .absolute import BushedRods

        rods = BushedRods(*case.bushings)

        def sparse(rtol: float, slack: float) -> Outcome:
            return rods.run(case.t_end, rtol, slack)

        curves += [_slackened("SciPy Radau", "absolute, sparse", sparse, slack) for slack in SLACKS]
    return curves


def cvode(model: mstmm.Model, case: Case, say: Callable[[str], None]) -> list[Curve]:
    """CVODE's BDF on mstmm's equations with the exact Jacobian."""
    try:
        from sksundae.cvode import CVODE
    except ImportError:
        say("left out: CVODE, for want of the package scikit-sundae")
        return []
    equations = Equations(model, case)
    calls = {"rates": 0, "jacobians": 0}

    def rates(t: float, y: Array, out: Array) -> None:
        calls["rates"] += 1
        out[:] = equations.calls.rates(t, y)

    def jacobian(t: float, y: Array, _: Array, out: Array) -> None:
        calls["jacobians"] += 1
        out[:] = equations.calls.jacobian(t, y)

    def run(rtol: float, slack: float) -> Outcome:
        calls.update(rates=0, jacobians=0)
        solver = CVODE(
            rates, method="BDF", jacfn=jacobian, rtol=rtol, atol=equations.atol(rtol, slack),
            max_num_steps=200_000,
        )  # fmt: skip
        found = solver.solve([0.0, case.t_end], equations.start)
        if not found.success:
            raise RuntimeError(found.message)
        end = np.array(found.y[-1], dtype=float)
        return lambda: equations.places(end), dict(calls)

    return [_slackened("CVODE BDF", "exact Jacobian", run, slack) for slack in SLACKS]


def _slackened(
    tool: str, manner: str, run: Callable[[float, float], Outcome], slack: float
) -> Curve:
    settings = [(t, partial(run, t, slack)) for t in TOLERANCES]
    return Curve(tool, f"{manner}, atol of speeds x {slack:g}", settings)


def exudyn(case: Case, say: Callable[[str], None]) -> list[Curve]:
    """Exudyn's generalised-alpha on rods, in manners that were among its cheapest."""
    if case.bushings is None and case.dampers is None:
        return []
    try:
        from .exudyn_rods import Manner, Rods
    except ImportError:
        say("left out: Exudyn, for want of the package exudyn")
        return []
    if case.bushings is not None:
        count, *bushing = case.bushings
        rods = Rods(count, bushings=(bushing[0], bushing[1]))
    else:
        assert case.dampers is not None
        rods = Rods(case.dampers[0], damper=case.dampers[1])
    curves = []
    for radius in (0.5, 0.8, 1.0):
        for newton in ("modified", "once a step"):
            manner = Manner(radius, newton)
            settings = [(case.t_end / n, partial(rods.run, case.t_end, n, manner)) for n in STEPS]
            curves.append(Curve("Exudyn", str(manner), settings))
    return curves
