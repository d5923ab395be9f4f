"""Inverse dynamics: efforts for given accelerations, backward pass."""

from __future__ import annotations

from .flexible import MODAL_EFFORT
from .forward_kinematics import HINGE_MOTION
from .pass_steps import TIPS_TO_ROOT, Copy, EachSpeed, Pass, RunPass, call, only

#: Efforts of a load along the speeds of a hinge, and the load on the parent.
EFFORT_AND_TRANSPORT = (
    call("generic{nu}.effort", H="hinge.H", f="body.e", tau="local.tau"),
    EachSpeed(
        steps=(
            call("frames.driven_effort", load="local.tau[k]", J="body.rotor[k]",
                 udot="body.given[k]", tau="body.tau[k]", tau_d="body.required[k]"),
        ),
    ),
    call("frames.transport", Rc="body.R", r="body.r", e="body.e", e_I="parent.e"),
)  # fmt: skip

REQUIRED_EFFORTS = Pass(
    "required_efforts", "body", "Efforts required beyond those of laws, and load on the parent.",
    (
        *only("section", *MODAL_EFFORT),
        Copy(to="modes.required", source="modes.e_f", when="modal"),
        RunPass(whole=HINGE_MOTION, when="own"),
        *EFFORT_AND_TRANSPORT,
    ),
    order=TIPS_TO_ROOT, skip="idle",
)  # fmt: skip
