"""Forward pass: hinge motion, bias motion, own inertia and load; poses if needed."""

from __future__ import annotations

from .flexible import MODAL_OWN, SECTION_MOTION
from .pass_steps import Add, ChooseBias, Copy, Pass, RunPass, call

CONNECTION = {"Rt": "connection.R", "ro": "connection.r"}
HINGE = {name: f"hinge.{name}" for name in ("R", "d", "H", "v", "w", "c")}
BODY = {"Rc": "body.R", "r": "body.r", "motion": "body.motion"}
#: Outputs of the kernel of a hinge without speeds: identity and zeros.
STILL = {
    "R": "identity", "d": "zero", "H": "none", "v": "zero", "w": "zero", "c": "zero", "s": "none",
}  # fmt: skip
COORDINATES = {"p": "hinge.p", "q": "body.q", "u": "body.u"}

PRESCRIBED_ACCELERATIONS = Pass(
    "prescribed_accelerations", "body", "Given accelerations: all, or zero.",
    (
        Copy(to="body.s", source="body.given", when="inverse"),
        Copy(to="body.s", when="!inverse"),
    ),
    spares_links="linked",
)  # fmt: skip

DRIVES = Pass(
    "drives", "drive", "Prescribed coordinates, speeds and accelerations set.",
    (
        Copy(to="drive.q", source="drive.value"),
        Copy(to="drive.u", source="drive.rate"),
        Copy(to="drive.s", source="drive.acceleration", when="driving"),
    ),
    skip="!imposed",
)  # fmt: skip

HINGE_MOTION = Pass(
    "hinge_motion", "body", "Relative motion across the hinge.",
    (
        call("hinge.hinge", fails="hinge", **COORDINATES, **HINGE, qdot="body.qdot"),
        # The constant part of the hinge's own screw, where the connection is an axial link.
        Add(to="hinge.d", source="link.lift", when="link"),
        call("hinge.hinge", when="rotated", p="hinge.p", q="link.q", u="body.u", R="hinge.R"),
    ),
)  # fmt: skip

FORWARD = Pass(
    "forward", "body", "Hinge motion, bias motion, own inertia and own load of a body.",
    (
        RunPass(whole=SECTION_MOTION, when="section"),
        Copy(to="section.S_rf", when="segment"),
        RunPass(whole=HINGE_MOTION, when="parts !section !whole"),
        call("hinge.forward", when="own", fails="hinge", **CONNECTION, **COORDINATES, s="body.s",
             motion_I="parent.motion", **BODY, qdot="body.qdot"),
        call("hinge.body_motion", when="whole", fails="hinge", **CONNECTION, **COORDINATES,
             **HINGE, s="body.s", motion_I="parent.motion", **BODY, qdot="body.qdot"),
        call("generic{nu}.forward", when="parts !staged !whole", fails="hinge", **CONNECTION,
             **HINGE, s="body.s", motion_I="parent.motion", **BODY),
        call("generic0.forward", when="staged", **CONNECTION, **STILL, motion_I="parent.motion",
             motion="connection.motion"),
        call("generic{nu}.forward", when="staged", Rt="identity", ro="zero", **HINGE, s="body.s",
             motion_I="connection.motion", motion="body.motion"),
        # In a refinement the bias motion is that of the solution.
        ChooseBias(subspace="hinge.H", motion="body.motion", offset="body.bias_offset",
                   when="staged !refined"),
        RunPass(whole=MODAL_OWN, when="modal"),
        call("body.inertia", when="!modal !weightless", p="body.p", S="body.S"),
        call("body.bias_load", when="!modal", p="body.p", motion="body.motion", e="body.e"),
        Copy(to="body.own", source="body.S", when="staged"),
        call("frames.pivot_floor", when="!staged !weightless", S="body.S", floor="body.floor"),
    ),
    skip="idle", given=("parent.motion",),
)  # fmt: skip

POSES = Pass(
    "poses", "body", "Axes, position and velocity of P of a body, inertial axes.",
    (
        RunPass(whole=HINGE_MOTION, when="own !known"),
        call("frames.pose", when="!staged", A_I="parent.A", x_I="parent.x", Rc="body.R",
             r="body.r", A="body.A", x="body.x"),
        call("frames.velocity", when="!staged", Rc="body.R", r="body.r", v_I="parent.v",
             w_I="parent.w", v_rel="hinge.v", v="body.v"),
        call("frames.pose", when="staged", A_I="parent.A", x_I="parent.x", Rc="connection.R",
             r="connection.r", A="local.A", x="local.x"),
        call("frames.velocity", when="staged", Rc="connection.R", r="connection.r",
             v_I="parent.v", w_I="parent.w", v_rel="zero", v="local.v"),
        call("frames.pose", when="staged", A_I="local.A", x_I="local.x", Rc="hinge.R",
             r="hinge.d", A="body.A", x="body.x"),
        call("frames.velocity", when="staged", Rc="hinge.R", r="hinge.d", v_I="local.v",
             w_I="connection.w", v_rel="hinge.v", v="body.v"),
    ),
    skip="idle",
)  # fmt: skip
