"""Other programs: curves of settings from loose to tight, whose runs return the end position.

SciPy's and SUNDIALS' methods get mstmm's compiled equations and their exact Jacobian (as in
`benchmarks.stiff`).  Pinocchio's accelerations are integrated by DOP853 in C, as are those of an
algorithm written with CasADi; MuJoCo and Exudyn use their own integrators.  Programs that
are not installed or cannot model a scene are reported.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

import mstmm

from ..common.links import Tree, link_tree
from ..common.native import Subject
from ..stiff import programs
from ..stiff.cases import Case
from ..stiff.programs import Curve, Equations, Outcome
from .cases import TREES

Report = Callable[[str], None]

TOLERANCES = tuple(10.0 ** (-k / 2) for k in range(4, 27))
#: Fixed steps per second, of methods of order 4 and 6.
FOURTH_ORDER_RATES, SIXTH_ORDER_RATES = (
    tuple(10 ** (k / 4) for k in range(*ends)) for ends in ((6, 18), (4, 15))
)  # fmt: skip
#: Names of programs.
NAMES = {
    "casadi_curves": "CasADi",
    "pinocchio_curves": "Pinocchio",
    "mujoco_curves": "MuJoCo",
    "exudyn_curves": "Exudyn",
}
#: Most links of which straight-line C is compiled.
_MAX_BAKED_LINKS = 30
#: Evaluations by which the fastest of several builds is chosen.
_LOOPS = 2000


def case_curves(model: mstmm.Model, case: Case, report: Report) -> list[Curve]:
    """Curves of all programs."""
    curves = programs.radau_curves(model, case) + dop853_curves(model, case)
    curves += programs.cvode_curves(model, case, report) + programs.exudyn_curves(case, report)
    if case.name not in TREES:
        report(_missing_reason(case))
        return curves
    tree = link_tree(case.scene())
    for builder in (casadi_curves, pinocchio_curves, mujoco_curves, exudyn_curves):
        try:
            curves += builder(model, case, tree)
        except (ImportError, SystemExit):
            report(f"{NAMES[builder.__name__]}: not installed")
    return curves


def _missing_reason(case: Case) -> str:
    """Reason why programs for rigid trees cannot model a scene."""
    if "beam" in case.scene():
        return (
            "Pinocchio, MuJoCo, Exudyn: no beams with such shapes (Exudyn's cables are another "
            "model: benchmarks/flexible)"
        )
    if case.bushings is not None:
        return "Pinocchio, MuJoCo: no bushings in a plane"
    return "Pinocchio, MuJoCo, Exudyn: no equivalent hinges with springs in six directions"


def has_fixed_steps(curve: Curve) -> bool:
    """Whether its settings are fixed steps, s, and no tolerances."""
    return curve.tool == "MuJoCo" or (curve.tool == "Exudyn" and curve.variant != "DOPRI5")


def dop853_curves(model: mstmm.Model, case: Case) -> list[Curve]:
    """SciPy's DOP853 on mstmm's equations."""
    from scipy.integrate import solve_ivp

    equations = Equations(model, case)

    def run(rtol: float) -> Outcome:
        solution = solve_ivp(
            equations.calls.rates, (0.0, case.t_end), equations.start, method="DOP853", rtol=rtol,
            atol=equations.atol(rtol, 1.0), t_eval=[case.t_end],
        )  # fmt: skip
        if not solution.success:
            raise RuntimeError(solution.message)
        return lambda: equations.end_positions(solution.y[:, -1]), {"rates": solution.nfev}

    return [Curve("SciPy DOP853", "explicit", [(t, partial(run, t)) for t in TOLERANCES])]


# --- own accelerations or integrators -----------------------------------------------------------


def pinocchio_curves(model: mstmm.Model, case: Case, tree: Tree) -> list[Curve]:
    """Its articulated-body algorithm in C++ inside DOP853 in C."""
    from ..common import pinocchio_peer as peer

    q, u = model.initial_state()
    builds = peer.subjects(tree, q[None], u[None], rates=True)
    return [
        _dop853_curve("Pinocchio", builds, model, case, lambda q: peer.scene_coordinates(tree, q))
    ]


def casadi_curves(model: mstmm.Model, case: Case, tree: Tree) -> list[Curve]:
    """An articulated-body algorithm as its straight-line C, inside DOP853 in C."""
    if len(tree.links) > _MAX_BAKED_LINKS:
        return []
    from ..common import casadi_peer as peer

    q, u = model.initial_state()
    builds = peer.subjects(tree, q[None], u[None], baked=True, sines=("", "libm"))
    return [_dop853_curve("CasADi C", builds, model, case, lambda q: q)]


def _dop853_curve(
    tool: str, builds: dict[str, Subject], model: mstmm.Model, case: Case,
    convert_q: Callable[[np.ndarray], np.ndarray],
) -> Curve:  # fmt: skip
    """Accelerations of a tool, fastest build, inside DOP853 in C; `convert_q` returns mstmm's
    coordinates."""
    from ..common import dop853 as native

    name = min(builds, key=lambda k: min(builds[k].time(True, _LOOPS) for _ in range(3)))
    subject = builds[name]

    def run(tolerance: float) -> Outcome:
        state, calls = native.run(subject, case.t_end, tolerance)
        return lambda: end_position(model, case, convert_q(state[: model.nq])), {"rates": calls}

    return Curve(tool, f"DOP853 in C, {name}", [(t, partial(run, t)) for t in TOLERANCES])


def mujoco_curves(model: mstmm.Model, case: Case, tree: Tree) -> list[Curve]:
    """Its Runge-Kutta method of fourth order, all but smooth dynamics switched off."""
    from ..common import mujoco_peer as peer

    q, u = model.initial_state()
    runner = peer.MujocoRun(tree)

    def run(steps: int) -> Outcome:
        read_end = runner.run(q, u, case.t_end, steps)
        return lambda: end_position(model, case, read_end), {"steps": steps}

    return [Curve("MuJoCo", "RK4", _step_settings(run, case, FOURTH_ORDER_RATES))]


def exudyn_curves(model: mstmm.Model, case: Case, tree: Tree) -> list[Curve]:
    """Its explicit methods in minimal coordinates: fixed steps, and Dormand and Prince's pair."""
    from exudyn import DynamicSolverType as Kinds

    from ..common import exudyn_peer as peer

    runner = peer.ExudynRun(tree, *model.initial_state())

    def read_end() -> np.ndarray:
        return end_position(model, case, peer.coordinates(tree, np.asarray(runner.end_state()[0])))

    def run_fixed(steps: int) -> Outcome:
        runner.run(case.t_end, steps, Kinds.RK67, 0.0)
        return read_end, {"steps": steps}

    def run_adaptive(tolerance: float) -> Outcome:
        runner.run(case.t_end, 20, Kinds.DOPRI5, tolerance)
        return read_end, {}

    return [
        Curve("Exudyn", "RK67", _step_settings(run_fixed, case, SIXTH_ORDER_RATES)),
        Curve("Exudyn", "DOPRI5", [(t, partial(run_adaptive, t)) for t in TOLERANCES[:-4:2]]),
    ]


def _step_settings(
    run: Callable[[int], Outcome], case: Case, rates: tuple[float, ...]
) -> list[tuple[float, Callable[[], Outcome]]]:
    counts = [max(1, round(case.t_end * rate)) for rate in rates]
    return [(case.t_end / count, partial(run, count)) for count in counts]


def end_position(model: mstmm.Model, case: Case, q: np.ndarray) -> np.ndarray:
    """(1, 3) of the watched end, m, at coordinates q."""
    state = np.asarray(q, dtype=float), np.zeros(model.nu)
    result = model.simulate(
        case.t_end, t_start=case.t_end, initial=state, output_times=[case.t_end]
    )
    return np.asarray(result.position(case.end_names[-1])[-1:])
