"""Programs and their settings: label -> setting -> run that returns q at the end."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np
from common import aba, casadi_peer, dop853, mujoco_peer, pinocchio_peer
from common.links import Tree

import mstmm

Run = Callable[[], np.ndarray]
Settings = dict[str, Run]
TOLERANCES = [10.0**-k for k in np.arange(4, 14.01, 0.5)]


def initial_state(scene: dict[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    """Initial q and u of a scene."""
    hinges = [hinge["initial"] for hinge in scene["hinge"]]
    return tuple(np.concatenate([np.asarray(h[x], float) for h in hinges]) for x in ("q", "u"))


def mstmm_runs(scene: dict[str, Any], t_end: float) -> Settings:
    """Whole calls of `simulate` with one output time, the end."""
    model = mstmm.compile(mstmm.Scene(**scene), engine="fused")

    def run(tolerance: float, method: str) -> np.ndarray:
        result = model.simulate(
            t_end, method=method, rtol=tolerance, atol=tolerance, output_times=[t_end]
        )
        if not result.success:
            raise RuntimeError(result.message)
        return result.q[-1]

    return {f"{method} {t:.1e}": lambda t=t, m=method: run(t, m)
            for method in ("dop853", "pirk13") for t in TOLERANCES}  # fmt: skip


def dop853_runs(subjects: dict[str, Any], t_end: float, count: int) -> Settings:
    """DOP853 in C around the fastest of several builds of a function."""
    name = min(subjects, key=lambda k: min(subjects[k].time(True, 2000) for _ in range(5)))
    subject = subjects[name]
    return {f"{name} {t:.1e}": lambda t=t: dop853.run(subject, t_end, t)[0][:count]
            for t in TOLERANCES}  # fmt: skip


def cvodes_runs(tree: Tree, q: np.ndarray, u: np.ndarray, t_end: float) -> Settings:
    """CasADi's CVODES on the same function with literals, compiled just in time."""
    function, _ = aba.articulated_body(tree, baked=True)
    x = ca.SX.sym("x", tree.nq + tree.nu)
    rates = function(ca.SX(0, 1), x[: tree.nq], x[tree.nq :], ca.SX.zeros(tree.nu))
    problem = {"x": x, "ode": ca.vertcat(*rates)}
    state = ca.DM(np.concatenate([q, u]))
    runs: Settings = {}
    for tolerance in [10.0**-k for k in (4, 5, 6, 7, 8, 9, 10, 10.5, 11, 11.5, 12, 12.5, 13)]:
        options = {
            "abstol": tolerance, "reltol": tolerance, "linear_multistep_method": "adams",
            "nonlinear_solver_iteration": "functional", "max_num_steps": 10**7, "jit": True,
            "compiler": "shell", "jit_cleanup": True,
            "jit_options": {"flags": ["-O3", "-march=native"], "verbose": False},
        }  # fmt: skip
        solver = ca.integrator("run", "cvodes", problem, 0.0, t_end, options)
        runs[f"{tolerance:.1e}"] = lambda s=solver: np.array(s(x0=state)["xf"]).ravel()
    return runs


def mujoco_runs(tree: Tree, q: np.ndarray, u: np.ndarray, t_end: float) -> Settings:
    """MuJoCo's RK4 with smooth dynamics only."""
    peer = mujoco_peer.MujocoRun(tree)
    counts = [int(t_end * 10**k) for k in np.arange(2, 4.01, 0.25)]
    return {f"RK4 h = {t_end / n:.1e}": lambda n=n: peer.run(q, u, t_end, n) for n in counts}


def exudyn_runs(tree: Tree, q: np.ndarray, u: np.ndarray, t_end: float) -> Settings:
    """Exudyn's explicit methods in minimal coordinates."""
    import exudyn as exu
    from common import exudyn_peer

    peer = exudyn_peer.ExudynRun(tree, q, u)

    def run(method: Any, steps: int, tolerance: float) -> np.ndarray:
        peer.run(t_end, steps, method, tolerance)
        return exudyn_peer.coordinates(tree, peer.end_state()[0])

    solver_types = exu.DynamicSolverType
    runs = {
        f"RK67 h = {t_end / n:.1e}": lambda n=n: run(solver_types.RK67, n, 0.0)
        for n in (int(t_end * 10**k) for k in np.arange(1.5, 3.76, 0.25))
    }
    for tolerance in TOLERANCES[:-2:2]:
        runs[f"DOPRI5 {tolerance:.0e}"] = lambda t=tolerance: run(solver_types.DOPRI5, 20, t)
    return runs


def drake_runs(tree: Tree, q: np.ndarray, u: np.ndarray, t_end: float) -> Settings:
    """Drake's fifth-order Runge-Kutta method with error control; its balls have angles."""
    from common import drake_peer, exudyn_peer

    exudyn_q, exudyn_u = exudyn_peer.exudyn_state(tree, q, u)
    has_balls = len(exudyn_q) != len(q)
    if has_balls:
        exudyn_q = exudyn_q.reshape(-1, 3)[:, ::-1].ravel()
        exudyn_u = drake_peer.inboard_speeds(exudyn_q, u)
    runs: Settings = {}
    for tolerance in [10.0**-k for k in (*range(3, 13), 12.5, 13)]:
        peer = drake_peer.DrakeRun(tree, exudyn_q, exudyn_u, t_end / 100, "runge_kutta5", tolerance)

        def run(peer: Any = peer) -> np.ndarray:
            peer.run(100)
            q_end = peer.plant.GetPositions(peer.context)
            if has_balls:
                q_end = q_end.reshape(-1, 3)[:, ::-1].ravel()
            return exudyn_peer.coordinates(tree, q_end)

        runs[f"RK5 {tolerance:.0e}"] = run
    return runs


def all_settings(
    scene: dict[str, Any], tree: Tree, q: np.ndarray, u: np.ndarray, t_end: float
) -> dict[str, Settings]:
    """Settings of all programs."""
    q_rows, u_rows = q[None], u[None]
    casadi = casadi_peer.subjects(tree, q_rows, u_rows, baked=True, sines=("", "libm"))
    pinocchio = pinocchio_peer.subjects(tree, q_rows, u_rows, rates=True)
    pinocchio_runs = dop853_runs(pinocchio, t_end, len(q))
    return {
        "mstmm": mstmm_runs(scene, t_end),
        "CasADi + CVODES": cvodes_runs(tree, q, u, t_end),
        "CasADi C + DOP853": dop853_runs(casadi, t_end, len(q)),
        "Pinocchio + DOP853": {
            k: lambda r=r: pinocchio_peer.scene_coordinates(tree, r())
            for k, r in pinocchio_runs.items()
        },
        "MuJoCo": mujoco_runs(tree, q, u, t_end),
        "Drake": drake_runs(tree, q, u, t_end),
        "Exudyn": exudyn_runs(tree, q, u, t_end),
    }
