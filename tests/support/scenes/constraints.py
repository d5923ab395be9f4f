"""Scenes that constraints close: a disc that rolls, with Kane's equations, a bead, a governor."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import sympy as sp
import sympy.physics.mechanics as me

import mstmm
from tests.reference.algebra import orientation, to_quaternion
from tests.support.models import compile_scene

Scene = dict[str, Any]
GRAVITY = 9.81


RADIUS, MASS = 0.3, 2.0


def on_a_road() -> Scene:
    """A thin disc with its axis along y on the ground, 0.3 rad off upright, rolling fast."""
    lean = orientation([0.3, 0.0, 0.0])
    free = {"name": "at", "type": "free", "inboard": "ground", "outboard": "disc",
            "initial": {"q": [0, 0, RADIUS * math.cos(0.3), *map(float, to_quaternion(lean))],
                        "u": [2.4, 0, 0, 0, 8, 0]}}  # fmt: skip
    moment = MASS * RADIUS**2 / 4
    return {
        "gravity": [0, 0, -GRAVITY], "hinge": [free],
        "body": [{"name": "disc", "mass": MASS, "inertia": [moment, 2 * moment, moment]}],
        "constraint": [{"name": "road", "type": "rolling", "from": "ground", "to": "disc",
                        "normal": [0, 0, 1], "radius": RADIUS, "axis": [0, 1, 0]}],
    }  # fmt: skip


@cache
def disc() -> mstmm.Model:
    """The same, compiled."""
    return compile_scene(on_a_road())


@cache
def kane() -> Any:
    """(lean, u) -> rates of the components of the angular velocity in axes that lean with the disc
    but do not spin, by SymPy's KanesMethod: x forward, y along the axis of the disc."""
    q, u = me.dynamicsymbols("q:3"), me.dynamicsymbols("u:3")
    inertial = me.ReferenceFrame("N")
    yaw = inertial.orientnew("Y", "Axis", [q[0], inertial.z])
    lean = yaw.orientnew("L", "Axis", [q[1], yaw.x])
    body = lean.orientnew("R", "Axis", [q[2], lean.y])
    turning = body.ang_vel_in(inertial)
    spin = u[0] * lean.x + u[1] * lean.y + u[2] * lean.z
    body.set_ang_vel(inertial, spin)
    contact = me.Point("C")
    contact.set_vel(inertial, 0)
    center = contact.locatenew("D", RADIUS * lean.z)
    center.v2pt_theory(contact, inertial, body)
    moment = MASS * RADIUS**2 / 4
    inertia = me.inertia(lean, moment, 2 * moment, moment)
    method = me.KanesMethod(inertial, q, u, kd_eqs=[me.dot(turning - spin, axis) for axis in lean])
    rigid = me.RigidBody("disc", center, body, MASS, (inertia, center))
    method.kanes_equations([rigid], [(center, -MASS * GRAVITY * inertial.z)])
    plain = sp.symbols("x:4")
    known = dict(zip([q[1], *u], plain, strict=True))
    matrices = [m.xreplace(known) for m in (method.mass_matrix, method.forcing)]
    return sp.lambdify(plain, matrices, "numpy")


def on_a_plane() -> Scene:
    """A body on a ball hinge whose tip stays in an oblique plane."""
    return {
        "gravity": [0, 0, -GRAVITY],
        "body": [{"name": "rod", "mass": 1.0, "inertia": [0.1, 0.2, 0.3],
                  "center_of_mass": [0.2, 0, 0.1], "ends": {"tip": [0.5, 0, 0]}}],
        "hinge": [{"name": "joint", "type": "ball", "inboard": "ground", "outboard": "rod"}],
        "constraint": [{"name": "glass", "type": "point-on-plane", "from": "ground",
                        "to": "rod.tip", "normal": [0.3, 0.1, 1], "offset": 0.1}],
    }  # fmt: skip


def bead(curve: tuple[str, str], start: float, place: tuple[float, float]) -> Scene:
    """A bead on a wire in the plane of x and z, about which it turns freely."""
    free = {"name": "at", "type": "free", "inboard": "ground", "outboard": "bead",
            "initial": {"q": [place[0], 0, place[1], 1, 0, 0, 0]}}  # fmt: skip
    return {
        "gravity": [0, 0, -GRAVITY], "hinge": [free],
        "body": [{"name": "bead", "mass": 0.3, "inertia": [0.1, 0.1, 0.1]}],
        "constraint": [{"name": "wire", "type": "point-on-curve", "from": "ground", "to": "bead",
                        "curve": [curve[0], 0, curve[1]], "start": start}],
    }  # fmt: skip


def governor(rods: str) -> Scene:
    """Two balls on arms at a shaft that is driven, and a sleeve that two rods hang on them."""
    arm = {"mass": 1.0, "inertia": [0.002, 0.02, 0.02], "center_of_mass": [0.3, 0, 0],
           "ends": {"ball": [0.3, 0, 0]}}  # fmt: skip
    arms = [arm | {"name": f"arm{k}"} for k in range(2)]
    hinges = [
        {"name": "turn", "type": "pin", "inboard": "ground", "outboard": "shaft", "drive": "10*t"},
        {"name": "slide", "type": "prismatic", "inboard": "shaft", "outboard": "sleeve",
         "initial": {"q": -0.3 * math.sqrt(2)}},
        *({"name": f"hip{k}", "type": "pin", "inboard": "shaft", "outboard": f"arm{k}",
           "orientation": [0, 0, math.pi * k], "axis": [0, 1, 0],
           "initial": {"q": math.pi / 4}} for k in range(2)),
    ]  # fmt: skip
    scene: Scene = {
        "gravity": [0, 0, -GRAVITY], "hinge": hinges,
        "body": [{"name": "shaft", "mass": 1.0, "inertia": [0.1, 0.1, 0.1]},
                 {"name": "sleeve", "mass": 2.0, "inertia": [0.1, 0.1, 0.1]}, *arms],
    }  # fmt: skip
    for k in range(2):
        rod = {"from": f"arm{k}.ball", "to": "sleeve"}
        if rods == "constraint":
            scene.setdefault("constraint", []).append(rod | {"type": "distance", "length": 0.3})
        else:
            law = {"stiffness": 8e5, "rest": 0.3}
            scene.setdefault("spring", []).append(rod | {"law": law})
    return scene


def cycloid(start: float, a: float = 0.5) -> Scene:
    """A bead on a cycloid that opens upwards."""
    place = a * (start + math.sin(start)), -a * math.cos(start)
    return bead((f"{a}*(s + sin(s))", f"-{a}*cos(s)"), start, place)
