"""One program on one long chain: print its cost as JSON.

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

from common import measure, scenes
from common.links import Tree, link_tree, random_states

T_END = 0.02  # s


def memory_mib() -> float:
    """Largest resident memory so far, MiB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def evaluation_ms(work: Callable[[], object]) -> float:
    """CPU ms of one evaluation, the best of several within about a second."""
    samples = [measure.cpu_time(work)]
    while len(samples) < 15 and sum(samples) < 1.0:
        samples.append(measure.cpu_time(work))
    return min(samples) * 1e3


def random_state(tree: Tree) -> tuple[np.ndarray, np.ndarray]:
    """One of the random states of the other benchmarks."""
    return random_states(tree, 1)


def mstmm_looped(kind: str, n: int) -> dict[str, float]:
    """mstmm, element by element."""
    from common import mstmm_engines

    import mstmm

    warm_up = mstmm.compile(mstmm.Scene(**scenes.long_chain(kind, 6)), engine="looped")
    settings: dict[str, Any] = {"method": "dopri5", "rtol": 1e-6, "atol": 1e-6}
    warm_up.simulate(T_END, output_times=[T_END], **settings)  # imports
    base, start_time = memory_mib(), time.process_time()
    model = mstmm.compile(mstmm.Scene(**scenes.long_chain(kind, n)), engine="looped")
    build_s = time.process_time() - start_time
    rng = np.random.default_rng(1)
    q, u = model.initial_state()
    if kind == "pins":
        q = rng.uniform(-1, 1, q.shape)
    subject = mstmm_engines.looped_subject(model, q[None], rng.uniform(-1, 1, (1, len(u))))
    value = evaluation_ms(lambda: subject.time(False, 1))
    run_s = measure.cpu_time(lambda: model.simulate(T_END, output_times=[T_END], **settings))
    return {"build_s": build_s, "evaluation_ms": value, "run_s_per_s": run_s / T_END,
            "memory_mib": memory_mib() - base}  # fmt: skip


def pinocchio(kind: str, n: int) -> dict[str, float]:
    """Pinocchio's C++ loop, local convention, with the workspace of this algorithm alone."""
    from common import pinocchio_peer

    tree = link_tree(scenes.KINDS[kind](n))
    q, u = random_state(tree)
    library = pinocchio_peer.open_library("O3")
    base, start_time = memory_mib(), time.process_time()
    model = pinocchio_peer.PinocchioModel(library, tree)
    build_s = time.process_time() - start_time
    subject = pinocchio_peer.local_subject(library, model, tree, q, u)
    value = evaluation_ms(lambda: subject.time(False, 1))
    return {"build_s": build_s, "evaluation_ms": value, "memory_mib": memory_mib() - base}


def mujoco(kind: str, n: int) -> dict[str, float]:
    """MuJoCo's C functions."""
    from common import mujoco_peer

    tree = link_tree(scenes.KINDS[kind](n))
    q, u = random_state(tree)
    base, start_time = memory_mib(), time.process_time()
    subject = mujoco_peer.subject(tree, q, u)
    build_s = time.process_time() - start_time
    value = evaluation_ms(lambda: subject.time(False, 1))
    return {"build_s": build_s, "evaluation_ms": value, "memory_mib": memory_mib() - base}


def drake(kind: str, n: int) -> dict[str, float]:
    """Drake's plant; ten steps of its fixed-step integrator."""
    from common import drake_peer

    tree = link_tree(scenes.KINDS[kind](n))
    base, start_time = memory_mib(), time.process_time()
    run = drake_peer.DrakeRun(tree, np.zeros(tree.nu), np.zeros(tree.nu))
    build_s = time.process_time() - start_time
    value = evaluation_ms(lambda: run.run(10)) / 30
    return {"build_s": build_s, "evaluation_ms": value, "memory_mib": memory_mib() - base}


def exudyn_tree(kind: str, n: int) -> dict[str, float]:
    """Exudyn's kinematic tree: minimal coordinates, dense matrices."""
    from common import exudyn_peer

    tree = link_tree(scenes.KINDS[kind](n))
    q, u = random_state(tree)
    base, start_time = memory_mib(), time.process_time()
    run = exudyn_peer.ExudynRun(tree, q[0], u[0])
    build_s = time.process_time() - start_time
    value = evaluation_ms(lambda: run.run(1e-5, 1)) / 4
    return {"build_s": build_s, "evaluation_ms": value, "memory_mib": memory_mib() - base}


def exudyn_sparse(kind: str, n: int) -> dict[str, float]:
    """Exudyn's bodies with joints: redundant coordinates, sparse, implicit steps of 1 ms."""
    from common import exudyn_sparse

    tree = link_tree(scenes.KINDS[kind](n))
    base, start_time = memory_mib(), time.process_time()
    system: Any = exudyn_sparse.build_chain(tree)
    build_s = time.process_time() - start_time
    steps = 3
    run_s = measure.cpu_time(lambda: exudyn_sparse.run(system, steps * 1e-3, steps))
    return {
        "build_s": build_s,
        "run_s_per_s": run_s / (steps * 1e-3),
        "memory_mib": memory_mib() - base,
    }


TOOLS: dict[str, Callable[[str, int], dict[str, float]]] = {
    "mstmm": mstmm_looped, "Pinocchio": pinocchio, "MuJoCo": mujoco, "Drake": drake,
    "Exudyn, tree": exudyn_tree, "Exudyn, sparse": exudyn_sparse,
}  # fmt: skip

if __name__ == "__main__":
    tool, kind, bodies = sys.argv[1:]
    limit = 8 << 30
    resource.setrlimit(resource.RLIMIT_DATA, (limit, limit))
    print(json.dumps(TOOLS[tool](kind, int(bodies))))
