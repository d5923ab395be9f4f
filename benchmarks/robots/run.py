"""Robots in URDF: accelerations in C, single calls, a hundred steps, time to the first result.

    python benchmarks/robots/run.py [--quick] [--plot]

Needs pin, mujoco and example-robot-data.  Minimum CPU time of alternating rounds in one process;
scenes are compiled beforehand.

- accelerations in C: each input depends on the previous output, as in an integrator; Pinocchio in
  the better of its two conventions.  The fingers of the panda are fixed.
- single calls from Python on one state: aba, rnea, crba, computeABADerivatives and
  computeFrameJacobian of the last link.
- 100 RK4 steps of 1 ms from Python: one `simulate` that returns the end, a session advanced 100
  times, and 100 mj_step from the same state (`difference`: of joint coordinates at the end).
- file to first: from the URDF text to accelerations at the initial state, compared with
  pin.buildModelFromUrdf, createData and aba; modules are imported beforehand.
"""

from __future__ import annotations

import statistics
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pinocchio as pin

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
sys.path.insert(0, str(HERE))

from common import links, measure, mstmm_engines, pinocchio_peer  # noqa: E402
from robots import ROBOTS, Case, mujoco_state, pinocchio_state  # noqa: E402

import mstmm  # noqa: E402

STEP, STEPS = 1e-3, 100
#: Calls per sample.
CALLS = 200
#: Fingers of the panda: the C++ builder of the other program has no prismatic joint.
FIXED_JOINTS = {"panda": ("panda_finger_joint1", "panda_finger_joint2")}
#: Call -> call that it is compared with, target of the ratio.
COMPARISONS = {
    "accelerations in C": ("Pinocchio in C++", 1.0),
    "accelerations": ("pin.aba", 1.0),
    "inverse_dynamics": ("pin.rnea", 1.0),
    "mass_matrix": ("pin.crba", 1.0),
    "derivatives": ("pin.computeABADerivatives", 1.5),
    "jacobian": ("pin.computeFrameJacobian", None),
    "simulate, 100 steps": ("100 mj_step", 0.5),
    "session, 100 ticks": ("100 mj_step", 0.5),
    "file to first": ("pin.buildModelFromUrdf, aba", 1.0),
}

Work = dict[str, Callable[[], float]]


def native_work(name: str) -> tuple[Work, float]:
    """Accelerations in C over 32 states."""
    robot = Case(name, FIXED_JOINTS.get(name, ()))
    tree = links.link_tree(_with_defaults(robot.imported_robot.tables))
    q, u = links.random_states(tree, 32)
    model = robot.model("fused")
    subjects = {"accelerations in C": mstmm_engines.fused_subject(model, q, u)}
    for variant, subject in pinocchio_peer.subjects(tree, q, u).items():
        subjects[f"Pinocchio in C++ {variant}"] = subject
    expected = model.accelerations(q, u)
    udots = [subject.accelerations() for subject in subjects.values()]
    difference = max(measure.relative_difference(udot, expected) for udot in udots)
    return {label: partial(_chained_seconds, x) for label, x in subjects.items()}, difference


def _chained_seconds(subject: Any) -> float:
    return float(subject.time(chained=True, rounds=200)) * 1e-9


def _with_defaults(tables: Any) -> dict[str, Any]:
    """Scene tables with explicit zeros for omitted keys."""
    defaults = {"center_of_mass": (0, 0, 0), "inertia": (0, 0, 0)}
    return {**tables, "body": [{**defaults, **body} for body in tables["body"]]}


def call_work(name: str) -> tuple[Work, float]:
    """Calls from Python, and the relative difference of the accelerations."""
    robot = Case(name)
    model, peer = robot.model("fused"), robot.pinocchio()
    data, (q, u) = peer.createData(), robot.initial_state()
    peer_q, peer_v, indices = pinocchio_state(robot, peer, q, u)
    zero_efforts, zero_udot = np.zeros(peer.nv), np.zeros(model.nu)
    link = next(f.name for f in reversed(peer.frames) if f.name in robot.imported_robot.links)
    frame, body_link = peer.getFrameId(link), robot.imported_robot.links[link]
    calls: dict[str, Callable[[], Any]] = {
        "accelerations": lambda: model.accelerations(q, u),
        "pin.aba": lambda: pin.aba(peer, data, peer_q, peer_v, zero_efforts),
        "inverse_dynamics": lambda: model.inverse_dynamics(q, u, zero_udot),
        "pin.rnea": lambda: pin.rnea(peer, data, peer_q, peer_v, zero_efforts),
        "mass_matrix": lambda: model.mass_matrix(q),
        "pin.crba": lambda: pin.crba(peer, data, peer_q),
        "derivatives": lambda: model.derivatives(q, u),
        "pin.computeABADerivatives": lambda: pin.computeABADerivatives(
            peer, data, peer_q, peer_v, zero_efforts
        ),
        "jacobian": lambda: model.jacobian(q, body_link),
        "pin.computeFrameJacobian": lambda: pin.computeFrameJacobian(
            peer, data, peer_q, frame, pin.LOCAL_WORLD_ALIGNED
        ),
    }
    for call in calls.values():
        for _ in range(CALLS):  # code is compiled after a number of calls
            call()
    own_udot, peer_udot = calls["accelerations"](), np.array(calls["pin.aba"]())
    joints = list(zip(*indices, strict=True))
    expected = max(1.0, *(abs(peer_udot[j]) for _, j in joints))
    difference = float(max(abs(own_udot[i] - peer_udot[j]) for i, j in joints) / expected)
    return {label: partial(_seconds_per_call, x) for label, x in calls.items()}, difference


