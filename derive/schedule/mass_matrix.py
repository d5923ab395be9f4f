"""Mass matrix: composite inertia outboard of each hinge, and its load on other hinges.

With all hinges locked, S of the outboard bodies is carried to the parent unchanged.  Unit
acceleration of one speed of a hinge requires the load S H there, which only the hinges on the path
to the root resist.
"""

from __future__ import annotations

from .forward_kinematics import FORWARD, HINGE_MOTION, PRESCRIBED_ACCELERATIONS
from .inverse_dynamics import EFFORT_AND_TRANSPORT
from .pass_steps import TIPS_TO_ROOT, Copy, Pass, Run, RunPass, Sweep, call
from .riccati_sweep import BODY

COMPOSITE_INERTIA = Pass(
    "composite_inertia", "body", "Inertia of a body and its outboard part, carried to the parent.",
    (
        RunPass(whole=HINGE_MOTION, when="own"),
        Copy(to="body.tau"),
        call("generic0.condense", **BODY, H="none", J="none", floor="zero", S="body.S", e="body.e",
             tau="none", S_I="parent.S", e_I="parent.e"),
    ),
    order=TIPS_TO_ROOT, skip="idle",
)  # fmt: skip

OUTBOARD_LOAD = Pass(
    "outboard_load",
    "body",
    "Load of the outboard part at the given accelerations of the hinge.",
    (call("generic{nu}.required_load", S="body.S", H="hinge.H", udot="body.given", e="body.e"),),
)

HINGE_EFFORTS = Pass(
    "hinge_efforts",
    "body",
    "Efforts of a load along the speeds of one hinge, and the load on the parent.",
    EFFORT_AND_TRANSPORT,
)

COMPOSITION = Sweep(
    "composition",
    "Inertia of the outboard part of each hinge, all hinges at rest.",
    (Run(whole=PRESCRIBED_ACCELERATIONS), Run(whole=FORWARD), Run(whole=COMPOSITE_INERTIA)),
)
