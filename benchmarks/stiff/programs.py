"""Programs and methods for a case: curves of settings from loose to tight.

Methods that this mstmm does not have and programs that are not installed are reported and left out.
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
from .references import Array, end_positions

#: Result of a run: function that returns the end positions (n, 3; m), and counts.
Outcome = tuple[Callable[[], Array], dict[str, int]]
Run = Callable[[], Outcome]

METHODS = (
    "dop853", "dopri5", "auto", "rodas4p2", "rodas5p", "rodas4", "ros34pw2", "genalpha", "dttmm",
    "esdirk436", "kvaerno5",
)  # fmt: skip
#: Methods that also run on the fused engine, and its largest number of speeds.
FUSED, MAX_FUSED_SPEEDS = ("dop853", "rodas4p2", "rodas5p"), 20
#: rtol; atol is a hundredth of it, for all programs.
TOLERANCES = tuple(10.0 ** (-k / 2) for k in range(3, 21))
#: Numbers of fixed steps.
STEPS = tuple(12 * 2**k for k in range(12))
#: Absolute tolerance of speeds over that of coordinates: with 1 the vibration of stiff springs,
#: which does not matter here, limits the steps of SciPy and CVODE.
SPEED_ATOL_FACTORS = (1.0, 1e2, 1e4)


@dataclass(frozen=True)
class Curve:
    """One tool in one manner: `settings` are (tolerance or step in s, run), loose to tight."""

    tool: str
    variant: str
    settings: Sequence[tuple[float, Run]]


def case_curves(case: Case, methods: Sequence[str], report: Callable[[str], None]) -> list[Curve]:
    """Curves of all programs; `report` receives the reasons of missing ones."""
    model = mstmm.compile(mstmm.Scene(**case.scene()), engine="looped")
    curves = [
        curve for name in methods if (curve := method_curve(model, case, name, report)) is not None
    ]
    curves += fused_curves(model, case, methods, report)
    return (
        curves
        + radau_curves(model, case)
        + cvode_curves(model, case, report)
        + exudyn_curves(case, report)
    )


def method_curve(
    model: mstmm.Model, case: Case, method: str, report: Callable[[str], None]
) -> Curve | None:
    """Curve of a method of mstmm, with one output time, the end."""

    def run(tolerance: float, step: float | None) -> Outcome:
        control: dict[str, Any] = {"rtol": tolerance, "atol": 1e-2 * tolerance}
        result = model.simulate(
            case.t_end, method=method, output_times=[case.t_end],
            **(control if step is None else {"step": step}),
        )  # fmt: skip
        if not result.success:
            raise RuntimeError(result.message)
        return lambda: end_positions(result, case), nonzero_counts(result.statistics)

    fixed_steps = has_fixed_steps(model, method)
    if isinstance(fixed_steps, str):
        report(f"left out: {fixed_steps}")
        return None
    if fixed_steps:
        steps = [case.t_end / count for count in STEPS]
        return Curve(method, "", [(h, partial(run, 1.0, h)) for h in steps])
    return Curve(method, "", [(t, partial(run, t, None)) for t in TOLERANCES])


def fused_curves(
    model: mstmm.Model, case: Case, methods: Sequence[str], report: Callable[[str], None]
) -> list[Curve]:
    """Curves of methods on the fused engine, where implicit steps have fused code."""
    if model.nu > MAX_FUSED_SPEEDS:
        return []
    fused_model = mstmm.compile(mstmm.Scene(**case.scene()), engine="fused")
    curves = [method_curve(fused_model, case, name, report) for name in FUSED if name in methods]
    return [dataclasses.replace(c, tool=f"{c.tool}, fused") for c in curves if c is not None]


def has_fixed_steps(model: mstmm.Model, method: str) -> bool | str:
    """Whether a method has fixed steps only; a message if it cannot run this scene."""
    reason = ""
    for step in (None, 1.0):
        try:
            model.simulate(0.0, method=method, step=step, output_times=[0.0])
        except mstmm.MstmmError as error:
            reason = str(error).partition(";")[0]
        else:
            return step is not None
    return reason


def nonzero_counts(statistics: object) -> dict[str, int]:
    """Nonzero integers of the statistics of a run."""
    if statistics is None or not dataclasses.is_dataclass(statistics):
        return {}
    return {name: value for name, value in vars(statistics).items()
            if type(value) is int and value}  # fmt: skip


# --- SciPy and SUNDIALS ---------------------------------------------------------------------------


class Equations:
    """mstmm's equations and their exact Jacobian for external integrators."""

    def __init__(self, model: mstmm.Model, case: Case) -> None:
        from mstmm.runtime.run.event_location import Equations as Calls

        self.model, self.case, self.calls = model, case, Calls(model)
        self.start = self.calls.scene.start(0.0, *model.initial_state())
        # The work of loads and dampers is integrated too, but does not matter here.
        self.is_speed = np.concatenate(
            [np.zeros(model.nq), np.ones(len(self.start) - model.nq)]
        ).astype(bool)

    def atol(self, rtol: float, speed_factor: float) -> Array:
        """Absolute tolerance of each component."""
        return 1e-2 * rtol * np.where(self.is_speed, speed_factor, 1.0)

    def end_positions(self, y: Array) -> Array:
        """Positions of the ends at the end of the run."""
        nq, nu, t = self.model.nq, self.model.nu, self.case.t_end
        state = y[:nq], y[nq : nq + nu]
        return end_positions(
            self.model.simulate(t, t_start=t, initial=state, output_times=[t]), self.case
        )


