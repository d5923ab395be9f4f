"""Fused code of scenes with closed loops, compared with an open tree and with MuJoCo.

    python benchmarks/loops/fused.py [--quick]

CPU time of one evaluation of accelerations in alternating rounds: a planar four-bar and the open
chain of its three rods; Stewart's platform on both engines, in vector lanes, and with MuJoCo's
equality constraints if it is installed (`difference`: of its accelerations from the looped engine).
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parent), str(HERE)]

from common import measure, mstmm_engines  # noqa: E402
from run import leg_accelerations, platform  # noqa: E402

import mstmm  # noqa: E402

LENGTHS = {"crank": 0.5, "coupler": 1.1, "rocker": 0.8}
#: Number of states, and evaluations of all of them per sample.
STATES, REPEATS = 64, 100


def rods(closed: bool) -> mstmm.Scene:
    """Three rods in a row on pins; closed, the end of the last is a pin on the ground."""
    bodies, hinges = list[dict[str, Any]](), list[dict[str, Any]]()
    inboard = "ground"
    for (name, length), angle in zip(LENGTHS.items(), (0.7, -0.1, -2.0), strict=True):
        inertia = length**2 / 12
        bodies.append({
            "name": name, "mass": 1.0, "center_of_mass": [length / 2, 0, 0],
            "inertia": [0.0, inertia, inertia], "ends": {"tip": [length, 0, 0]},
        })  # fmt: skip
        hinges.append({
            "name": f"{name}_pin", "type": "pin", "inboard": inboard, "outboard": name,
            "initial": {"q": angle},
        })  # fmt: skip
        inboard = f"{name}.tip"
    if closed:
        hinges.append({
            "name": "foot", "type": "pin", "inboard": "ground", "outboard": inboard,
            "position": [1.2, 0, 0], "cut": True,
        })  # fmt: skip
    return mstmm.Scene(gravity=[0, -9.81, 0], body=bodies, hinge=hinges)


def random_states(model: mstmm.Model) -> tuple[np.ndarray, np.ndarray]:
    """Initial state with random speeds."""
    q, u = model.initial_state()
    perturbation = np.random.default_rng(0).normal(scale=0.1, size=(STATES, model.nu))
    return np.tile(q, (STATES, 1)), u + perturbation


def timed_calls(name: str, scene: mstmm.Scene) -> dict[str, Callable[[], float]]:
    """Microseconds of one evaluation on the looped and the fused engine and in vector lanes, with
    compared results."""
    looped, fused = (mstmm.compile(scene, engine=engine) for engine in ("looped", "fused"))
    q, u = random_states(looped)
    expected = looped.accelerations(q, u)
    lanes = mstmm_engines.Lanes(fused, q, u)
    subjects = {"looped": mstmm_engines.looped_subject(looped, q, u),
                "fused": mstmm_engines.fused_subject(fused, q, u)}  # fmt: skip
    lanes()
    for udot in (lanes.udot, *(subject.accelerations() for subject in subjects.values())):
        assert measure.relative_difference(udot, expected) < 1e-12, name
    work = {f"{name}, {engine}": lambda subject=subject: 1e-3 * subject.time(False, REPEATS)
            for engine, subject in subjects.items()}  # fmt: skip
    return work | {f"{name}, lanes": lambda: 1e6 * measure.call_time(lanes) / STATES}


def measure_all(quick: bool) -> tuple[dict[str, list[float]], float | None]:
    """Samples by program, and the difference of MuJoCo's accelerations or None."""
    scenes = {"open rods": rods(False), "four-bar": rods(True), "platform": platform()}
    work = {key: call for name, scene in scenes.items() for key, call in
            timed_calls(name, scene).items()}  # fmt: skip
    difference = None
    try:
        from mujoco_platform import MujocoPlatform

        model = mstmm.compile(scenes["platform"], engine="looped")
        peer = MujocoPlatform(model)
        difference = measure.relative_difference(peer.leg_accelerations(), leg_accelerations(model))
        work["platform, MuJoCo"] = lambda: (
            1e6 * measure.call_time(lambda: peer.forward(1000)) / 1000
        )
    except ImportError:
        print("MuJoCo is not installed")
    return measure.sample_rounds(work, 2 if quick else 15), difference


def table(samples: dict[str, list[float]], difference: float | None) -> str:
    """Markdown: minimum times and ratios."""
    times = {name: min(values) for name, values in samples.items()}
    lines = ["# Fused code of closed loops", "", "| program | us per evaluation |", "|---|---|"]
    lines += [f"| {name} | {us:.3g} |" for name, us in times.items()]
    ratio = times["four-bar, fused"] / times["open rods, fused"]
    lines += ["", f"Four-bar / open chain of its rods: {ratio:.2f} (target: at most 2)."]
    if difference is not None:
        fused, lanes = (times[f"platform, {x}"] / times["platform, MuJoCo"]
                        for x in ("fused", "lanes"))  # fmt: skip
        lines += ["", f"Platform, mstmm / MuJoCo: {fused:.2f} (target: at most 0.3), in lanes "
                  f"{lanes:.3f}. MuJoCo's constraints are soft: its accelerations differ by "
                  f"{difference:.1e}."]  # fmt: skip
    return "\n".join(lines) + "\n"


def main() -> None:
    """Measure and write fused.json and fused.md; with --quick only print."""
    quick = "--quick" in sys.argv
    samples, difference = measure_all(quick)
    print(table(samples, difference))
    if not quick:
        measure.save_record(HERE / "fused.json", samples, difference=difference)
        (HERE / "fused.md").write_text(table(samples, difference), encoding="utf-8")


if __name__ == "__main__":
    main()
