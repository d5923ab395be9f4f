"""All programs that compute the accelerations of a scene, by name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

import mstmm

from . import aba, casadi_peer, mstmm_engines, native, pinocchio_peer
from . import reference as long_double
from .links import Tree, link_tree, random_states
from .measure import relative_difference
from .scenes import KINDS, long_chain

#: Largest number of bodies for each program, limited by compile time, memory or run time.
LIMITS = {
    "mstmm fused": 50, "mstmm looped": 10**6, "casadi": 100, "pinocchio": 1000, "mujoco": 300,
    "drake": 100, "exudyn": 100,
}  # fmt: skip
#: Prefix of a variant -> program; the best variant of a program counts.
FAMILIES = {
    "mstmm fused": "mstmm fused",
    "mstmm baked": "mstmm fused, baked",
    "mstmm looped": "mstmm looped",
    "pinocchio": "Pinocchio",
    "mujoco": "MuJoCo",
    "drake": "Drake",
    "exudyn": "Exudyn",
}
MAX_DIFFERENCE = 1e-6


@dataclass
class SceneSubjects:
    """A scene, the functions under test, and their differences from the looped engine."""

    kind: str
    bodies: int
    tree: Tree
    subjects: dict[str, native.Subject] = field(default_factory=dict)
    runs: dict[str, Callable[[], float]] = field(default_factory=dict)
    differences: dict[str, float] = field(default_factory=dict)
    operations: dict[str, int] = field(default_factory=dict)
    failures: dict[str, str] = field(default_factory=dict)
    exact_udot: np.ndarray | None = None
    error: dict[str, float] = field(default_factory=dict)


def program_family(name: str) -> str:
    """Program that a variant belongs to."""
    if name.startswith("casadi"):
        if "libmvec" in name:
            return "CasADi C + libmvec" if "baked" not in name else "CasADi C + libmvec, baked"
        return "CasADi C, baked" if "baked" in name else "CasADi C"
    return next(label for key, label in FAMILIES.items() if name.startswith(key))


def scene_subjects(kind: str, bodies: int, with_integrators: bool = True) -> SceneSubjects:
    """All variants on one scene, with their errors."""
    scene = KINDS[kind](bodies)
    tree = link_tree(scene)
    if bodies > 1000:
        scene = long_chain(kind, bodies)
    count = max(1, min(32, 20_000 // bodies))
    q, u = random_states(tree, count)
    subjects = SceneSubjects(kind, bodies, tree)
    looped = mstmm.compile(mstmm.Scene(**scene), engine="looped")
    reference = looped.accelerations(q, u)
    subjects.subjects["mstmm looped"] = mstmm_engines.looped_subject(looped, q, u)
    if tree.nu <= LIMITS["casadi"]:
        subjects.exact_udot = long_double.accelerations(tree, q, u)
    if bodies <= LIMITS["mstmm fused"]:
        fused = mstmm.compile(mstmm.Scene(**scene), engine="fused")
        subjects.subjects["mstmm fused"] = mstmm_engines.fused_subject(fused, q, u)
    if bodies <= 25:
        baked = mstmm.compile(mstmm.Scene(**scene), engine="fused", bake=True)
        subjects.subjects["mstmm baked"] = mstmm_engines.fused_subject(baked, q, u)
    if tree.nu <= LIMITS["casadi"]:
        _add_casadi(subjects, q, u)
    if bodies <= LIMITS["pinocchio"]:
        for name, subject in pinocchio_peer.subjects(tree, q, u).items():
            subjects.subjects[f"pinocchio {name}"] = subject
    for name, subject in subjects.subjects.items():
        udot = subject.accelerations()
        subjects.differences[name] = relative_difference(udot, reference)
        if subjects.exact_udot is not None:
            subjects.error[name] = relative_difference(udot, subjects.exact_udot)
    if tree.nu <= LIMITS["mujoco"]:
        _add_mujoco(subjects, q, u, reference)
    if with_integrators and bodies <= LIMITS["drake"]:
        _add_drake(subjects, q, u, reference)
    if with_integrators and bodies <= LIMITS["exudyn"]:
        _add_exudyn(subjects, q, u, reference)
    return subjects


def _add_casadi(subjects: SceneSubjects, q: np.ndarray, u: np.ndarray) -> None:
    all_flags, tree = casadi_peer.FLAGS, subjects.tree
    scalar_flags = {name: all_flags[name] for name in ("O2 scalar", "O3")}
    plain_flags = {"O2": all_flags["O2"]}
    # (numbers as literals, flags, source of sines and cosines)
    forms = [
        (False, all_flags, ("", "libm")),
        (False, plain_flags, ("libmvec8",)),
        (True, scalar_flags, ("", "libm")),
    ]
    if subjects.bodies > 25:
        forms = [(False, plain_flags, ("", "libm"))]
    for baked, flags, sines in forms:
        for name, subject in casadi_peer.subjects(tree, q, u, baked, flags, sines).items():
            subjects.subjects[f"casadi {name}{' baked' if baked else ''}"] = subject
    function, _ = aba.articulated_body(tree)
    subjects.operations = aba.operations(function)


def _add_mujoco(
    subjects: SceneSubjects, q: np.ndarray, u: np.ndarray, reference: np.ndarray
) -> None:
    from . import mujoco_peer

    subject = mujoco_peer.subject(subjects.tree, q, u)
    subjects.subjects["mujoco"] = subject
    udot = mujoco_peer.accelerations(subject, subjects.tree, q, u)
    subjects.differences["mujoco"] = relative_difference(udot, reference)


def _add_drake(
    subjects: SceneSubjects, q: np.ndarray, u: np.ndarray, reference: np.ndarray
) -> None:
    from . import drake_peer, exudyn_peer
    from .measure import cpu_time

    start_q, start_u = q[0], u[0]
    if subjects.kind == "balls":
        start_q, start_u = exudyn_peer.exudyn_state(subjects.tree, q[0], u[0])
        start_q = start_q.reshape(-1, 3)[:, ::-1].ravel()
    if subjects.kind == "humanoid":
        start_q = np.concatenate([q[0, 3:7], q[0, :3], q[0, 7:]])
        start_u = np.concatenate([u[0, 3:6], u[0, :3], u[0, 6:]])
    run: Any = drake_peer.DrakeRun(subjects.tree, start_q, start_u)
    if subjects.kind not in ("balls", "humanoid"):  # whose speeds are defined differently
        udot = run.accelerations(start_q, start_u)
        subjects.differences["drake"] = relative_difference(udot, reference[0])
    steps = max(20, 3000 // subjects.bodies)
    calls = steps * drake_peer.EVALUATIONS_PER_STEP
    subjects.runs["drake"] = lambda: cpu_time(lambda: run.run(steps)) / calls * 1e9


def _add_exudyn(
    subjects: SceneSubjects, q: np.ndarray, u: np.ndarray, reference: np.ndarray
) -> None:
    from . import exudyn_peer
    from .measure import cpu_time

    try:
        run: Any = exudyn_peer.ExudynRun(subjects.tree, q[0], u[0])
    except ValueError as error:
        subjects.failures["exudyn"] = str(error)
        return
    if subjects.kind in ("pins", "planar"):  # by a finite difference: half the digits
        subjects.differences["exudyn"] = relative_difference(run.accelerations(u[0]), reference[0])
    steps = max(5, 2000 // subjects.bodies**2 * 5)
    calls = steps * 4
    subjects.runs["exudyn"] = lambda: cpu_time(lambda: run.run(1e-5 * steps, steps)) / calls * 1e9