def radau_curves(model: mstmm.Model, case: Case) -> list[Curve]:
    """SciPy's Radau on mstmm's equations; rods on bushings also in absolute coordinates with a
    sparse Jacobian, which is faster for many."""
    import scipy.integrate

    equations = Equations(model, case)

    def run(rtol: float, speed_factor: float) -> Outcome:
        solution = scipy.integrate.solve_ivp(
            equations.calls.rates, (0.0, case.t_end), equations.start, method="Radau",
            jac=equations.calls.jacobian, rtol=rtol, atol=equations.atol(rtol, speed_factor),
            t_eval=[case.t_end],
        )  # fmt: skip
        if not solution.success:
            raise RuntimeError(solution.message)
        counts = {"rates": solution.nfev, "jacobians": solution.njev, "factors": solution.nlu}
        return lambda: equations.end_positions(solution.y[:, -1]), counts

    curves = [
        _tolerance_curve("SciPy Radau", "exact Jacobian", run, speed_factor)
        for speed_factor in SPEED_ATOL_FACTORS
    ]
    if case.bushings is not None:
        from .absolute_coordinates import BushedRods

        rods = BushedRods(*case.bushings)

        def sparse(rtol: float, speed_factor: float) -> Outcome:
            return rods.run(case.t_end, rtol, speed_factor)

        curves += [
            _tolerance_curve("SciPy Radau", "absolute, sparse", sparse, speed_factor)
            for speed_factor in SPEED_ATOL_FACTORS
        ]
    return curves


def cvode_curves(model: mstmm.Model, case: Case, report: Callable[[str], None]) -> list[Curve]:
    """CVODE's BDF on mstmm's equations with the exact Jacobian."""
    try:
        from sksundae.cvode import CVODE
    except ImportError:
        report("left out: CVODE, package scikit-sundae is missing")
        return []
    equations = Equations(model, case)
    call_counts = {"rates": 0, "jacobians": 0}

    def rates(t: float, y: Array, out: Array) -> None:
        call_counts["rates"] += 1
        out[:] = equations.calls.rates(t, y)

    def jacobian(t: float, y: Array, _: Array, out: Array) -> None:
        call_counts["jacobians"] += 1
        out[:] = equations.calls.jacobian(t, y)

    def run(rtol: float, speed_factor: float) -> Outcome:
        call_counts.update(rates=0, jacobians=0)
        solver = CVODE(
            rates, method="BDF", jacfn=jacobian, rtol=rtol, atol=equations.atol(rtol, speed_factor),
            max_num_steps=200_000,
        )  # fmt: skip
        solution = solver.solve([0.0, case.t_end], equations.start)
        if not solution.success:
            raise RuntimeError(solution.message)
        end = np.array(solution.y[-1], dtype=float)
        return lambda: equations.end_positions(end), dict(call_counts)

    return [
        _tolerance_curve("CVODE BDF", "exact Jacobian", run, speed_factor)
        for speed_factor in SPEED_ATOL_FACTORS
    ]


def _tolerance_curve(
    tool: str, variant: str, run: Callable[[float, float], Outcome], speed_factor: float
) -> Curve:
    settings = [(t, partial(run, t, speed_factor)) for t in TOLERANCES]
    return Curve(tool, f"{variant}, atol of speeds x {speed_factor:g}", settings)


def exudyn_curves(case: Case, report: Callable[[str], None]) -> list[Curve]:
    """Exudyn's generalised-alpha on rods, in its cheapest variants."""
    if case.bushings is None and case.dampers is None:
        return []
    try:
        from .exudyn_rods import Rods, Variant
    except ImportError:
        report("left out: Exudyn, package exudyn is missing")
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
            variant = Variant(radius, newton)
            settings = [(case.t_end / n, partial(rods.run, case.t_end, n, variant)) for n in STEPS]
            curves.append(Curve("Exudyn", str(variant), settings))
    return curves
