"""Andrews' squeezer of the examples, run to an equal error by mstmm, Pinocchio and Exudyn."""

from __future__ import annotations

import ctypes
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from common import dop853, native, pinocchio_peer

import mstmm

HERE = Path(__file__).resolve().parent
SCENE = HERE.parents[1] / "examples" / "andrews" / "scene.toml"
T_END, TORQUE = 0.03, 0.033
#: Of beta after 0.03 s, of two trees at 1e-13 that agree to 6e-14.
BETA = 15.81077119515385
Run = Callable[[], float]


class Data:
    """Bodies, tree and loops of the scene, in the order in which they hang on each other."""

    def __init__(self, model: mstmm.Model) -> None:
        scene = tomllib.loads(SCENE.read_text(encoding="utf-8"))
        self.body = {one["name"]: one for one in scene["body"]}
        tree = [one for one in scene["hinge"] if one["name"] not in model.loops.cut_hinges]
        self.hinge: list[dict[str, Any]] = []
        known = {"ground"}
        while len(self.hinge) < len(tree):
            one = next(h for h in tree if h not in self.hinge and _body(h["inboard"]) in known)
            self.hinge.append(one)
            known.add(_body(one["outboard"]))
        self.order = [_body(one["outboard"]) for one in self.hinge]
        self.closing = [one for one in scene["hinge"] if one["name"] in model.loops.cut_hinges]
        self.spring = scene["spring"][0]
        q, _ = model.initial_state()
        self.start = np.array(
            [q[model.coordinate_layout.hinges[one["name"]].q] for one in self.hinge]
        )

    def point(self, end: str) -> tuple[str, list[float]]:
        """Body and place of an end."""
        body, _, name = end.partition(".")
        return body, list(self.body[body]["ends"][name]) if name else [0.0, 0.0, 0.0]

    def foot(self, hinge: dict[str, Any]) -> tuple[str, list[float]]:
        """Body and place at which the inboard side of a hinge is."""
        if hinge["inboard"] == "ground":
            return "ground", list(hinge.get("position", [0.0, 0.0, 0.0]))
        return self.point(hinge["inboard"])


def _body(end: str) -> str:
    return end.partition(".")[0]


def mstmm_runs(model: mstmm.Model) -> dict[str, Run]:
    """The whole call of `simulate`, loops kept closed step by step."""
    beta = model.coordinate_layout.hinges["beta"].q

    def run(tolerance: float) -> float:
        result = model.simulate(
            T_END, "dop853", rtol=tolerance, atol=tolerance, output_times=[T_END]
        )
        return float(result.q[-1, beta])

    return {f"rtol {t:.0e}": lambda t=t: run(t) for t in 10.0 ** -np.arange(4.0, 9.1, 0.5)}


def pinocchio_runs(data: Data) -> dict[str, Run]:
    """Its constrained dynamics, built from the headers of the wheel, in DOP853 in C."""
    library = _opened()
    spring, law = data.spring, data.spring["law"]
    sprung, end = data.point(spring["to"])
    pin = next(one["position"] for one in data.hinge if _body(one["outboard"]) == sprung)
    points = np.array([*spring["position"][:2], *pin[:2], *end[:2]])
    made = ctypes.c_void_p(library.squeezer_new(
        TORQUE, law["stiffness"], law["rest"], points.ctypes.data, data.order.index(sprung)
    ))  # fmt: skip
    for hinge in data.hinge:
        body = data.body[_body(hinge["outboard"])]
        parent, place = data.foot(hinge)
        library.squeezer_body(
            made, data.order.index(parent) if parent != "ground" else -1, _numbers(place),
            body["mass"], _numbers(body["center_of_mass"]), body["inertia"][2],
        )  # fmt: skip
    for hinge in data.closing:
        (one, place), (other, there) = data.foot(hinge), data.point(hinge["outboard"])
        library.squeezer_loop(
            made, data.order.index(one), _numbers(place), data.order.index(other), _numbers(there)
        )  # fmt: skip
    library.squeezer_ready(made)
    f = ctypes.c_void_p.in_dll(library, "squeezer_rates").value
    q = data.start[None, :]
    subject = native.Subject(f or 0, made.value or 0, q, 0 * q, keep=library)
    return {f"rtol {t:.0e}": lambda t=t: float(dop853.run(subject, T_END, t)[0][0])
            for t in 10.0 ** -np.arange(4.0, 9.1, 0.5)}  # fmt: skip


