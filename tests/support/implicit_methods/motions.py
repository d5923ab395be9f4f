"""Motions on which implicit methods show what they can do, and where they are known to fail.

Each is a scene with what its motion is compared with: a closed form beside the scene, or places at
the end by explicit methods at tight tolerances (all of them are
asked for in `tests/system/implicit_methods/test_motions.py`).  Planar scenes lie in x-y; SI units.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import scipy.linalg

Array = npt.NDArray[np.float64]
Scene = dict[str, Any]

GRAVITY = 9.81
DOWN = [0.0, -GRAVITY, 0.0]
STILL = [0.0, 0.0, 0.0]


def _rod(name: str) -> Scene:
    """A uniform rod along x, 1 m and 1 kg."""
    return {
        "name": name, "mass": 1.0, "center_of_mass": [0.5, 0.0, 0.0],
        "inertia": [1e-3, 1 / 12, 1 / 12], "ends": {"tip": [1.0, 0.0, 0.0]},
    }  # fmt: skip


def _chain(gravity: list[float], hinges: list[Scene], **more: Any) -> Scene:
    """Rods in a row, each on one of these hinges."""
    joined = [
        {
            "name": f"hinge{i}", "inboard": f"rod{i - 1}.tip" if i else "ground",
            "outboard": f"rod{i}", **hinge,
        }
        for i, hinge in enumerate(hinges)
    ]  # fmt: skip
    bodies = [_rod(f"rod{i}") for i in range(len(hinges))]
    return {"gravity": gravity, "body": bodies, "hinge": joined, **more}


def bushing(k: float, zeta: float, **more: Any) -> Scene:
    """A planar hinge with springs k (N/m) and dampers, `zeta` relative to 1 kg, free to turn."""
    c = 2 * zeta * np.sqrt(k)
    return {
        "type": "planar", "law": {"stiffness": [k, k, 0.0], "damping": [c, c, 0.0]}, **more,
    }  # fmt: skip


# --- prescribed motion ----------------------------------------------------------------------------

#: Of the base, m: 0.1 sin(3 t).
BASE = (0.1, 3.0)


def moving_base(k: float = 1e8, zeta: float = 1.0) -> Scene:
    """1 kg on a spring (N/m) and damper upon a base that is driven along y; no weight."""
    height, w = BASE
    law = {"stiffness": k, "damping": 2 * zeta * np.sqrt(k)}
    along = {"type": "prismatic", "axis": [0.0, 1.0, 0.0]}
    return {
        "gravity": STILL,
        "body": [{"name": "base", "mass": 1.0}, {"name": "mass", "mass": 1.0}],
        "hinge": [
            {"name": "base_slide", **along, "inboard": "ground", "outboard": "base",
             "drive": f"{height}*sin({w}*t)"},
            {"name": "spring", **along, "inboard": "base", "outboard": "mass", "law": law},
        ],
    }  # fmt: skip


def moving_base_stretch(t: float, k: float = 1e8, zeta: float = 1.0) -> float:
    """Stretch (m) of its spring at t: x'' + 2 zeta w0 x' + w0^2 x = a w^2 sin(w t), from rest.

    The steady part has amplitude and phase of Landau, Lifshitz, Mechanics, section 26; the rest,
    which starts it from rest, dies away.
    """
    height, w = BASE
    w0 = np.sqrt(k)
    answer = height * w**2 / (w0**2 - w**2 + 2j * zeta * w0 * w)
    free = np.array([[0.0, 1.0], [-(w0**2), -2 * zeta * w0]])
    start = np.array([-answer.imag, -w * answer.real])
    steady = float((answer * np.exp(1j * w * t)).imag)
    return steady + float((scipy.linalg.expm(free * t) @ start)[0])


def driven_root(k: float, zeta: float = 0.01) -> Scene:
    """Three rods: the first swung by its pin, the others on bushings (k in N/m)."""
    swung = {"type": "pin", "drive": "0.5*sin(2*t)"}
    return _chain(DOWN, [swung, bushing(k, zeta), bushing(k, zeta)])


# --- rods on pins, bushings and balls -------------------------------------------------------------


def double_pendulum(k: float | None = None, stretch: float = 0.0) -> Scene:
    """Two rods from horizontal rest, on pins or, with k (N/m), on bushings without damping of
    which the first begins stretched (m) along the rods."""
    if k is None:
        return _chain(DOWN, [{"type": "pin"}, {"type": "pin"}])
    first = bushing(k, 0.0, initial={"q": [stretch, 0.0, 0.0]})
    return _chain(DOWN, [first, bushing(k, 0.0)])


def spatial_rods() -> Scene:
    """Two rods on balls, along x, that turn at (2, 0, 1.5) and (-1, 1, 0.5) rad/s; weight along
    -z."""
    turning = np.array([[2.0, 0.0, 1.5], [-1.0, 1.0, 0.5]])
    upright = [1.0, 0.0, 0.0, 0.0]
    scene = _chain(
        [0.0, 0.0, -GRAVITY],
        [{"type": "ball", "initial": {"q": upright, "u": u.tolist()}}
         for u in (turning[0], turning[1] - turning[0])],
    )  # fmt: skip
    for body in scene["body"]:
        body["inertia"] = [0.01, 0.09, 0.09]
    return scene


def upright_chain(count: int, angle: float = 1e-3) -> Scene:
    """Rods on pins that stand on one another, the first tilted (rad)."""
    hinges: list[Scene] = [{"type": "pin"} for _ in range(count)]
    hinges[0] |= {"orientation": [0.0, 0.0, np.pi / 2], "initial": {"q": [angle]}}
    return _chain(DOWN, hinges)


def hanging_chain(count: int, weight: float = 0.0, angle: float = 0.1) -> Scene:
    """Rods on pins that hang, the first pulled aside (rad), a load (N) on the last tip."""
    hinges: list[Scene] = [{"type": "pin"} for _ in range(count)]
    hinges[0] |= {"orientation": [0.0, 0.0, -np.pi / 2], "initial": {"q": [angle]}}
    load = {"on": f"rod{count - 1}.tip", "force": [0.0, -weight, 0.0]}
    return _chain(DOWN, hinges, load=[load])


def chain_frequencies(count: int, weight: float = 0.0) -> Array:
    """Frequencies (rad/s) of the hanging chain, ascending; without load also the rates (1/s) at
    which the upright one falls.

    Absolute angles: rod j moves the mass centre of rod k by c_kj = 1 (j < k), 1/2 (j = k), so
    that M = sum_k c_k c_k^T + 1/12 and K = diag(g sum_k c_kj + weight).
    """
    arms = np.tril(np.ones((count, count)), -1) + np.eye(count) / 2
    M = arms.T @ arms + np.eye(count) / 12
    K = np.diag(GRAVITY * arms.sum(axis=0) + weight)
    return np.sqrt(scipy.linalg.eigh(K, M, eigvals_only=True))


# --- contact --------------------------------------------------------------------------------------


def stop(k: float = 1e6, gap: float = 0.01, speed: float = 1.0) -> Scene:
    """1 kg without weight that flies at `speed` (m/s) against an undamped stop (N/m) `gap` (m)
    away; in contact it moves at sqrt(k) rad/s."""
    return {
        "gravity": STILL,
        "body": [{"name": "mass", "mass": 1.0}],
        "hinge": [{
            "name": "rail", "type": "prismatic", "axis": [1.0, 0.0, 0.0], "inboard": "ground",
            "outboard": "mass", "initial": {"q": [-gap], "u": [speed]},
            "law": {"limits": {"upper": 0.0, "stiffness": k}},
        }],
    }  # fmt: skip


def stop_motion(
    t: float, k: float = 1e6, gap: float = 0.01, speed: float = 1.0
) -> tuple[float, float]:
    """Place (m) and speed (m/s): half a period of an oscillator between two flights."""
    w, hit = np.sqrt(k), gap / speed
    if t < hit:
        return speed * t - gap, speed
    if t < hit + np.pi / w:
        return speed / w * np.sin(w * (t - hit)), speed * np.cos(w * (t - hit))
    return -speed * (t - hit - np.pi / w), -speed


# --- a beam ---------------------------------------------------------------------------------------


def beam_pendulum(bending_stiffness: float) -> Scene:
    """A beam on a pin from horizontal rest, 1 m and 1 kg/m, three shapes on its chord; EI in
    N m2."""
    beam = {
        "name": "beam", "length": 1.0, "mass_per_length": 1.0, "modes": {"y": 3},
        "bending_stiffness": bending_stiffness, "frame": "chord", "basis": "simply-supported",
        "stiffening": True,
    }  # fmt: skip
    pin = {"name": "pin", "type": "pin", "inboard": "ground", "outboard": "beam"}
    return {"gravity": DOWN, "beam": [beam], "hinge": [pin]}


# --- where they are at the end --------------------------------------------------------------------


@dataclass(frozen=True)
class Known:
    """A scene, and where (m) an end of it is after t_end s: by dop853 and dopri5 at 1e-13 and
    1e-12, rounded to where both agree."""

    scene: Scene
    t_end: float
    end: str
    place: tuple[float, float, float]


KNOWN = {
    "driven root, 1e4": Known(
        driven_root(1e4), 1.0, "rod2.tip", (-0.28148192839, -0.88596148584, 0.0)),
    "driven root, 1e7": Known(
        driven_root(1e7), 1.0, "rod2.tip", (-0.29500107363, -0.86818800356, 0.0)),
    "double pendulum": Known(
        double_pendulum(), 1.0, "rod1.tip", (-1.66211513582, -1.04146663719, 0.0)),
    "double pendulum, 1e4": Known(
        double_pendulum(1e4), 1.0, "rod1.tip", (-1.66325307740, -1.05551986861, 0.0)),
    "double pendulum, 1e6": Known(
        double_pendulum(1e6), 1.0, "rod1.tip", (-1.66211416984, -1.04160168203, 0.0)),
    "double pendulum, 1e8": Known(
        double_pendulum(1e8), 1.0, "rod1.tip", (-1.66211512692, -1.04146798386, 0.0)),
    "stretched by 1 mm, 1e6": Known(
        double_pendulum(1e6, 1e-3), 1.0, "rod1.tip", (-1.64562990576, -1.05358755747, 0.0)),
    "rods on balls": Known(
        spatial_rods(), 1.0, "rod1.tip", (-1.73440907129, -0.60301529973, -0.73141151744)),
    "upright, 1 rod": Known(
        upright_chain(1), 1.0, "rod0.tip", (-0.0231786354, 0.9997313393, 0.0)),
    "upright, 5 rods": Known(
        upright_chain(5), 0.5, "rod4.tip", (-0.00821284883, 4.99891802736, 0.0)),
    "upright, 20 rods": Known(
        upright_chain(20), 0.2, "rod19.tip", (-0.02019618247, 19.9999757979, 0.0)),
    "hanging, 5 rods": Known(
        hanging_chain(5), 1.0, "rod4.tip", (-0.01443772263, -4.99860249419, 0.0)),
    "hanging, 5 rods, 1 kN": Known(
        hanging_chain(5, 1e3), 1.0, "rod4.tip", (-0.24212820359, -4.98578368541, 0.0)),
    "hanging, 20 rods, 100 kN": Known(
        hanging_chain(20, 1e5), 1.0, "rod19.tip", (1.7655692124, -19.9141842017, 0.0)),
    "beam, 5": Known(
        beam_pendulum(5.0), 1.0, "beam.tip", (-0.99991394451, -0.00319132287, 0.0)),
    "beam, 500": Known(
        beam_pendulum(500.0), 1.0, "beam.tip", (-0.99996748648, -0.00805920017, 0.0)),
}  # fmt: skip
