"""Looped engine beside Pinocchio's C++ articulated-body loop, in one process, round by round.

Run with a Python that has mstmm, numpy, pin and cmeel-eigen (for Eigen's headers), and g++:

    python benchmarks/looped_vs_pinocchio/run.py [--json FILE] [--rounds 15] [7 100 10000]

Chains of uniform rods (1 m, 1 kg) on pins whose axes alternate x, y, z; random angles and rates.
Both engines walk through the same states in native loops; the time is the thread's CPU time per
evaluation, minimum and median over the rounds.  Accelerations are compared first.
"""

from __future__ import annotations

import argparse
import ctypes
import json
import platform
import shutil
import statistics
import subprocess
import sys
import sysconfig
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import mstmm

HERE = Path(__file__).resolve().parent
#: Pinocchio's own public definitions (pinocchioTargets.cmake).
DEFINITIONS = (
    "BOOST_MPL_LIMIT_LIST_SIZE=30",
    "BOOST_MPL_LIMIT_VECTOR_SIZE=30",
    "BOOST_MPL_CFG_NO_PREPROCESSED_HEADERS",
    "BOOST_FUSION_INVOKE_MAX_ARITY=12",
    "NDEBUG",
)
TRANSVERSE, AXIAL = 1 / 12, 1 / 1200


def build_pinocchio(folder: Path, level: str) -> ctypes.CDLL:
    """Compile chain_aba.cpp against the headers of the pin wheel."""
    prefix = Path(sysconfig.get_paths()["purelib"]) / "cmeel.prefix" / "include"
    if not (prefix / "pinocchio").is_dir() or not (prefix / "eigen3").is_dir():
        raise SystemExit("this Python lacks pin or cmeel-eigen: pip install pin cmeel-eigen")
    target = folder / f"chain_aba_{level}.so"
    if target.exists() and target.stat().st_mtime > (HERE / "chain_aba.cpp").stat().st_mtime:
        return declared(target)
    flags = [f"-{level}", "-std=c++17", "-march=native", "-w", "-shared", "-fPIC"]
    flags += [f"-D{name}" for name in DEFINITIONS] + [f"-I{prefix}", f"-I{prefix / 'eigen3'}"]
    subprocess.run(
        [shutil.which("g++") or "g++", *flags, str(HERE / "chain_aba.cpp"), "-o", str(target)],
        check=True,
    )
    return declared(target)


def declared(target: Path) -> ctypes.CDLL:
    """The library with the signatures of its functions."""
    library = ctypes.CDLL(str(target))
    library.chain_new.restype = ctypes.c_void_p
    library.chain_new.argtypes = [ctypes.c_int, ctypes.c_double, ctypes.c_double]
    library.chain_free.argtypes = [ctypes.c_void_p]
    pointers = [ctypes.c_void_p] * 3
    library.chain_aba.argtypes = [ctypes.c_void_p, ctypes.c_int, ctypes.c_int, *pointers]
    return library


def chain_scene(n: int) -> dict[str, Any]:
    """The same chain as a scene."""
    axes = np.eye(3).tolist()
    bodies = [
        {
            "name": f"rod{i}",
            "mass": 1.0,
            "center_of_mass": [0.5, 0.0, 0.0],
            "inertia": [AXIAL, TRANSVERSE, TRANSVERSE],
            "ends": {"tip": [1.0, 0.0, 0.0]},
        }
        for i in range(n)
    ]
    hinges = [
        {
            "name": f"pin{i}",
            "type": "pin",
            "inboard": f"rod{i - 1}.tip" if i else "ground",
            "outboard": f"rod{i}",
            "axis": axes[i % 3],
        }
        for i in range(n)
    ]
    return {"schema_version": 1, "gravity": [0, 0, -9.81], "body": bodies, "hinge": hinges}