def _numbers(values: list[float]) -> Any:
    return (ctypes.c_double * 3)(*values)


def _opened() -> ctypes.CDLL:
    text = (HERE / "squeezer.cpp").read_text()
    flags = pinocchio_peer.flags("O3")
    found = ctypes.CDLL(str(native.library("squeezer", text, flags, "g++", ".cpp")))
    pointer, number, count = ctypes.c_void_p, ctypes.c_double, ctypes.c_int
    found.squeezer_new.restype = pointer
    found.squeezer_new.argtypes = [number, number, number, pointer, count]
    found.squeezer_body.argtypes = [pointer, count, pointer, number, pointer, number]
    found.squeezer_loop.argtypes = [pointer, count, pointer, count, pointer]
    found.squeezer_ready.argtypes = [pointer]
    return found


def exudyn_runs(data: Data) -> dict[str, Run]:
    """Its generalized alpha by ever more steps, dense solver; the system is made once."""
    from exudyn_planar import Planar

    made = Planar()
    bodies, places, angles = {"ground": made.ground}, {"ground": np.zeros(2)}, {"ground": 0.0}
    for hinge, angle in zip(data.hinge, data.start, strict=True):
        name = _body(hinge["outboard"])
        parent, place = data.foot(hinge)
        c, s = np.cos(angles[parent]), np.sin(angles[parent])
        places[name] = places[parent] + np.array([[c, -s], [s, c]]) @ place[:2]
        angles[name] = angles[parent] + float(angle)
        body = data.body[name]
        bodies[name] = made.body(
            places[name], angles[name], body["center_of_mass"][:2], body["mass"],
            body["inertia"][2],
        )  # fmt: skip
        made.pin(bodies[parent], place[:2], bodies[name], (0.0, 0.0))
    for hinge in data.closing:
        (one, place), (other, there) = data.foot(hinge), data.point(hinge["outboard"])
        made.pin(bodies[one], place[:2], bodies[other], there[:2])
    to, end = data.point(data.spring["to"])
    law = data.spring["law"]
    made.spring(made.ground, data.spring["position"][:2], bodies[to], end[:2],
                law["stiffness"], law["rest"])  # fmt: skip
    crank = bodies[data.order[0]]
    made.torque(crank, TORQUE)
    made.system.Assemble()

    def run(steps: int) -> float:
        made.run(T_END, steps, sparse=False, modified=True)
        return made.angle(crank)

    return {f"{n} steps": lambda n=n: run(n) for n in (1200 * 2**k for k in range(6))}


def around(runs: dict[str, Run], asked: float) -> dict[str, tuple[Run, float]]:
    """The first setting, from coarse to fine, whose error of beta (rad) is as asked, with that
    before it: how each runs, and its error.

    RuntimeError where none is.
    """
    before: dict[str, tuple[Run, float]] = {}
    for name, run in runs.items():
        found = {name: (run, abs(run() - BETA))}
        if found[name][1] <= asked:
            return before | found
        before = found
    raise RuntimeError(f"no setting keeps {asked} rad")


def at_error(asked: float, errors: list[float], times: list[float]) -> float:
    """The time at an error between those of two settings, along a line in logarithms."""
    if len(times) == 1:
        return times[0]
    return float(np.exp(np.interp(-np.log(asked), -np.log(errors), np.log(times))))
