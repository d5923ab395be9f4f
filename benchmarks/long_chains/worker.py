"""One tool on one long chain, in a process of its own: prints what it cost as JSON.

    python worker.py TOOL KIND BODIES

The chain starts straight along x, at rest, under gravity.
"""

from __future__ import annotations

import json
import resource
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from common import scenes
from common.links import Tree, links_of, states

RUN = 0.02  # s


def peak() -> float:
    """Largest resident memory so far, MiB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def cpu(work: Callable[[], object]) -> float:
    """CPU seconds."""
    begin = time.process_time()
    work()
    return time.process_time() - begin


def evaluated(work: Callable[[], object]) -> float:
    """CPU ms of one evaluation, the best of several within about a second."""
    found = [cpu(work)]
    while len(found) < 15 and sum(found) < 1.0:
        found.append(cpu(work))
    return min(found) * 1e3


def straight(tree: Tree) -> tuple[np.ndarray, np.ndarray]:
    """Random states as in the other benchmarks, one of them."""
    return states(tree, 1)


def mstmm_looped(kind: str, n: int) -> dict[str, float]:
    """mstmm, element by element."""
    from common import mstmm_engines

    import mstmm

    small = mstmm.compile(mstmm.Scene(**scenes.long_chain(kind, 6)), engine="looped")
    settings: dict[str, Any] = {"method": "dopri5", "rtol": 1e-6, "atol": 1e-6}
    small.simulate(RUN, output_times=[RUN], **settings)  # what is imported on first use
    before, begin = peak(), time.process_time()
    model = mstmm.compile(mstmm.Scene(**scenes.long_chain(kind, n)), engine="looped")
    built = time.process_time() - begin
    rng = np.random.default_rng(1)
    q, u = model.initial_state()
    if kind == "pins":
        q = rng.uniform(-1, 1, q.shape)
    subject = mstmm_engines.looped(model, q[None], rng.uniform(-1, 1, (1, len(u))))
    value = evaluated(lambda: subject.time(False, 1))
    spent = cpu(lambda: model.simulate(RUN, output_times=[RUN], **settings))
    return {"build_s": built, "evaluation_ms": value, "run_s_per_s": spent / RUN,
            "memory_mib": peak() - before}  # fmt: skip


def pinocchio(kind: str, n: int) -> dict[str, float]:
    """Pinocchio's C++ loop, local convention, with the workspace of this algorithm alone."""
    from common import pinocchio_peer

    tree = links_of(scenes.KINDS[kind](n))
    q, u = straight(tree)
    library = pinocchio_peer.opened("O3")
    before, begin = peak(), time.process_time()
    model = pinocchio_peer.Built(library, tree)
    built = time.process_time() - begin
    subject = pinocchio_peer.local(library, model, tree, q, u)
    value = evaluated(lambda: subject.time(False, 1))
    return {"build_s": built, "evaluation_ms": value, "memory_mib": peak() - before}


def mujoco(kind: str, n: int) -> dict[str, float]:
    """MuJoCo's C functions."""
    from common import mujoco_peer

    tree = links_of(scenes.KINDS[kind](n))
    q, u = straight(tree)
    before, begin = peak(), time.process_time()
    subject = mujoco_peer.subject(tree, q, u)
    built = time.process_time() - begin
    value = evaluated(lambda: subject.time(False, 1))
    return {"build_s": built, "evaluation_ms": value, "memory_mib": peak() - before}


def drake(kind: str, n: int) -> dict[str, float]:
    """Drake's plant; ten steps of its fixed-step integrator."""
    from common import drake_peer

    tree = links_of(scenes.KINDS[kind](n))
    before, begin = peak(), time.process_time()
    run = drake_peer.DrakeRun(tree, np.zeros(tree.nu), np.zeros(tree.nu))
    built = time.process_time() - begin
    value = evaluated(lambda: run.run(10)) / 30
    return {"build_s": built, "evaluation_ms": value, "memory_mib": peak() - before}


def exudyn_tree(kind: str, n: int) -> dict[str, float]:
    """Exudyn's kinematic tree: minimal coordinates, dense matrices."""
    from common import exudyn_peer

    tree = links_of(scenes.KINDS[kind](n))
    q, u = straight(tree)
    before, begin = peak(), time.process_time()
    run = exudyn_peer.ExudynRun(tree, q[0], u[0])
    built = time.process_time() - begin
    value = evaluated(lambda: run.run(1e-5, 1)) / 4
    return {"build_s": built, "evaluation_ms": value, "memory_mib": peak() - before}


def exudyn_sparse(kind: str, n: int) -> dict[str, float]:
    """Exudyn's bodies with joints: redundant coordinates, sparse, implicit steps of 1 ms."""
    from common import exudyn_sparse

    tree = links_of(scenes.KINDS[kind](n))
    before, begin = peak(), time.process_time()
    system: Any = exudyn_sparse.chain_of(tree)
    built = time.process_time() - begin
    steps = 3
    spent = cpu(lambda: exudyn_sparse.run(system, steps * 1e-3, steps))
    return {"build_s": built, "run_s_per_s": spent / (steps * 1e-3), "memory_mib": peak() - before}


TOOLS: dict[str, Callable[[str, int], dict[str, float]]] = {
    "mstmm": mstmm_looped, "Pinocchio": pinocchio, "MuJoCo": mujoco, "Drake": drake,
    "Exudyn, tree": exudyn_tree, "Exudyn, sparse": exudyn_sparse,
}  # fmt: skip

if __name__ == "__main__":
    tool, kind, bodies = sys.argv[1:]
    limit = 8 << 30
    resource.setrlimit(resource.RLIMIT_DATA, (limit, limit))
    print(json.dumps(TOOLS[tool](kind, int(bodies))))
