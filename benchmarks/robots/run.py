"""Robots in URDF: accelerations in C, single calls, a hundred steps, from the file to an answer.

    python benchmarks/robots/run.py [--quick] [--plot] [--only single first]

Needs pin, mujoco and example-robot-data.  CPU time in alternating rounds of one process, the least
of the rounds; code of the scenes is compiled before.

- accelerations: functions in C, every input waiting on the last output, as in an integrator;
  Pinocchio in the better of its two conventions.  The fingers of the panda are held there.
- single calls from Python on states as NumPy arrays: aba, rnea, crba, computeABADerivatives and
  computeFrameJacobian of the last link, all with code of the scene compiled.
- 100 RK4 steps of 1 ms from Python: one `simulate` that gives the end, a session ticked a hundred
  times, and a hundred times mj_step, all from the same state to the same end (`apart`: of joints).
- file to first: the text of the robot to accelerations at its start, beside
  pin.buildModelFromUrdf, createData and aba; modules are imported and the scene's code is compiled.
"""

from __future__ import annotations

import json
import statistics
import sys
from collections.abc import Callable, Sequence
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
from robots import ROBOTS, Case, pinocchio_state, state_of  # noqa: E402

import mstmm  # noqa: E402

STEP, STEPS = 1e-3, 100
#: Calls of one sample.
CALLS = 200
#: Fingers of the panda, for the peer's builder in C++ knows no sliding joint.
HELD = {"panda": ("panda_finger_joint1", "panda_finger_joint2")}
#: What is asked -> who is beside, the largest ratio allowed.
BESIDE = {
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


def native(name: str) -> tuple[Work, float]:
    """Accelerations in C: ns a call over 32 states."""
    case = Case(name, HELD.get(name, ()))
    tree = links.links_of(_whole(case.imported.tables))
    q, u = links.states(tree, 32)
    model = case.model("fused")
    subjects = {"accelerations in C": mstmm_engines.fused(model, q, u)}
    for manner, subject in pinocchio_peer.subjects(tree, q, u).items():
        subjects[f"Pinocchio in C++ {manner}"] = subject
    wanted = model.accelerations(q, u)
    apart = max(measure.disagreement(x.accelerations(), wanted) for x in subjects.values())
    return {one: partial(_seconds, x) for one, x in subjects.items()}, apart


def _seconds(subject: Any) -> float:
    return float(subject.time(chained=True, rounds=200)) * 1e-9


def _whole(tables: Any) -> dict[str, Any]:
    """The tables of a scene with what is 0 by default."""
    bare = {"center_of_mass": (0, 0, 0), "inertia": (0, 0, 0)}
    return {**tables, "body": [{**bare, **body} for body in tables["body"]]}


def single(name: str) -> tuple[Work, float]:
    """Calls from Python, and how far accelerations lie apart."""
    case = Case(name)
    model, peer = case.model("fused"), case.pinocchio()
    data, (q, u) = peer.createData(), case.start()
    at, v, places = pinocchio_state(case, peer, q, u)
    push, still, aligned = np.zeros(peer.nv), np.zeros(model.nu), pin.LOCAL_WORLD_ALIGNED
    link = next(f.name for f in reversed(peer.frames) if f.name in case.imported.links)
    frame, of = peer.getFrameId(link), case.imported.links[link]
    calls: dict[str, Callable[[], Any]] = {
        "accelerations": lambda: model.accelerations(q, u),
        "pin.aba": lambda: pin.aba(peer, data, at, v, push),
        "inverse_dynamics": lambda: model.inverse_dynamics(q, u, still),
        "pin.rnea": lambda: pin.rnea(peer, data, at, v, push),
        "mass_matrix": lambda: model.mass_matrix(q),
        "pin.crba": lambda: pin.crba(peer, data, at),
        "derivatives": lambda: model.derivatives(q, u),
        "pin.computeABADerivatives": lambda: pin.computeABADerivatives(peer, data, at, v, push),
        "jacobian": lambda: model.jacobian(q, of),
        "pin.computeFrameJacobian": lambda: pin.computeFrameJacobian(
            peer, data, at, frame, aligned
        ),
    }
    for call in calls.values():
        for _ in range(CALLS):  # code that pays is made at calls whose number doubles
            call()
    ours, theirs = calls["accelerations"](), np.array(calls["pin.aba"]())
    joints = list(zip(*places, strict=True))
    wanted = max(1.0, *(abs(theirs[b]) for _, b in joints))
    apart = max(abs(ours[a] - theirs[b]) for a, b in joints) / wanted
    return {one: partial(_each, call) for one, call in calls.items()}, float(apart)


def _each(call: Callable[[], Any]) -> float:
    return measure.cpu(lambda: [call() for _ in range(CALLS)]) / CALLS


def runs(name: str) -> tuple[Work, float]:
    """A hundred steps by everybody, and how far joints lie apart in the end."""
    case = Case(name)
    model, peer = case.model("fused"), case.mujoco(STEP)
    q, u = case.start()
    end = STEP * STEPS
    simulate = partial(model.simulate, end, "rk4", STEP, output_times=[end], initial=(q, u))
    data = mujoco.MjData(peer)
    start = state_of(case, peer, q, u)

    def ticks() -> Any:
        session = model.session(q, u, method="rk4", step=STEP)
        for _ in range(STEPS):
            session.advance(STEP)
        return session

    def steps() -> Any:
        data.time, data.qpos[:], data.qvel[:] = 0.0, start.qpos, start.qvel
        for _ in range(STEPS):
            mujoco.mj_step(peer, data)
        return data

    ours, ticked, theirs = simulate().q[-1], ticks().q, steps().qpos
    joints = [(slots.q, peer.jnt_qposadr[joint]) for slots, joint in case.joints(peer)]
    apart = max(abs(x[a] - theirs[b]) for x in (ours, ticked) for a, b in joints)
    calls = {"simulate, 100 steps": simulate, "session, 100 ticks": ticks, "100 mj_step": steps}
    return {one: partial(measure.once, call) for one, call in calls.items()}, float(apart)


def first(name: str) -> tuple[Work, float]:
    """From the file to accelerations."""
    case = Case(name)
    mstmm.compile(mstmm.import_robot(case.path, case.base).scene, engine="fused")

    def ours() -> Any:
        model = mstmm.compile(mstmm.import_robot(case.path, case.base).scene)
        return model.accelerations(*model.initial_state())

    def theirs() -> Any:
        peer = case.pinocchio()
        still = np.zeros(peer.nv)
        return pin.aba(peer, peer.createData(), pin.neutral(peer), still, still)

    calls = {"file to first": ours, "pin.buildModelFromUrdf, aba": theirs}
    return {one: partial(measure.once, call) for one, call in calls.items()}, float("nan")


PARTS = {"native": native, "single": single, "runs": runs, "first": first}


def measured(quick: bool, parts: Sequence[str]) -> list[dict[str, Any]]:
    """Seconds a call of everybody on every robot."""
    found = []
    for name in ROBOTS:
        for part in parts:
            work, apart = PARTS[part](name)
            for one, samples in measure.rounds(work, 3 if quick else 40).items():
                found.append({"robot": name, "call": one, "s": samples, "apart": apart})
                print(name, one, f"{1e6 * min(samples):.4g} us", flush=True)
    return found


def kept(path: Path, measured: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Rows of the file that were not measured anew, with when and under what load they were."""
    record = json.loads(path.read_text())
    taken = {key: record["machine"][key] for key in ("date", "load")}
    known = {(r["robot"], r["call"]) for r in measured}
    rows = [r for r in record["results"] if (r["robot"], r["call"]) not in known]
    return [{"taken": taken} | r for r in rows]


def table(results: list[dict[str, Any]]) -> str:
    """Markdown: a row for what is asked of a robot, least and median of the rounds."""
    lines = [
        "| robot | what | us | beside | us | ratio | of medians | asked | apart |",
        "|---" * 9 + "|",
    ]
    asked_for = [(robot, call) for robot in ROBOTS for call in BESIDE]
    by_both = {(r["robot"], r["call"]): r for r in results}
    for r in (by_both[both] for both in asked_for if both in by_both):
        beside, asked = BESIDE[r["call"]]
        rows = [p for p in results if p["robot"] == r["robot"]]
        peers = [p for p in rows if p["call"].startswith(beside)]
        best = min(peers, key=lambda p: min(p["s"]))
        least, middle = (f(r["s"]) / f(best["s"]) for f in (min, statistics.median))
        apart = "" if np.isnan(r["apart"]) else f"{r['apart']:.1e}"
        most = "" if asked is None else f"{asked:g}"
        lines.append(
            f"| {r['robot']} | {r['call']} | {1e6 * min(r['s']):.4g} | {best['call']} | "
            f"{1e6 * min(best['s']):.4g} | {least:.3g} | {middle:.3g} | {most} | {apart} |"
        )
    return "\n".join(lines)


def main() -> None:
    """Measure, print the table."""
    parser = measure.options(str(__doc__).splitlines()[0], HERE)
    parser.add_argument(
        "--only", nargs="+", choices=PARTS, help="the rest stays as the JSON has it"
    )
    options = parser.parse_args()
    if not options.plot:
        rows = measured(options.quick, options.only or list(PARTS))
        measure.save(options.json, rows + (kept(options.json, rows) if options.only else []))
    record = json.loads(options.json.read_text())
    text = table(record["results"])
    print(text)
    load = f"Load {record['machine']['load']:.1f}."
    older = {r["call"]: r["taken"] for r in record["results"] if "taken" in r}
    for call in BESIDE:
        if call in older:
            taken = older[call]
            load += f" {call[0].upper()}{call[1:]}: {taken['date']}, load {taken['load']:.1f}."
    options.json.with_suffix(".md").write_text(f"{text}\n\n{load}\n")


if __name__ == "__main__":
    main()
