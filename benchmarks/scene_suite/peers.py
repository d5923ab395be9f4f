"""Peers of a case: curves of settings from loose to tight, each run giving the watched end's place.

SciPy's and SUNDIALS' methods get mstmm's compiled equations and their exact Jacobian (as in
`benchmarks.stiff`).  Pinocchio's accelerations are integrated by DOP853 in C, as are those of an
algorithm written with CasADi; MuJoCo and Exudyn integrate by themselves.  One that is not
installed, or has no such scene, is left out with a word.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

import mstmm

from ..common.links import Tree, links_of
from ..common.native import Subject
from ..stiff import programs
from ..stiff.cases import Case
from ..stiff.programs import Curve, Equations, Outcome
from .cases import TREES

Say = Callable[[str], None]

TOLERANCES = tuple(10.0 ** (-k / 2) for k in range(4, 27))
#: Steps a second where they are fixed, of methods of order 4 and 6.
FOURTH, SIXTH = (
    tuple(10 ** (k / 4) for k in range(*ends)) for ends in ((6, 18), (4, 15))
)  # fmt: skip
#: What tools are called, by their functions here.
NAMES = {"casadi": "CasADi", "pinocchio": "Pinocchio", "mujoco": "MuJoCo", "exudyn": "Exudyn"}
#: Most links of which straight-line C is compiled.
_MOST_BAKED = 30
#: Evaluations by which the fastest of several builds is chosen.
_LOOPS = 2000


def of_case(model: mstmm.Model, case: Case, say: Say) -> list[Curve]:
    """Everybody who can."""
    curves = programs.radau(model, case) + dop853(model, case)
    curves += programs.cvode(model, case, say) + programs.exudyn(case, say)
    if case.name not in TREES:
        say(_others(case))
        return curves
    tree = links_of(case.scene())
    for maker in (casadi, pinocchio, mujoco, exudyn):
        try:
            curves += maker(model, case, tree)
        except (ImportError, SystemExit):
            say(f"{NAMES[maker.__name__]}: not installed")
    return curves


def _others(case: Case) -> str:
    """Why tools for rigid trees do not run a scene, as far as nothing was said yet."""
    if "beam" in case.scene():
        return (
            "Pinocchio, MuJoCo, Exudyn: no beams with such shapes (Exudyn's cables are another "
            "model: benchmarks/flexible)"
        )
    if case.bushings is not None:
        return "Pinocchio, MuJoCo: no bushings in a plane"
    return "Pinocchio, MuJoCo, Exudyn: no hinges of springs in six directions that act as ours do"


def takes_steps(curve: Curve) -> bool:
    """Whether its settings are fixed steps, s, and no tolerances."""
    return curve.tool == "MuJoCo" or (curve.tool == "Exudyn" and curve.manner != "DOPRI5")


def dop853(model: mstmm.Model, case: Case) -> list[Curve]:
    """SciPy's DOP853 on mstmm's equations."""
    from scipy.integrate import solve_ivp

    equations = Equations(model, case)

    def run(rtol: float) -> Outcome:
        found = solve_ivp(
            equations.calls.rates, (0.0, case.t_end), equations.start, method="DOP853", rtol=rtol,
            atol=equations.atol(rtol, 1.0), t_eval=[case.t_end],
        )  # fmt: skip
        if not found.success:
            raise RuntimeError(found.message)
        return lambda: equations.places(found.y[:, -1]), {"rates": found.nfev}

    return [Curve("SciPy DOP853", "explicit", [(t, partial(run, t)) for t in TOLERANCES])]


# --- with accelerations, or all, of their own -----------------------------------------------------


def pinocchio(model: mstmm.Model, case: Case, tree: Tree) -> list[Curve]:
    """Its articulated-body algorithm in C++ inside DOP853 in C."""
    from ..common import pinocchio_peer as peer

    q, u = model.initial_state()
    builds = peer.subjects(tree, q[None], u[None], rates=True)
    return [_by_dop853("Pinocchio", builds, model, case, lambda q: peer.back(tree, q))]


def casadi(model: mstmm.Model, case: Case, tree: Tree) -> list[Curve]:
    """An articulated-body algorithm as its straight-line C, inside DOP853 in C."""
    if len(tree.links) > _MOST_BAKED:
        return []
    from ..common import casadi_peer as peer

    q, u = model.initial_state()
    builds = peer.subjects(tree, q[None], u[None], baked=True, sines=("", "libm"))
    return [_by_dop853("CasADi C", builds, model, case, lambda q: q)]


def _by_dop853(
    tool: str, builds: dict[str, Subject], model: mstmm.Model, case: Case,
    back: Callable[[np.ndarray], np.ndarray],
) -> Curve:  # fmt: skip
    """Accelerations of a tool, of several builds the fastest, inside DOP853 in C; `back` gives our
    coordinates from its own."""
    from ..common import dop853 as native

    name = min(builds, key=lambda k: min(builds[k].time(True, _LOOPS) for _ in range(3)))
    subject = builds[name]

    def run(tolerance: float) -> Outcome:
        state, calls = native.run(subject, case.t_end, tolerance)
        return lambda: place(model, case, back(state[: model.nq])), {"rates": calls}

    return Curve(tool, f"DOP853 in C, {name}", [(t, partial(run, t)) for t in TOLERANCES])


def mujoco(model: mstmm.Model, case: Case, tree: Tree) -> list[Curve]:
    """Its Runge-Kutta method of fourth order, all but smooth dynamics switched off."""
    from ..common import mujoco_peer as peer

    q, u = model.initial_state()
    runner = peer.MujocoRun(tree)

    def run(steps: int) -> Outcome:
        end = runner.run(q, u, case.t_end, steps)
        return lambda: place(model, case, end), {"steps": steps}

    return [Curve("MuJoCo", "RK4", _stepped(run, case, FOURTH))]


def exudyn(model: mstmm.Model, case: Case, tree: Tree) -> list[Curve]:
    """Its explicit methods in minimal coordinates: fixed steps, and Dormand and Prince's pair."""
    from exudyn import DynamicSolverType as Kinds

    from ..common import exudyn_peer as peer

    runner = peer.ExudynRun(tree, *model.initial_state())

    def end() -> np.ndarray:
        return place(model, case, peer.coordinates(tree, np.asarray(runner.end()[0])))

    def fixed(steps: int) -> Outcome:
        runner.run(case.t_end, steps, Kinds.RK67, 0.0)
        return end, {"steps": steps}

    def adaptive(tolerance: float) -> Outcome:
        runner.run(case.t_end, 20, Kinds.DOPRI5, tolerance)
        return end, {}

    return [
        Curve("Exudyn", "RK67", _stepped(fixed, case, SIXTH)),
        Curve("Exudyn", "DOPRI5", [(t, partial(adaptive, t)) for t in TOLERANCES[:-4:2]]),
    ]


def _stepped(
    run: Callable[[int], Outcome], case: Case, rates: tuple[float, ...]
) -> list[tuple[float, Callable[[], Outcome]]]:
    counts = [max(1, round(case.t_end * rate)) for rate in rates]
    return [(case.t_end / count, partial(run, count)) for count in counts]


def place(model: mstmm.Model, case: Case, q: np.ndarray) -> np.ndarray:
    """(1, 3) of the watched end, m, at coordinates q."""
    state = np.asarray(q, dtype=float), np.zeros(model.nu)
    result = model.simulate(
        case.t_end, t_start=case.t_end, initial=state, output_times=[case.t_end]
    )
    return np.asarray(result.position(case.watched[-1])[-1:])
