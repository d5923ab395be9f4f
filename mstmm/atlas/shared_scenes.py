"""Scenes that several cases use."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..array_validation import Array
from ..pipeline.compilation import compile_scene
from ..runtime.model.model import Model
from ..scene import Scene

#: Moments of inertia of a uniform rod of 1 m and 1 kg, along it and across, kg*m2.
ROD_AXIAL_INERTIA, ROD_TRANSVERSE_INERTIA = 0.001, 1 / 12

#: Energy exchanged by two rods that fall from the horizontal, J: 1 kg by 0.5 m, 1 kg by 1.5 m.
FALL_ENERGY = 9.81 * 2.0

#: Angle at which a sprung rod is released, rad.
RELEASE_ANGLE = 1e-3


def compile_looped(scene: dict[str, Any], **options: Any) -> Model:
    """Compile a scene for the looped engine and the Riccati sweep, without automatic choices."""
    options.setdefault("sweep", "riccati")
    return compile_scene(Scene(**scene), engine="looped", **options)


def rod(name: str, mass: float = 1.0, inertia: Sequence[float] | None = None) -> dict[str, Any]:
    """Uniform rod of 1 m along x from its input end to its end `tip`, as a table of a scene."""
    moments = inertia or (ROD_AXIAL_INERTIA, ROD_TRANSVERSE_INERTIA, ROD_TRANSVERSE_INERTIA)
    return {
        "name": name, "mass": mass, "center_of_mass": [0.5, 0, 0],
        "inertia": [mass * value for value in moments], "ends": {"tip": [1, 0, 0]},
    }  # fmt: skip


def chain(count: int, kind: str = "pin", skew: float = 0.0, **of_rods: Any) -> dict[str, Any]:
    """Chain of equal rods on hinges of one kind; gravity along -y.

    Neighbouring hinges are rotated by `skew` rad about the axis of the rod between them.
    """
    return {
        "gravity": [0, -9.81, 0],
        "chain": [{
            "name": "c", "count": count, "inboard": "ground",
            "body": {key: value for key, value in rod("", **of_rods).items() if key != "name"}
            | {"ends": {"tip": {"position": [1, 0, 0], "orientation": [skew, 0, 0]}}},
            "hinge": {"type": kind},
        }],
    }  # fmt: skip


def row_hinges(names: Sequence[str], kind: str) -> list[dict[str, Any]]:
    """Hinges of one kind from the ground along bodies, each at the tip of the one before."""
    inboard = ["ground", *(f"{name}.tip" for name in names)]
    return [
        {"name": f"hinge{i}", "type": kind, "inboard": inboard[i], "outboard": name}
        for i, name in enumerate(names)
    ]


def rod_chain(masses: Sequence[float]) -> dict[str, Any]:
    """Chain of rods of 1 m with these masses on parallel pins; gravity along -y."""
    bodies = [rod(f"rod{i}", mass=mass) for i, mass in enumerate(masses)]
    hinges = row_hinges([body["name"] for body in bodies], "pin")
    return {"gravity": [0, -9.81, 0], "body": bodies, "hinge": hinges}


def pinned_rod(weight: float = 0.0, **of_pin: Any) -> Model:
    """Rod on a pin with these keys; gravity `weight` along x."""
    pin = {"name": "pin", "type": "pin", "inboard": "ground", "outboard": "rod"} | of_pin
    return compile_looped({"gravity": [weight, 0, 0], "body": [rod("rod")], "hinge": [pin]})


def sliding_mass(axis: Sequence[float] = (1, 0, 0), **law: Any) -> Model:
    """Body of 1 kg on a slide with this law, without weight."""
    slide = {
        "name": "slide", "type": "prismatic", "axis": list(axis), "inboard": "ground",
        "outboard": "mass", "law": law,
    }  # fmt: skip
    mass = {"name": "mass", "mass": 1.0}
    return compile_looped({"gravity": [0, 0, 0], "body": [mass], "hinge": [slide]})


def uniform_beam(stiffness: float, shapes: int, name: str = "beam", **keys: Any) -> dict[str, Any]:
    """Beam of 1 m and 1 kg with this bending stiffness (N m2) and number of shapes along y."""
    return {
        "name": name, "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": stiffness,
        "modes": {"y": shapes},
    } | keys  # fmt: skip


def beam_on_ground(
    beam: dict[str, Any], hinge: dict[str, Any], weight: float = 0.0, **scene: Any
) -> Model:
    """Beam on the ground by a hinge of these keys; gravity `weight` along -y."""
    foot = {"name": "foot", "inboard": "ground", "outboard": beam["name"]} | hinge
    return compile_looped({"gravity": [0, -weight, 0], "beam": [beam], "hinge": [foot], **scene})


def random_pin_states(count: int) -> list[tuple[Array, Array]]:
    """Three random states of pins, angles and rates within +-1, the same in every run."""
    rng = np.random.default_rng(1)
    return [(rng.uniform(-1, 1, count), rng.uniform(-1, 1, count)) for _ in range(3)]


def rod_with_spring(stiffness: float, damping: float = 0.0) -> Model:
    """Rod on a pin with spring and damper (N*m/rad, N*m*s/rad), from 1e-3 rad; no weight."""
    law = {"stiffness": stiffness, "damping": damping}
    return pinned_rod(law=law, initial={"q": [RELEASE_ANGLE]})


def hanging_rod(rate: float) -> Model:
    """Rod that hangs from a pin, released at 1e-3 rad, with the angular frequency `rate` (1/s).

    Its weight is chosen accordingly.
    """
    initial = {"q": [RELEASE_ANGLE]}
    unit = pinned_rod(1.0, initial=initial).derivatives(np.zeros(1), np.zeros(1)).q
    return pinned_rod(rate**2 / -float(unit[0, 0]), initial=initial)


def stiffness_for_frequency(rate: float) -> float:
    """Stiffness, N*m/rad, with which a sprung rod has the angular frequency `rate` (1/s)."""
    return rate**2 * float(rod_with_spring(1.0).mass_matrix([0.0])[0, 0])


def double_pendulum(stiffness: float | None = None, stretch: float = 0.0) -> Model:
    """Two rods that fall from the horizontal, on pins or undamped bushings.

    The bushings have this stiffness (N/m) and rotate freely; the first starts with `stretch` (m).
    """
    names = ("upper", "lower")
    kind: dict[str, Any] = {"type": "pin"}
    if stiffness is not None:
        kind = {"type": "elastic", "law": {"stiffness": [stiffness] * 3 + [0.0] * 3}}
    first = {} if stiffness is None else {"initial": {"q": [stretch, 0, 0, 1, 0, 0, 0]}}
    hinges = [
        {"name": "shoulder", "inboard": "ground", "outboard": "upper", **kind, **first},
        {"name": "elbow", "inboard": "upper.tip", "outboard": "lower", **kind},
    ]
    bodies = [
        rod(name, inertia=(0.01, ROD_TRANSVERSE_INERTIA, ROD_TRANSVERSE_INERTIA)) for name in names
    ]
    return compile_looped({"gravity": [0, -9.81, 0], "body": bodies, "hinge": hinges})


def elbow_with_spring(stiffness: float, damping: float = 0.0) -> Model:
    """Two rods that fall from the horizontal, with a spring and a damper in their elbow.

    Units are N*m/rad and N*m*s/rad; the spring is unloaded at the start, with straight rods.
    """
    law = {"stiffness": stiffness, "damping": damping}
    hinges = [
        {"name": "shoulder", "type": "pin", "inboard": "ground", "outboard": "upper"},
        {"name": "elbow", "type": "pin", "inboard": "upper.tip", "outboard": "lower", "law": law},
    ]
    return compile_looped(
        {"gravity": [0, -9.81, 0], "body": [rod("upper"), rod("lower")], "hinge": hinges}
    )


def spinning_top(kind: str, spin: Sequence[float] = (0.0, 0.0, 0.0)) -> Model:
    """Body with three different moments of inertia, rotating about its mass centre.

    It has a hinge of this kind and no weight; `spin` is its angular velocity at the start (rad/s).
    """
    top = {"name": "top", "mass": 1.0, "center_of_mass": [0, 0, 0], "inertia": [0.3, 0.4, 0.5]}
    foot = {"name": "foot", "type": kind, "inboard": "ground", "outboard": "top"}
    initial = {} if not any(spin) else {"initial": {"u": list(spin)}}
    return compile_looped({"gravity": [0, 0, 0], "body": [top], "hinge": [foot | initial]})


def four_bar(
    speed: float = 0.0, askew: float = 0.0, closed: bool = True, ratio: float = 1.0,
    spread: float = 1.0, feet: float = 1.2,
) -> dict[str, Any]:  # fmt: skip
    """Four-bar linkage, or without `closed` its rods without the pin that closes the loop.

    It has a crank of 0.5 m that starts at `speed` (rad/s), a coupler of 1.1 m and a rocker of
    0.8 m, on feet `feet` m apart.  Rods have 1 kg/m, the coupler `ratio` times that.  The frames of
    their tips are misaligned by `askew`, rad; their moments of inertia are `spread` times those of
    uniform rods.
    """

    def link(name: str, length: float, density: float = 1.0) -> dict[str, Any]:
        mass, across = density * length, spread * density * length**3 / 12
        tip = {"position": [length, 0, 0], "orientation": [0.7 * askew, askew, 0]}
        return {
            "name": name, "mass": mass, "center_of_mass": [length / 2, 0, 0],
            "inertia": [1e-3 * spread * mass, across, across], "ends": {"tip": tip},
        }  # fmt: skip

    def pin(name: str, inboard: str, outboard: str, angle: float) -> dict[str, Any]:
        return {
            "name": name, "type": "pin", "inboard": inboard, "outboard": outboard,
            "initial": {"q": [angle]},
        }  # fmt: skip

    foot = pin("foot", "ground", "crank", 1.0) | {"initial": {"q": [1.0], "u": [speed]}}
    hinges = [
        foot | {"hold": closed}, pin("knee", "crank.tip", "coupler", -0.6),
        pin("heel", "ground", "rocker", 1.7) | {"position": [feet, 0, 0]},
    ]  # fmt: skip
    return {
        "gravity": [0, -9.81, 0],
        "body": [link("crank", 0.5), link("coupler", 1.1, ratio), link("rocker", 0.8)],
        "hinge": hinges + [pin("top", "coupler.tip", "rocker.tip", 0.0)] * closed,
    }  # fmt: skip


def parallelogram(angle: float, closed: bool = True) -> dict[str, Any]:
    """Parallelogram of two cranks and a coupler of 1 m, on feet 1 m apart.

    It starts `angle` rad from the pose with all rods in line, and a spring acts on the first crank.
    Without `closed` these rods have no pin that closes the loop.
    """
    spring = {"stiffness": 10.0, "rest": -1.0}
    pins: tuple[tuple[str, str, str, float, dict[str, Any]], ...] = (
        ("foot", "ground", "crank", angle, {"hold": closed, "law": spring}),
        ("knee", "crank.tip", "coupler", -angle, {}),
        ("heel", "ground", "rocker", angle, {"position": [1, 0, 0]}),
        ("top", "coupler.tip", "rocker.tip", 0.0, {"cut": True}),
    )
    return _three_rod_scene(pins[: 4 if closed else 3])


def _three_rod_scene(pins: Sequence[tuple[str, str, str, float, dict[str, Any]]]) -> dict[str, Any]:
    """Crank, coupler and rocker on pins, given as name, inboard, outboard, angle, other keys."""
    hinges = [
        {"name": name, "type": "pin", "inboard": inboard, "outboard": outboard,
         "initial": {"q": [q]}} | other_keys
        for name, inboard, outboard, q, other_keys in pins
    ]  # fmt: skip
    bodies = [rod(name) for name in ("crank", "coupler", "rocker")]
    return {"gravity": [0, -9.81, 0], "body": bodies, "hinge": hinges}


#: Outward inclination of the cranks of a hung linkage, rad: its feet are 2 m apart.
CRANK_INCLINATION = np.pi / 6


def hanging_linkage(stiffness: float) -> dict[str, Any]:
    """Linkage with a coupler that hangs level from two cranks, all of 1 m and 1 kg.

    A spring (N*m/rad) keeps the first crank in place.
    """
    down = -np.pi / 2
    pins: tuple[tuple[str, str, str, float, dict[str, Any]], ...] = (
        ("foot", "ground", "crank", down + CRANK_INCLINATION, {"law": {"stiffness": stiffness,
                                                          "rest": down + CRANK_INCLINATION}}),
        ("knee", "crank.tip", "coupler", -down - CRANK_INCLINATION, {}),
        ("heel", "ground", "rocker", down - CRANK_INCLINATION, {"position": [2, 0, 0]}),
        ("top", "coupler.tip", "rocker.tip", down - CRANK_INCLINATION, {"cut": True}),
    )  # fmt: skip
    return _three_rod_scene(pins)


def rod_arch(masses: Sequence[float]) -> dict[str, Any]:
    """Arch of rods of 1 m on pins between two points of the ground."""
    names, bend_angle = [f"rod{i}" for i in range(len(masses))], 0.4
    angles = [bend_angle * (len(masses) / 2 - i - 0.4) for i in range(len(masses))]
    hinges: list[dict[str, Any]] = [
        {"name": f"pin{i}", "type": "pin", "outboard": name, "cut": False,
         "inboard": f"{names[i - 1]}.tip" if i else "ground",
         "initial": {"q": [-bend_angle if i else angles[0]]}}
        for i, name in enumerate(names)
    ]  # fmt: skip
    far_end = np.sum(np.exp(1j * np.array(angles)))
    hinges.append({
        "name": "far", "type": "pin", "inboard": "ground", "outboard": f"{names[-1]}.tip",
        "position": [float(far_end.real), float(far_end.imag), 0.0], "cut": True,
        "initial": {"q": [angles[-1]]},
    })  # fmt: skip
    bodies = [rod(name, mass=mass) for name, mass in zip(names, masses, strict=True)]
    return {"gravity": [0, -9.81, 0], "body": bodies, "hinge": hinges}


def solid_bar(slenderness: float, divisions: Sequence[int], order: int, poisson: float) -> Model:
    """Clamped bar of square section, meshed with `divisions` hexahedra of degree `order`.

    Its length, Young's modulus and density are 1.
    """
    across = 1 / slenderness
    bar = {
        "name": "bar", "young": 1.0, "poisson": poisson, "density": 1.0, "order": order,
        "box": {"size": [1.0, across, across], "divisions": divisions},
        "modes": 1, "stiffening": False, "ends": {"root": {"plane": [1, 0, 0, 0]}},
    }  # fmt: skip
    wall = {"name": "wall", "type": "fixed", "inboard": "ground", "outboard": "bar.root"}
    return compile_looped({"gravity": [0, 0, 0], "elastic": [bar], "hinge": [wall]})
