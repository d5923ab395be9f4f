"""Accelerations of many states at once: SIMD lanes and threads, native on every side.

    python benchmarks/batch_throughput/run.py [--quick] [--plot] [--compile]

2048 random states per call.  One core: CPU ns per state; all cores: wall-clock ns per state, every
thread on its own part with its own workspace.  Results are compared before anything is timed.
"""

from __future__ import annotations

import ctypes
import json
import os
import statistics
import sys
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

from common import (  # noqa: E402
    casadi_lanes,
    casadi_peer,
    measure,
    mstmm_engines,
    mujoco_peer,
    native,
    pinocchio_peer,
)
from common.links import links_of, states  # noqa: E402
from common.scenes import KINDS  # noqa: E402

import mstmm  # noqa: E402

SCENES = (("pins", 3), ("pins", 7), ("pins", 24), ("balls", 7), ("planar", 7), ("puma", 6),
          ("humanoid", 25))  # fmt: skip
COUNT = 2048
CORES = len(os.sched_getaffinity(0))
#: Contender -> family; the best member counts.
FAMILIES = {
    "mstmm lanes": "mstmm lanes", "mstmm accelerations()": "mstmm accelerations()",
    "mstmm one by one": "mstmm one by one", "casadi lanes": "CasADi C in SIMD lanes by hand",
    "casadi": "CasADi C", "pinocchio": "Pinocchio", "mujoco": "MuJoCo",
}  # fmt: skip
Part = Callable[[], object]


def family(name: str) -> str:
    """Family of a contender."""
    return next(label for key, label in FAMILIES.items() if name.startswith(key))