def thread_time(work: Callable[[], object]) -> float:
    """CPU seconds of this thread."""
    begin = time.thread_time_ns()
    work()
    return (time.thread_time_ns() - begin) * 1e-9


def contenders(n: int, count: int, libraries: dict[str, ctypes.CDLL]) -> dict[str, Any]:
    """Name -> (function that evaluates all states, its output)."""
    rng = np.random.default_rng(n)
    q, v = rng.uniform(-1, 1, (count, n)), rng.uniform(-1, 1, (count, n))
    model = mstmm.compile(mstmm.Scene(**chain_scene(n)), engine="looped")

    def own() -> np.ndarray:
        return model.accelerations(q, v, threads=1)

    found = {"mstmm looped": (own, own())}
    for level, library in libraries.items():
        chain = library.chain_new(n, TRANSVERSE, AXIAL)
        for world, convention in ((0, "local"), (1, "world")):
            out = np.empty_like(q)
            arrays = [x.ctypes.data for x in (q, v, out)]

            def work(
                library: ctypes.CDLL = library, chain: int = chain, world: int = world,
                arrays: list[int] = arrays,
            ) -> None:  # fmt: skip
                library.chain_aba(chain, count, world, *arrays)

            work()
            found[f"pinocchio {level} {convention}"] = (work, out)
    return found


def measure(n: int, rounds: int, libraries: dict[str, ctypes.CDLL]) -> dict[str, Any]:
    """Nanoseconds per evaluation of every contender, in alternating rounds."""
    count = max(4, min(2000, 100_000 // n))
    found = contenders(n, count, libraries)
    reference = found["mstmm looped"][1]
    scale = np.abs(reference).max()
    samples: dict[str, list[float]] = {name: [] for name in found}
    for _ in range(rounds):
        for name, (work, _) in found.items():
            samples[name].append(thread_time(work) / count * 1e9)
    return {
        "bodies": n,
        "states": count,
        "disagreement": {
            k: float(np.abs(o - reference).max() / scale) for k, (_, o) in found.items()
        },
        "samples_ns": samples,
    }


def table(results: list[dict[str, Any]]) -> str:
    """Minimum and median per engine, and how many times the looped engine is faster."""
    lines = [f"{'bodies':>7} {'engine':<24} {'min ns':>12} {'median ns':>12} {'ns/body':>9} "
             f"{'ratio':>6} {'disagreement':>13}"]  # fmt: skip
    for result in results:
        own = min(result["samples_ns"]["mstmm looped"])
        for name, values in result["samples_ns"].items():
            best = min(values)
            middle = statistics.median(values)
            lines.append(
                f"{result['bodies']:>7} {name:<24} {best:>12.0f} {middle:>12.0f} "
                f"{best / result['bodies']:>9.1f} {best / own:>6.2f} "
                f"{result['disagreement'][name]:>13.1e}"
            )
    return "\n".join(lines)


def machine() -> dict[str, Any]:
    """What the figures were taken on."""
    info = Path("/proc/cpuinfo")
    names = [line.partition(":")[2].strip() for line in info.read_text().splitlines()
             if line.startswith("model name")] if info.exists() else []  # fmt: skip
    return {"processor": names[0] if names else platform.processor(), "cores": len(names),
            "python": sys.version.split()[0]}  # fmt: skip


def main() -> None:
    """Build, measure, print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("bodies", nargs="*", type=int, default=[7, 100, 10000])
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--levels", nargs="*", default=["O2", "O3"])
    parser.add_argument("--build", type=Path, default=HERE.parents[1] / "build" / HERE.name)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    options.build.mkdir(parents=True, exist_ok=True)
    libraries = {level: build_pinocchio(options.build, level) for level in options.levels}
    results = [measure(n, options.rounds, libraries) for n in options.bodies]
    print(table(results))
    if options.json:
        options.json.write_text(
            json.dumps({"machine": machine(), "results": results}, indent=1) + "\n"
        )


if __name__ == "__main__":
    main()