def _seconds_per_call(call: Callable[[], Any]) -> float:
    return measure.cpu_time(lambda: [call() for _ in range(CALLS)]) / CALLS


def simulation_work(name: str) -> tuple[Work, float]:
    """100 steps by each program, and the largest difference of joint coordinates at the end."""
    robot = Case(name)
    model, peer = robot.model("fused"), robot.mujoco(STEP)
    q, u = robot.initial_state()
    t_end = STEP * STEPS
    simulate = partial(model.simulate, t_end, "rk4", STEP, output_times=[t_end], initial=(q, u))
    data = mujoco.MjData(peer)
    start = mujoco_state(robot, peer, q, u)

    def session_run() -> Any:
        session = model.session(q, u, method="rk4", step=STEP)
        for _ in range(STEPS):
            session.advance(STEP)
        return session

    def mujoco_run() -> Any:
        data.time, data.qpos[:], data.qvel[:] = 0.0, start.qpos, start.qvel
        for _ in range(STEPS):
            mujoco.mj_step(peer, data)
        return data

    own_q, stepped_q, peer_q = simulate().q[-1], session_run().q, mujoco_run().qpos
    joints = [(slots.q, peer.jnt_qposadr[joint]) for slots, joint in robot.joints(peer)]
    difference = float(max(abs(x[i] - peer_q[j]) for x in (own_q, stepped_q) for i, j in joints))
    calls = {
        "simulate, 100 steps": simulate,
        "session, 100 ticks": session_run,
        "100 mj_step": mujoco_run,
    }
    return {label: partial(measure.call_time, x) for label, x in calls.items()}, difference


def first_result_work(name: str) -> tuple[Work, float]:
    """From the file to accelerations."""
    robot = Case(name)
    mstmm.compile(mstmm.import_robot(robot.path, robot.root_joint).scene, engine="fused")

    def own_call() -> Any:
        model = mstmm.compile(mstmm.import_robot(robot.path, robot.root_joint).scene)
        return model.accelerations(*model.initial_state())

    def peer_call() -> Any:
        peer = robot.pinocchio()
        zero_udot = np.zeros(peer.nv)
        return pin.aba(peer, peer.createData(), pin.neutral(peer), zero_udot, zero_udot)

    calls = {"file to first": own_call, "pin.buildModelFromUrdf, aba": peer_call}
    return {label: partial(measure.call_time, call) for label, call in calls.items()}, float("nan")


PARTS = (native_work, call_work, simulation_work, first_result_work)


def measure_robots(quick: bool) -> list[dict[str, Any]]:
    """Seconds per call of all programs on all robots."""
    rows = []
    for name in ROBOTS:
        for part in PARTS:
            work, difference = part(name)
            for label, samples in measure.sample_rounds(work, 3 if quick else 40).items():
                rows.append({"robot": name, "call": label, "s": samples, "difference": difference})
                print(name, label, f"{1e6 * min(samples):.4g} us", flush=True)
    return rows


def fastest_peer(row: dict[str, Any], results: list[dict[str, Any]]) -> dict[str, Any]:
    """Row of the fastest call that a row is compared with."""
    rows = [r for r in results if r["robot"] == row["robot"]]
    peers = [r for r in rows if r["call"].startswith(COMPARISONS[row["call"]][0])]
    return min(peers, key=lambda r: min(r["s"]))


def table(results: list[dict[str, Any]]) -> str:
    """Markdown: a row per robot and call, ratio of the minima and of the medians."""
    lines = [
        "| robot | call | us | compared with | us | ratio | of medians | target | difference |",
        "|---" * 9 + "|",
    ]
    pairs = [(robot, call) for robot in ROBOTS for call in COMPARISONS]
    rows_by_pair = {(row["robot"], row["call"]): row for row in results}
    for row in (rows_by_pair[pair] for pair in pairs if pair in rows_by_pair):
        target, fastest = COMPARISONS[row["call"]][1], fastest_peer(row, results)
        min_ratio, median_ratio = (f(row["s"]) / f(fastest["s"]) for f in (min, statistics.median))
        difference = "" if np.isnan(row["difference"]) else f"{row['difference']:.1e}"
        limit = "" if target is None else f"{target:g}"
        lines.append(
            f"| {row['robot']} | {row['call']} | {1e6 * min(row['s']):.4g} | {fastest['call']} | "
            f"{1e6 * min(fastest['s']):.4g} | {min_ratio:.3g} | {median_ratio:.3g} | {limit} | "
            f"{difference} |"
        )
    return "\n".join(lines)


def main() -> None:
    """Measure, print the table."""
    options = measure.option_parser(str(__doc__).splitlines()[0], HERE).parse_args()
    if not options.plot:
        measure.save_record(options.json, measure_robots(options.quick))
    measure.write_table(options.json, table)


if __name__ == "__main__":
    main()
