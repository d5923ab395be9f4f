"""Code compiled for scenes with closed loops, side by side with the tree and with MuJoCo.

    python benchmarks/loops/fused.py [--quick]

CPU time of one evaluation of accelerations, contenders in alternating rounds: a planar four-bar and
the open chain of its three rods; Stewart's platform by both engines, by code of its own for several
states in the lanes of vectors, and beside MuJoCo's equality constraints (if it is there).  `apart`
tells how far accelerations of the platform are from those of the looped engine.
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
from run import platform, slides  # noqa: E402

import mstmm  # noqa: E402

LENGTHS = {"crank": 0.5, "coupler": 1.1, "rocker": 0.8}
#: States, and how often a round walks through them.
STATES, WALKS = 64, 100


def rods(closed: bool) -> mstmm.Scene:
    """Three rods in a row on pins; closed, the end of the last is a pin on the ground."""
    bodies, hinges = list[dict[str, Any]](), list[dict[str, Any]]()
    inboard = "ground"
    for (name, length), angle in zip(LENGTHS.items(), (0.7, -0.1, -2.0), strict=True):
        moment = length**2 / 12
        bodies.append({
            "name": name, "mass": 1.0, "center_of_mass": [length / 2, 0, 0],
            "inertia": [0.0, moment, moment], "ends": {"tip": [length, 0, 0]},
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


def states(model: mstmm.Model) -> tuple[np.ndarray, np.ndarray]:
    """The start with speeds all around it."""
    q, u = model.initial_state()
    drawn = np.random.default_rng(0).normal(scale=0.1, size=(STATES, model.nu))
    return np.tile(q, (STATES, 1)), u + drawn


def contenders(name: str, scene: mstmm.Scene) -> dict[str, Callable[[], float]]:
    """Microseconds of one evaluation by the looped engine, by code of the scene, and by the same in
    lanes; compared before anybody is timed."""
    looped, fused = (mstmm.compile(scene, engine=engine) for engine in ("looped", "fused"))
    q, u = states(looped)
    wanted = looped.accelerations(q, u)
    lanes = mstmm_engines.Lanes(fused, q, u)
    subjects = {"looped": mstmm_engines.looped(looped, q, u),
                "fused": mstmm_engines.fused(fused, q, u)}  # fmt: skip
    lanes()
    for found in (lanes.udot, *(one.accelerations() for one in subjects.values())):
        assert measure.disagreement(found, wanted) < 1e-12, name
    work = {f"{name}, {engine}": lambda one=one: 1e-3 * one.time(False, WALKS)
            for engine, one in subjects.items()}  # fmt: skip
    return work | {f"{name}, lanes": lambda: 1e6 * measure.once(lanes) / STATES}


def measured(quick: bool) -> tuple[dict[str, list[float]], float | None]:
    """Samples by contender, and how far MuJoCo's legs are off; None where it is not there."""
    scenes = {"open rods": rods(False), "four-bar": rods(True), "platform": platform()}
    work = {key: one for name, scene in scenes.items() for key, one in
            contenders(name, scene).items()}  # fmt: skip
    apart = None
    try:
        from mujoco_platform import MujocoPlatform

        model = mstmm.compile(scenes["platform"], engine="looped")
        peer = MujocoPlatform(model)
        apart = measure.disagreement(peer.slides(), slides(model))
        work["platform, MuJoCo"] = lambda: 1e6 * measure.once(lambda: peer.forward(1000)) / 1000
    except ImportError:
        print("MuJoCo is not here")
    return measure.rounds(work, 2 if quick else 15), apart


def table(samples: dict[str, list[float]], apart: float | None) -> str:
    """Least times, and ratios."""
    least = {name: min(found) for name, found in samples.items()}
    lines = ["# Closed loops by code of their own", "", "| contender | us an evaluation |",
             "|---|---|", *(f"| {name} | {us:.3g} |" for name, us in least.items())]  # fmt: skip
    ratio = least["four-bar, fused"] / least["open rods, fused"]
    lines += ["", f"Four-bar / open chain of its rods, where 2 was asked at most: {ratio:.2f}."]
    if apart is not None:
        one, many = (
            least[f"platform, {how}"] / least["platform, MuJoCo"] for how in ("fused", "lanes")
        )
        lines += [
            "", f"Platform, mstmm / MuJoCo, where 0.3 was asked at most: {one:.2f}, in lanes "
            f"{many:.3f}. MuJoCo's rows yield, as stiff as it lets them be: its legs are off by "
            f"{apart:.1e}, ours agree to rounding.",
        ]  # fmt: skip
    return "\n".join(lines) + "\n"


def main() -> None:
    """Measures and writes fused.json and fused.md; with --quick it only prints."""
    quick = "--quick" in sys.argv
    samples, apart = measured(quick)
    print(table(samples, apart))
    if not quick:
        measure.save(HERE / "fused.json", samples, apart=apart)
        (HERE / "fused.md").write_text(table(samples, apart), encoding="utf-8")


if __name__ == "__main__":
    main()
