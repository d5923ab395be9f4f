"""Andrews' squeezer of the examples, run to the same error by mstmm, Pinocchio and Exudyn."""

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
    """Bodies, tree and loops of the scene, sorted from the root."""

    def __init__(self, model: mstmm.Model) -> None:
        scene = tomllib.loads(SCENE.read_text(encoding="utf-8"))
        self.body = {hinge["name"]: hinge for hinge in scene["body"]}
        tree = [hinge for hinge in scene["hinge"] if hinge["name"] not in model.loops.cut_hinges]
        self.hinge: list[dict[str, Any]] = []
        attached = {"ground"}
        while len(self.hinge) < len(tree):
            hinge = next(
                h for h in tree if h not in self.hinge and _body_name(h["inboard"]) in attached
            )
            self.hinge.append(hinge)
            attached.add(_body_name(hinge["outboard"]))
        self.body_names = [_body_name(hinge["outboard"]) for hinge in self.hinge]
        self.cut_hinges = [
            hinge for hinge in scene["hinge"] if hinge["name"] in model.loops.cut_hinges
        ]
        self.spring = scene["spring"][0]
        q, _ = model.initial_state()
        self.initial_angles = np.array(
            [q[model.coordinate_layout.hinges[hinge["name"]].q] for hinge in self.hinge]
        )

    def point(self, end: str) -> tuple[str, list[float]]:
        """Body and position of an end."""
        body, _, name = end.partition(".")
        return body, list(self.body[body]["ends"][name]) if name else [0.0, 0.0, 0.0]

    def inboard_point(self, hinge: dict[str, Any]) -> tuple[str, list[float]]:
        """Inboard body of a hinge and position on it."""
        if hinge["inboard"] == "ground":
            return "ground", list(hinge.get("position", [0.0, 0.0, 0.0]))
        return self.point(hinge["inboard"])


def _body_name(end: str) -> str:
    return end.partition(".")[0]


def mstmm_runs(model: mstmm.Model) -> dict[str, Run]:
    """Whole calls of `simulate` with projection in each step."""
    beta = model.coordinate_layout.hinges["beta"].q

    def run(tolerance: float) -> float:
        result = model.simulate(
            T_END, "dop853", rtol=tolerance, atol=tolerance, output_times=[T_END]
        )
        return float(result.q[-1, beta])

    return {f"rtol {t:.0e}": lambda t=t: run(t) for t in 10.0 ** -np.arange(4.0, 9.1, 0.5)}


def pinocchio_runs(data: Data) -> dict[str, Run]:
    """Pinocchio's constrained dynamics in DOP853 in C."""
    library = _open_library()
    spring, law = data.spring, data.spring["law"]
    spring_body, end = data.point(spring["to"])
    pin = next(
        first["position"] for first in data.hinge if _body_name(first["outboard"]) == spring_body
    )
    points = np.array([*spring["position"][:2], *pin[:2], *end[:2]])
    model = ctypes.c_void_p(library.squeezer_new(
        TORQUE, law["stiffness"], law["rest"], points.ctypes.data,
        data.body_names.index(spring_body)
    ))  # fmt: skip
    for hinge in data.hinge:
        body = data.body[_body_name(hinge["outboard"])]
        parent, position = data.inboard_point(hinge)
        library.squeezer_body(
            model, data.body_names.index(parent) if parent != "ground" else -1,
            _three_doubles(position),
            body["mass"], _three_doubles(body["center_of_mass"]), body["inertia"][2],
        )  # fmt: skip
    for hinge in data.cut_hinges:
        (first, position), (second, second_position) = (
            data.inboard_point(hinge),
            data.point(hinge["outboard"]),
        )
        library.squeezer_loop(
            model, data.body_names.index(first), _three_doubles(position),
            data.body_names.index(second), _three_doubles(second_position)
        )  # fmt: skip
    library.squeezer_ready(model)
    f = ctypes.c_void_p.in_dll(library, "squeezer_rates").value
    q = data.initial_angles[None, :]
    subject = native.Subject(f or 0, model.value or 0, q, 0 * q, owner=library)
    return {f"rtol {t:.0e}": lambda t=t: float(dop853.run(subject, T_END, t)[0][0])
            for t in 10.0 ** -np.arange(4.0, 9.1, 0.5)}  # fmt: skip


