"""Random scenes of kinds that were used neither to set nor to test the rule of target errors.

Switched satellites, rolling, gears, closed loops, bounces, dry friction, springs between bodies,
tops, curves, ropes, releases and tabulated torques.  Lengths in m, masses in kg, angles in rad.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from .scenes import _Z, Family, Sample, Scene, _ball_start, _beam, _log, _lump, _rod, _scene, _unit

_Y = [0.0, 1.0, 0.0]


def _number(rng: np.random.Generator, low: float, high: float) -> float:
    return float(rng.uniform(low, high))


def _pin(name: str, inboard: str, outboard: str, axis: list[float] = _Z, **more: Any) -> Scene:
    return {
        "name": name, "type": "pin", "axis": axis, "inboard": inboard, "outboard": outboard, **more,
    }  # fmt: skip


def _free_hinge(name: str, body: str, q: list[float], u: list[float]) -> Scene:
    return {
        "name": name, "type": "free", "inboard": "ground", "outboard": body,
        "initial": {"q": q, "u": u},
    }  # fmt: skip


def switched_satellites(rng: np.random.Generator) -> Sample:
    """A hub with two flexible wings, turned by a torque that switches twice."""
    a, switch_time = _number(rng, 0.3, 1.0), _number(rng, 1.0, 3.0)
    ends = {"p": [a, 0.0, 0.0], "n": {"position": [-a, 0.0, 0.0], "orientation": [0, 0, math.pi]}}
    hub = {"name": "hub", "mass": 100.0, "inertia": [30.0, 30.0, 30.0], "ends": ends}
    shapes = {"y": 0, "z": int(rng.integers(2, 5)), "twist": 0, "axial": 0}
    length, ei = _number(rng, 2, 5), _log(rng, 1.5, 2.5)
    wings = [_beam(n, length, 0.6, ei, modes=shapes, frame="tangent", basis="clamped-free")
             for n in ("east", "west")]  # fmt: skip
    hinges = [
        _free_hinge("f", "hub", [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0], [0.0] * 6),
        *({"name": f"h{n}", "type": "fixed", "inboard": f"hub.{e}", "outboard": n}
          for n, e in (("east", "p"), ("west", "n"))),
    ]  # fmt: skip
    steps = f"where(t<{switch_time:.6g},1,where(t<{2 * switch_time:.6g},-1,0))"
    torque = f"{_number(rng, 0.5, 5):.6g}*{steps}"
    load = {"on": "hub", "moment": [0.0, torque, 0.0]}
    return _scene([hub], hinges, [0.0] * 3, beam=wings, load=[load]), 3.0 * switch_time


def _rolling(body: str, radius: float) -> Scene:
    return {
        "name": f"road_{body}", "type": "rolling", "from": "ground", "to": body,
        "normal": _Z, "radius": radius, "axis": _Y,
    }  # fmt: skip


def rolling_coins(rng: np.random.Generator) -> Sample:
    """A coin that rolls, leans and turns."""
    r, m, lean = _number(rng, 0.05, 0.4), _log(rng, -1, 0.5), _number(rng, 0.05, 0.6)
    spin, turn = _number(rng, 3, 12), _number(rng, -2, 2)
    coin = {"name": "coin", "mass": m, "inertia": [m * r * r / 4, m * r * r / 2, m * r * r / 4]}
    q = [0.0, 0.0, r * math.cos(lean), math.cos(lean / 2), math.sin(lean / 2), 0.0, 0.0]
    start = _free_hinge("motion", "coin", q, [spin * r, 0.0, 0.0, 0.0, spin, turn * math.cos(lean)])
    return _scene([coin], [start], [0.0, 0.0, -9.81], constraint=[_rolling("coin", r)]), 3.0


def wheel_axles(rng: np.random.Generator) -> Sample:
    """Two wheels on an axle that carries a pendulum, pushed round by a torque on one wheel."""
    r, b = _number(rng, 0.1, 0.4), _number(rng, 0.2, 0.6)
    ends = {"l": [0.0, b, 0.0], "r": [0.0, -b, 0.0], "hook": [_number(rng, -0.2, 0.2), 0.0, 0.0]}
    axle = {"name": "axle", "mass": 5.0, "inertia": [0.3, 0.05, 0.3], "ends": ends}
    wheels = [
        {"name": n, "mass": 1.0, "inertia": [r * r / 4, r * r / 2, r * r / 4]}
        for n in ("left", "right")
    ]
    v, w = _number(rng, 0.5, 2.0), _number(rng, -1.5, 1.5)
    hinges = [
        _free_hinge("motion", "axle", [0.0, 0.0, r, 1.0, 0.0, 0.0, 0.0],
                    [v, 0.0, 0.0, 0.0, 0.0, w]),
        _pin("pl", "axle.l", "left", _Y, initial={"u": [(v - b * w) / r]},
             law={"effort": _number(rng, -0.5, 0.5)}),
        _pin("pr", "axle.r", "right", _Y, initial={"u": [(v + b * w) / r]}),
        _pin("hang", "axle.hook", "bob", _Y, initial={"q": [_number(rng, 0.6, 2.4)]}),
    ]  # fmt: skip
    constraints = [_rolling("left", r), _rolling("right", r)]
    bodies = [axle, *wheels, _rod("bob", _number(rng, 0.2, 0.6), _log(rng, -0.5, 0.5))]
    return _scene(bodies, hinges, [0.0, 0.0, -9.81], constraint=constraints), 3.0


def geared_rotors(rng: np.random.Generator) -> Sample:
    """Rotors in a row, geared in pairs and joined by shafts, one with an unbalance."""
    count = int(rng.integers(3, 6))
    bodies = [_rod("r0", _number(rng, 0.2, 0.6), _log(rng, -1, 0.5))]
    bodies += [{"name": f"r{i}", "mass": 1.0, "inertia": [_log(rng, -2, 0)] * 3}
               for i in range(1, count)]  # fmt: skip
    hinges = [_pin(f"p{i}", "ground", f"r{i}", initial={"u": [0.0]}) for i in range(count)]
    hinges[-1]["law"] = {"effort": f"{_number(rng, 0.5, 5):.6g}*sin({_number(rng, 1, 6):.6g}*t)"}
    hinges[1]["law"] = {"stiffness": _log(rng, 0, 2), "damping": _log(rng, -3, -1)}
    ratios = [_number(rng, 0.3, 3.0) for _ in range(count - 1)]
    couplings = [{"name": f"g{i}", "expression": f"p{i}.q + {x:.6g}*p{i + 1}.q"}
                 for i, x in enumerate(ratios)]  # fmt: skip
    return _scene(bodies, hinges, [0.0, -9.81, 0.0], coupling=couplings), _number(rng, 2, 5)


def four_bars(rng: np.random.Generator) -> Sample:
    """A crank that turns a rocker by a coupler, under weight or a torque."""
    a, b, c = _number(rng, 0.1, 0.3), _number(rng, 0.7, 1.0), _number(rng, 0.6, 0.9)
    ground = _number(rng, abs(b - c) + a + 0.1, b + c - a - 0.1)
    crank, rocker_offset = _number(rng, -2, 2), [ground - a, 0.0]
    x, y = rocker_offset[0] + a - a * math.cos(crank), -a * math.sin(crank)
    distance = math.hypot(x, y)
    coupler_angle = math.atan2(y, x) + math.acos((distance**2 + b**2 - c**2) / (2 * distance * b))
    px, py = (
        a * math.cos(crank) + b * math.cos(coupler_angle),
        a * math.sin(crank) + b * math.sin(coupler_angle),
    )
    bodies = [_rod(n, s, _log(rng, -0.7, 0.5))
              for n, s in (("crank", a), ("coupler", b), ("rocker", c))]  # fmt: skip
    hinges = [
        _pin("p0", "ground", "crank", law={"effort": _number(rng, -0.5, 0.5)},
             initial={"q": [crank], "u": [_number(rng, 3, 12)]}),
        _pin("p1", "crank.tip", "coupler", initial={"q": [coupler_angle - crank]}),
        _pin("p2", "ground", "rocker", position=[ground, 0.0, 0.0],
             initial={"q": [math.atan2(py, px - ground)]}),
        _pin("p3", "coupler.tip", "rocker.tip"),
    ]  # fmt: skip
    return _scene(bodies, hinges, [0.0, -9.81, 0.0]), _number(rng, 1, 3)


def bouncing_arms(rng: np.random.Generator) -> Sample:
    """An arm that hits a floor a few times, thrown back, a link on its tip."""
    bodies = [_rod("arm", 1.0, _log(rng, -0.5, 0.5)), _rod("link", 0.5, _log(rng, -0.5, 0.3))]
    hinges = [
        _pin("p0", "ground", "arm", initial={"q": [_number(rng, 0.2, 1.0)]}),
        _pin("p1", "arm.tip", "link", initial={"q": [_number(rng, -1.0, 1.0)]},
             law={"damping": _log(rng, -3, -1)}),
    ]  # fmt: skip
    event = {"when": "arm.tip.y <= -0.3", "do": "bounce", "restitution": _number(rng, 0.7, 1.0)}
    return _scene(bodies, hinges, [0.0, -9.81, 0.0], event=[event]), _number(rng, 0.8, 1.6)


def spring_bodies(rng: np.random.Generator) -> Sample:
    """Free bodies, joined by springs between their ends."""
    count = int(rng.integers(2, 5))
    bodies = [_lump(rng, f"b{i}") for i in range(count)]
    hinges = [
        _free_hinge(f"f{i}", f"b{i}",
              [2.0 * i, _number(rng, -0.3, 0.3), 0.0, *_ball_start(rng, 1.0)["q"]],
              rng.uniform(-1, 1, 6).tolist())
        for i in range(count)
    ]  # fmt: skip
    springs = [
        {"name": f"s{i}", "from": f"b{i}.a", "to": f"b{i + 1}.b",
         "law": {"stiffness": _log(rng, 1, 3), "rest": 1.0, "damping": _log(rng, -2, 0)}}
        for i in range(count - 1)
    ]  # fmt: skip
    return _scene(bodies, hinges, [0.0, 0.0, 0.0], spring=springs), _number(rng, 1, 3)


def stick_slip_blocks(rng: np.random.Generator) -> Sample:
    """A block on a belt that moves, held back by a spring: it sticks and slips."""
    family = _number(rng, 2, 6)
    friction = {"coulomb": family, "static": 1.4 * family, "stribeck_velocity": 0.1,
                "regularisation_velocity": _log(rng, -2, -1)}  # fmt: skip
    bodies = [{"name": n, "mass": m, "inertia": [0.1] * 3} for n, m in (("belt", 1.0), ("b", 1.0))]
    along = {"type": "prismatic", "axis": [1.0, 0.0, 0.0]}
    hinges = [
        {"name": "move", "inboard": "ground", "outboard": "belt", **along,
         "drive": f"{_number(rng, 0.1, 0.4):.6g}*t"},
        {"name": "rub", "inboard": "belt", "outboard": "b", **along, "law": {"friction": friction}},
    ]  # fmt: skip
    spring = {"from": "ground", "to": "b", "position": [-2.0, 0.0, 0.0],
              "law": {"stiffness": _log(rng, 1, 2), "rest": 2.0}}  # fmt: skip
    return _scene(bodies, hinges, [0.0, -9.81, 0.0], spring=[spring]), _number(rng, 3, 8)


def spinning_tops(rng: np.random.Generator) -> Sample:
    """A fast top on a ball, with a pendulum at its head."""
    top = {"name": "top", "mass": 1.0, "inertia": [0.02, 0.02, 0.01],
           "center_of_mass": [0.0, 0.0, 0.3], "ends": {"head": [0.0, 0.0, 0.5]}}  # fmt: skip
    lean, spin = _number(rng, 0.2, 1.0), _number(rng, 50, 200)
    hinges = [
        {"name": "foot", "type": "ball", "inboard": "ground", "outboard": "top",
         "initial": {"q": [math.cos(lean / 2), math.sin(lean / 2), 0.0, 0.0],
                     "u": [0.0, 0.0, spin]}},
        {"name": "neck", "type": "ball", "inboard": "top.head", "outboard": "bob",
         "initial": _ball_start(rng, 1.0), "law": {"damping": [1e-3] * 3}},
    ]  # fmt: skip
    return _scene([top, _rod("bob", 0.2, 0.05)], hinges, [0.0, 0.0, -9.81]), _number(rng, 0.5, 1.5)


def beads(rng: np.random.Generator) -> Sample:
    """A body that slides along a curve, a pendulum on it."""
    curve = [f"{_number(rng, 0.5, 1.5):.6g}*cos(s)", f"{_number(rng, 0.5, 1.5):.6g}*sin(s)",
             f"{_number(rng, 0.05, 0.3):.6g}*s + 0.1*sin(3*s)"]  # fmt: skip
    s = _number(rng, 0, 6)
    coupler_angle = [float(eval(c, {"cos": math.cos, "sin": math.sin, "s": s})) for c in curve]
    bead = {"name": "bead", "mass": _log(rng, -0.5, 0.5), "inertia": [0.01] * 3}
    hinges = [
        {"name": "slide", "type": "free", "inboard": "ground", "outboard": "bead",
         "initial": {"q": [*coupler_angle, 1.0, 0.0, 0.0, 0.0], "u": [0.0] * 6}},
        {"name": "hang", "type": "ball", "inboard": "bead", "outboard": "bob",
         "initial": _ball_start(rng, 1.0)},
    ]  # fmt: skip
    wire = {"name": "wire", "type": "point-on-curve", "from": "ground", "to": "bead",
            "curve": curve, "start": s}  # fmt: skip
    bodies = [bead, _rod("bob", _number(rng, 0.2, 0.6), _log(rng, -1, 0))]
    return _scene(bodies, hinges, [0.0, 0.0, -9.81], constraint=[wire]), _number(rng, 1, 2)


def ropes(rng: np.random.Generator) -> Sample:
    """A rope of equal rods with a weight, pulled aside by a load that comes and goes."""
    damping = _log(rng, -3, -1)
    link = {"mass": 0.05, "center_of_mass": [0.1, 0.0, 0.0], "inertia": [1e-5, 2e-4, 2e-4],
            "ends": {"tip": [0.2, 0.0, 0.0]}}  # fmt: skip
    joint = {"type": "universal", "axis": _Y, "axis2": _Z, "law": {"damping": [damping] * 2}}
    rope = {"name": "rope", "count": int(rng.integers(3, 7)), "inboard": "ground",
            "orientation": [0.0, math.pi / 2, 0.0], "body": link, "hinge": joint}  # fmt: skip
    weight = {"name": "weight", "mass": _log(rng, -0.7, 0.3), "inertia": [1e-3] * 3}
    hook = {"name": "hook", "type": "fixed", "inboard": "rope[last].tip", "outboard": "weight"}
    t0, family = _number(rng, 0.1, 0.5), _number(rng, 1, 5)
    load = {
        "on": "weight",
        "force": [f"where(t<{t0:.6g}, {family:.6g}, 0)", f"{family / 3:.6g}", 0.0],
    }
    scene = _scene([weight], [hook], [0.0, 0.0, -9.81], chain=[rope], load=[load])
    return scene, _number(rng, 0.8, 2)


def released_arms(rng: np.random.Generator) -> Sample:
    """An arm that a drive moves until it is let go, and a torque that is tabulated."""
    bodies = [_rod(f"a{i}", _number(rng, 0.4, 1.0), _log(rng, -0.5, 0.5)) for i in range(3)]
    hinges = [
        _pin("p0", "ground", "a0", drive=f"{_number(rng, 0.2, 0.6):.6g}*sin(3*t)"),
        _pin("p1", "a0.tip", "a1", law={"effort": "push"}),
        _pin("p2", "a1.tip", "a2", _unit(rng), initial={"q": [_number(rng, -1, 1)]}),
    ]
    t0 = _number(rng, 0.3, 0.9)
    event = {"when": f"t >= {t0:.6g}", "do": "release", "hinge": "p0"}
    times = np.linspace(0.0, 2.0, 9)
    signal = {"name": "push", "times": times.tolist(), "values": rng.uniform(-3, 3, 9).tolist()}
    return _scene(bodies, hinges, [0.0, -9.81, 0.0], event=[event], signal=[signal]), 2.0


UNSEEN_FAMILIES: dict[str, Family] = {
    family.__name__: family
    for family in (
        switched_satellites, rolling_coins, wheel_axles, geared_rotors, four_bars, bouncing_arms,
        spring_bodies, stick_slip_blocks, spinning_tops, beads, ropes, released_arms,
    )
}  # fmt: skip
