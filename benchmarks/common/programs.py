"""Everybody who can compute the accelerations of a scene, by name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

import mstmm

from . import aba, casadi_peer, mstmm_engines, native, pinocchio_peer
from . import reference as exact
from .links import Tree, links_of, states
from .measure import disagreement
from .scenes import KINDS, long_chain

#: Largest number of bodies that each is asked for (compile time, memory or patience beyond).
LIMITS = {
    "mstmm fused": 50, "mstmm looped": 10**6, "casadi": 100, "pinocchio": 1000, "mujoco": 300,
    "drake": 100, "exudyn": 100,
}  # fmt: skip
#: Contender -> family whose best member counts.
FAMILIES = {
    "mstmm fused": "mstmm fused",
    "mstmm baked": "mstmm fused, baked",
    "mstmm looped": "mstmm looped",
    "pinocchio": "Pinocchio",
    "mujoco": "MuJoCo",
    "drake": "Drake",
    "exudyn": "Exudyn",
}
WRONG = 1e-6


@dataclass
class Field:
    """One scene with the functions under test and how far each is from the looped engine."""

    kind: str
    bodies: int
    tree: Tree
    subjects: dict[str, native.Subject] = field(default_factory=dict)
    runs: dict[str, Callable[[], float]] = field(default_factory=dict)
    disagreement: dict[str, float] = field(default_factory=dict)
    operations: dict[str, int] = field(default_factory=dict)
    absent: dict[str, str] = field(default_factory=dict)
    exact: np.ndarray | None = None
    error: dict[str, float] = field(default_factory=dict)


def family(name: str) -> str:
    """Family of a contender."""
    if name.startswith("casadi"):
        if "libmvec" in name:
            return "CasADi C + libmvec" if "baked" not in name else "CasADi C + libmvec, baked"
        return "CasADi C, baked" if "baked" in name else "CasADi C"
    return next(label for key, label in FAMILIES.items() if name.startswith(key))


def field_of(kind: str, bodies: int, engines: bool = True) -> Field:
    """Contenders on one scene, compared before anybody is timed."""
    scene = KINDS[kind](bodies)
    tree = links_of(scene)
    if bodies > 1000:
        scene = long_chain(kind, bodies)
    count = max(1, min(32, 20_000 // bodies))
    q, u = states(tree, count)
    found = Field(kind, bodies, tree)
    looped = mstmm.compile(mstmm.Scene(**scene), engine="looped")
    reference = looped.accelerations(q, u)
    found.subjects["mstmm looped"] = mstmm_engines.looped(looped, q, u)
    if tree.nu <= LIMITS["casadi"]:
        found.exact = exact.accelerations(tree, q, u)
    if bodies <= LIMITS["mstmm fused"]:
        fused = mstmm.compile(mstmm.Scene(**scene), engine="fused")
        found.subjects["mstmm fused"] = mstmm_engines.fused(fused, q, u)
    if bodies <= 25:
        baked = mstmm.compile(mstmm.Scene(**scene), engine="fused", bake=True)
        found.subjects["mstmm baked"] = mstmm_engines.fused(baked, q, u)
    if tree.nu <= LIMITS["casadi"]:
        _add_casadi(found, q, u)
    if bodies <= LIMITS["pinocchio"]:
        for name, subject in pinocchio_peer.subjects(tree, q, u).items():
            found.subjects[f"pinocchio {name}"] = subject
    for name, subject in found.subjects.items():
        udot = subject.accelerations()
        found.disagreement[name] = disagreement(udot, reference)
        if found.exact is not None:
            found.error[name] = disagreement(udot, found.exact)
    if tree.nu <= LIMITS["mujoco"]:
        _add_mujoco(found, q, u, reference)
    if engines and bodies <= LIMITS["drake"]:
        _add_drake(found, q, u, reference)
    if engines and bodies <= LIMITS["exudyn"]:
        _add_exudyn(found, q, u, reference)
    return found


def _add_casadi(found: Field, q: np.ndarray, u: np.ndarray) -> None:
    every, tree = casadi_peer.FLAGS, found.tree
    some = {name: every[name] for name in ("O2 scalar", "O3")}
    one = {"O2": every["O2"]}
    # Numbers in the text?, flags, where sines and cosines are computed.
    forms = [(False, every, ("", "libm")), (False, one, ("libmvec8",)), (True, some, ("", "libm"))]
    if found.bodies > 25:
        forms = [(False, one, ("", "libm"))]
    for baked, flags, sines in forms:
        for name, subject in casadi_peer.subjects(tree, q, u, baked, flags, sines).items():
            found.subjects[f"casadi {name}{' baked' if baked else ''}"] = subject
    function, _ = aba.articulated_body(tree)
    found.operations = aba.operations(function)


def _add_mujoco(found: Field, q: np.ndarray, u: np.ndarray, reference: np.ndarray) -> None:
    from . import mujoco_peer

    subject = mujoco_peer.subject(found.tree, q, u)
    found.subjects["mujoco"] = subject
    udot = mujoco_peer.accelerations(subject, found.tree, q, u)
    found.disagreement["mujoco"] = disagreement(udot, reference)


def _add_drake(found: Field, q: np.ndarray, u: np.ndarray, reference: np.ndarray) -> None:
    from . import drake_peer, exudyn_peer
    from .measure import cpu

    start_q, start_u = q[0], u[0]
    if found.kind == "balls":
        start_q, start_u = exudyn_peer.state(found.tree, q[0], u[0])
        start_q = start_q.reshape(-1, 3)[:, ::-1].ravel()
    if found.kind == "humanoid":
        start_q = np.concatenate([q[0, 3:7], q[0, :3], q[0, 7:]])
        start_u = np.concatenate([u[0, 3:6], u[0, :3], u[0, 6:]])
    run: Any = drake_peer.DrakeRun(found.tree, start_q, start_u)
    if found.kind not in ("balls", "humanoid"):  # whose speeds are others
        udot = run.accelerations(start_q, start_u)
        found.disagreement["drake"] = disagreement(udot, reference[0])
    steps = max(20, 3000 // found.bodies)
    calls = steps * drake_peer.EVALUATIONS_PER_STEP
    found.runs["drake"] = lambda: cpu(lambda: run.run(steps)) / calls * 1e9


def _add_exudyn(found: Field, q: np.ndarray, u: np.ndarray, reference: np.ndarray) -> None:
    from . import exudyn_peer
    from .measure import cpu

    try:
        run: Any = exudyn_peer.ExudynRun(found.tree, q[0], u[0])
    except ValueError as error:
        found.absent["exudyn"] = str(error)
        return
    if found.kind in ("pins", "planar"):  # by a difference: half the digits
        found.disagreement["exudyn"] = disagreement(run.accelerations(u[0]), reference[0])
    steps = max(5, 2000 // found.bodies**2 * 5)
    calls = steps * 4
    found.runs["exudyn"] = lambda: cpu(lambda: run.run(1e-5 * steps, steps)) / calls * 1e9