def _three_doubles(values: list[float]) -> Any:
    return (ctypes.c_double * 3)(*values)


def _open_library() -> ctypes.CDLL:
    text = (HERE / "squeezer.cpp").read_text()
    flags = pinocchio_peer.compiler_flags("O3")
    library = ctypes.CDLL(str(native.compile_library("squeezer", text, flags, "g++", ".cpp")))
    pointer, number, count = ctypes.c_void_p, ctypes.c_double, ctypes.c_int
    library.squeezer_new.restype = pointer
    library.squeezer_new.argtypes = [number, number, number, pointer, count]
    library.squeezer_body.argtypes = [pointer, count, pointer, number, pointer, number]
    library.squeezer_loop.argtypes = [pointer, count, pointer, count, pointer]
    library.squeezer_ready.argtypes = [pointer]
    return library


def exudyn_runs(data: Data) -> dict[str, Run]:
    """Exudyn's generalised alpha with increasing numbers of steps, dense solver."""
    from exudyn_planar import Planar

    system = Planar()
    bodies, positions, angles = {"ground": system.ground}, {"ground": np.zeros(2)}, {"ground": 0.0}
    for hinge, angle in zip(data.hinge, data.initial_angles, strict=True):
        name = _body_name(hinge["outboard"])
        parent, position = data.inboard_point(hinge)
        c, s = np.cos(angles[parent]), np.sin(angles[parent])
        positions[name] = positions[parent] + np.array([[c, -s], [s, c]]) @ position[:2]
        angles[name] = angles[parent] + float(angle)
        body = data.body[name]
        bodies[name] = system.add_body(
            positions[name], angles[name], body["center_of_mass"][:2], body["mass"],
            body["inertia"][2],
        )  # fmt: skip
        system.add_pin(bodies[parent], position[:2], bodies[name], (0.0, 0.0))
    for hinge in data.cut_hinges:
        (first, position), (second, second_position) = (
            data.inboard_point(hinge),
            data.point(hinge["outboard"]),
        )
        system.add_pin(bodies[first], position[:2], bodies[second], second_position[:2])
    spring_target, end = data.point(data.spring["to"])
    law = data.spring["law"]
    system.add_spring(system.ground, data.spring["position"][:2], bodies[spring_target], end[:2],
                law["stiffness"], law["rest"])  # fmt: skip
    crank = bodies[data.body_names[0]]
    system.add_torque(crank, TORQUE)
    system.system.Assemble()

    def run(steps: int) -> float:
        system.run(T_END, steps, sparse=False, reuse_jacobian=True)
        return system.angle(crank)

    return {f"{n} steps": lambda n=n: run(n) for n in (1200 * 2**k for k in range(6))}


def bracket_error(runs: dict[str, Run], target_error: float) -> dict[str, tuple[Run, float]]:
    """The first setting, from coarse to fine, whose error of beta (rad) is as asked, with that
    before it: how each runs, and its error.

    RuntimeError where none is.
    """
    previous: dict[str, tuple[Run, float]] = {}
    for name, run in runs.items():
        candidate = {name: (run, abs(run() - BETA))}
        if candidate[name][1] <= target_error:
            return previous | candidate
        previous = candidate
    raise RuntimeError(f"no setting reaches {target_error} rad")


def interpolate_time(target_error: float, errors: list[float], times: list[float]) -> float:
    """Time at an error, interpolated between two settings in logarithms."""
    if len(times) == 1:
        return times[0]
    return float(np.exp(np.interp(-np.log(target_error), -np.log(errors), np.log(times))))
