"""Accelerations of many states at once: SIMD lanes and threads, native on every side.

    python benchmarks/batch_throughput/run.py [--quick] [--plot] [--compile]

2048 random states per call.  One core: CPU ns per state; all cores: wall-clock ns per state, each
thread on its own part with its own workspace.  Results are compared before timing.
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
from common.links import link_tree, random_states  # noqa: E402
from common.scenes import KINDS  # noqa: E402

import mstmm  # noqa: E402

SCENES = (("pins", 3), ("pins", 7), ("pins", 24), ("balls", 7), ("planar", 7), ("puma", 6),
          ("humanoid", 25))  # fmt: skip
COUNT = 2048
CORES = len(os.sched_getaffinity(0))
#: Prefix of a variant -> program; the best variant counts.
FAMILIES = {
    "mstmm lanes": "mstmm lanes", "mstmm accelerations()": "mstmm accelerations()",
    "mstmm one by one": "mstmm one by one", "casadi lanes": "CasADi C in SIMD lanes by hand",
    "casadi": "CasADi C", "pinocchio": "Pinocchio", "mujoco": "MuJoCo",
}  # fmt: skip
Part = Callable[[], object]


def program_family(name: str) -> str:
    """Program of a variant."""
    return next(label for key, label in FAMILIES.items() if name.startswith(key))


def split_states(threads: int) -> list[slice]:
    """Parts of the states, each a multiple of the lanes."""
    width = -(-COUNT // threads // 8) * 8
    return [slice(a, min(COUNT, a + width)) for a in range(0, COUNT, width)]


def walk_states(subject: native.Subject) -> Part:
    """Function that evaluates all states of a subject."""
    return lambda: native.timing_loops().throughput(ctypes.byref(subject.record), 1)


def thread_parts(kind: str, bodies: int, slices: list[slice]) -> tuple[dict[str, list[Part]], Any]:
    """Program -> the work of each thread; and the largest differences."""
    scene = KINDS[kind](bodies)
    tree = link_tree(scene)
    q, u = random_states(tree, COUNT)
    model = mstmm.compile(mstmm.Scene(**scene), engine="fused")
    reference = mstmm.compile(mstmm.Scene(**scene), engine="looped").accelerations(q, u)
    work: dict[str, list[Part]] = {}
    udot: dict[str, np.ndarray] = {}
    casadi_udot = {
        name: native.aligned_copy(np.zeros_like(u))
        for name in ("casadi lanes O2", "casadi lanes O3")
    }
    lanes = [mstmm_engines.Lanes(model, q[p], u[p]) for p in slices]
    work["mstmm lanes"] = list(lanes)
    threads = len(slices)
    work["mstmm accelerations()"] = [lambda: model.accelerations(q, u, threads=threads)]
    for level in ("O2", "O3"):
        casadi_code = casadi_lanes.Lanes(tree, level)
        name = f"casadi lanes {level}"
        work[name] = [
            lambda p=p, f=casadi_code, o=casadi_udot[name]: f(q[p], u[p], o[p]) for p in slices
        ]
    for part in [*lanes, *(part for name in casadi_udot for part in work[name])]:
        part()
    udot |= casadi_udot | {"mstmm lanes": np.concatenate([part.udot for part in lanes])}
    for p in slices:
        for name, subject in _subjects(tree, model, q[p], u[p]).items():
            work.setdefault(name, []).append(walk_states(subject))
            if name == "mujoco":
                values = mujoco_peer.accelerations(subject, tree, q[p], u[p])
            else:
                values = subject.accelerations()
            udot[name] = np.concatenate([udot[name], values]) if name in udot else values
    return work, {name: measure.relative_difference(x, reference) for name, x in udot.items()}


def _subjects(tree: Any, model: Any, q: np.ndarray, u: np.ndarray) -> dict[str, native.Subject]:
    subjects = {"mstmm one by one": mstmm_engines.fused_subject(model, q, u)}
    flags, sines = {"O2": casadi_peer.FLAGS["O2"]}, ("", "libm", "libmvec8")
    for name, subject in casadi_peer.subjects(tree, q, u, False, flags, sines).items():
        subjects[f"casadi {name}"] = subject
    for name, subject in pinocchio_peer.subjects(tree, q, u).items():
        subjects[f"pinocchio {name}"] = subject
    subjects["mujoco"] = mujoco_peer.subject(tree, q, u)
    return subjects


def wall_time(pool: ThreadPoolExecutor, work: list[Part]) -> float:
    """Wall-clock ns per state of five calls on all threads."""

    def repeat(part: Part) -> None:
        for _ in range(5):
            part()

    start_time = time.perf_counter()
    list(pool.map(repeat, work))
    return (time.perf_counter() - start_time) / (5 * COUNT) * 1e9


def measure_scene(kind: str, bodies: int, rounds: int) -> dict[str, Any]:
    """Samples on one core and on all cores."""
    result: dict[str, Any] = {"kind": kind, "bodies": bodies, "states": COUNT}
    single_core, result["differences"] = thread_parts(kind, bodies, split_states(1))
    timers = {
        name: lambda w=work: (
            measure.cpu_time(lambda: [w[0]() for _ in range(5)]) / (5 * COUNT) * 1e9
        )
        for name, work in single_core.items()
    }
    result["one_core_cpu_ns"] = measure.sample_rounds(timers, rounds)
    all_cores, _ = thread_parts(kind, bodies, split_states(CORES))
    with ThreadPoolExecutor(CORES) as pool:
        timers = {name: lambda w=work: wall_time(pool, w) for name, work in all_cores.items()}
        result["all_cores_wall_ns"] = measure.sample_rounds(timers, rounds)
    return result


def best_times(result: dict[str, Any], mode: str) -> dict[str, float]:
    """Family -> smallest median."""
    times: dict[str, float] = {}
    for name, values in result[mode].items():
        value = statistics.median(values)
        times[program_family(name)] = min(value, times.get(program_family(name), value))
    return times


def table(record: dict[str, Any]) -> str:
    """Markdown: ns per state on one core and on all, and the speed-up of lanes."""
    names = list(FAMILIES.values())
    lines = []
    titles = {"one_core_cpu_ns": "One core, CPU ns per state",
              "all_cores_wall_ns": f"{record['cores']} threads, wall ns per state"}  # fmt: skip
    for mode, title in titles.items():
        lines += [f"{title}:", "", f"| scene | bodies | {' | '.join(names)} | lanes gain |",
                  "|---" * (len(names) + 3) + "|"]  # fmt: skip
        for result in record["results"]:
            times = best_times(result, mode)
            lane_gain = times["mstmm one by one"] / times["mstmm lanes"]
            cells = " | ".join(f"{times[n]:.3g}" for n in names)
            lines.append(f"| {result['kind']} | {result['bodies']} | {cells} | {lane_gain:.1f} |")
        lines.append("")
    return "\n".join(lines)


def main() -> None:
    """Measure, print the table, draw."""
    parser = measure.option_parser(str(__doc__).splitlines()[0], HERE)
    parser.add_argument("--rounds", type=int, default=11)
    parser.add_argument("--compile", action="store_true", help="only compile")
    options = parser.parse_args()
    if not options.plot:
        results = []
        for kind, bodies in SCENES[:2] if options.quick else SCENES:
            if options.compile:
                thread_parts(kind, bodies, split_states(1))
                continue
            results.append(measure_scene(kind, bodies, 3 if options.quick else options.rounds))
            print(kind, bodies, best_times(results[-1], "one_core_cpu_ns"), flush=True)
        if options.compile:
            return
        measure.save_record(options.json, results, cores=CORES)
    record = json.loads(options.json.read_text())
    text = table(record)
    print(text)
    options.json.with_suffix(".md").write_text(text)
    from picture import draw

    draw(record, best_times, options.picture)


if __name__ == "__main__":
    main()