def halves(threads: int) -> list[slice]:
    """Parts of the states, each a multiple of the lanes."""
    width = -(-COUNT // threads // 8) * 8
    return [slice(a, min(COUNT, a + width)) for a in range(0, COUNT, width)]


def once(subject: native.Subject) -> Part:
    """A walk through the states of a subject."""
    return lambda: native.loops().throughput(ctypes.byref(subject.record), 1)


def parts(kind: str, bodies: int, pieces: list[slice]) -> tuple[dict[str, list[Part]], Any]:
    """Contender -> the work of each thread; and the largest disagreements."""
    scene = KINDS[kind](bodies)
    tree = links_of(scene)
    q, u = states(tree, COUNT)
    model = mstmm.compile(mstmm.Scene(**scene), engine="fused")
    reference = mstmm.compile(mstmm.Scene(**scene), engine="looped").accelerations(q, u)
    work: dict[str, list[Part]] = {}
    found: dict[str, np.ndarray] = {}
    out = {
        name: native.aligned(np.zeros_like(u)) for name in ("casadi lanes O2", "casadi lanes O3")
    }
    lanes = [mstmm_engines.Lanes(model, q[p], u[p]) for p in pieces]
    work["mstmm lanes"] = list(lanes)
    threads = len(pieces)
    work["mstmm accelerations()"] = [lambda: model.accelerations(q, u, threads=threads)]
    for level in ("O2", "O3"):
        hand = casadi_lanes.Lanes(tree, level)
        name = f"casadi lanes {level}"
        work[name] = [lambda p=p, f=hand, o=out[name]: f(q[p], u[p], o[p]) for p in pieces]
    for part in [*lanes, *(part for name in out for part in work[name])]:
        part()
    found |= out | {"mstmm lanes": np.concatenate([part.udot for part in lanes])}
    for p in pieces:
        for name, subject in _subjects(tree, model, q[p], u[p]).items():
            work.setdefault(name, []).append(once(subject))
            if name == "mujoco":
                values = mujoco_peer.accelerations(subject, tree, q[p], u[p])
            else:
                values = subject.accelerations()
            found[name] = np.concatenate([found[name], values]) if name in found else values
    return work, {name: measure.disagreement(x, reference) for name, x in found.items()}


def _subjects(tree: Any, model: Any, q: np.ndarray, u: np.ndarray) -> dict[str, native.Subject]:
    found = {"mstmm one by one": mstmm_engines.fused(model, q, u)}
    flags, sines = {"O2": casadi_peer.FLAGS["O2"]}, ("", "libm", "libmvec8")
    for name, subject in casadi_peer.subjects(tree, q, u, False, flags, sines).items():
        found[f"casadi {name}"] = subject
    for name, subject in pinocchio_peer.subjects(tree, q, u).items():
        found[f"pinocchio {name}"] = subject
    found["mujoco"] = mujoco_peer.subject(tree, q, u)
    return found


def wall(pool: ThreadPoolExecutor, work: list[Part]) -> float:
    """Wall-clock ns per state of five calls on all threads."""

    def often(part: Part) -> None:
        for _ in range(5):
            part()

    begin = time.perf_counter()
    list(pool.map(often, work))
    return (time.perf_counter() - begin) / (5 * COUNT) * 1e9


def measured(kind: str, bodies: int, rounds: int) -> dict[str, Any]:
    """Samples on one core and on all."""
    result: dict[str, Any] = {"kind": kind, "bodies": bodies, "states": COUNT}
    one, result["disagreement"] = parts(kind, bodies, halves(1))
    timed = {
        name: lambda w=work: measure.cpu(lambda: [w[0]() for _ in range(5)]) / (5 * COUNT) * 1e9
        for name, work in one.items()
    }
    result["one_core_cpu_ns"] = measure.rounds(timed, rounds)
    many, _ = parts(kind, bodies, halves(CORES))
    with ThreadPoolExecutor(CORES) as pool:
        timed = {name: lambda w=work: wall(pool, w) for name, work in many.items()}
        result["all_cores_wall_ns"] = measure.rounds(timed, rounds)
    return result


def best(result: dict[str, Any], mode: str) -> dict[str, float]:
    """Family -> smallest median."""
    found: dict[str, float] = {}
    for name, values in result[mode].items():
        value = statistics.median(values)
        found[family(name)] = min(value, found.get(family(name), value))
    return found


def table(record: dict[str, Any]) -> str:
    """Markdown: ns per state on one core and on all, and what the lanes gain."""
    names = list(FAMILIES.values())
    lines = []
    titles = {"one_core_cpu_ns": "One core, CPU ns per state",
              "all_cores_wall_ns": f"{record['cores']} threads, wall ns per state"}  # fmt: skip
    for mode, title in titles.items():
        lines += [f"{title}:", "", f"| scene | bodies | {' | '.join(names)} | lanes gain |",
                  "|---" * (len(names) + 3) + "|"]  # fmt: skip
        for result in record["results"]:
            found = best(result, mode)
            gain = found["mstmm one by one"] / found["mstmm lanes"]
            cells = " | ".join(f"{found[n]:.3g}" for n in names)
            lines.append(f"| {result['kind']} | {result['bodies']} | {cells} | {gain:.1f} |")
        lines.append("")
    return "\n".join(lines)


def main() -> None:
    """Measure, print the table, draw."""
    parser = measure.options(str(__doc__).splitlines()[0], HERE)
    parser.add_argument("--rounds", type=int, default=11)
    parser.add_argument("--compile", action="store_true", help="only build what will be timed")
    options = parser.parse_args()
    if not options.plot:
        results = []
        for kind, bodies in SCENES[:2] if options.quick else SCENES:
            if options.compile:
                parts(kind, bodies, halves(1))
                continue
            results.append(measured(kind, bodies, 3 if options.quick else options.rounds))
            print(kind, bodies, best(results[-1], "one_core_cpu_ns"), flush=True)
        if options.compile:
            return
        measure.save(options.json, results, cores=CORES)
    record = json.loads(options.json.read_text())
    text = table(record)
    print(text)
    options.json.with_suffix(".md").write_text(text)
    from picture import draw

    draw(record, best, options.picture)


if __name__ == "__main__":
    main()
