"""Mass matrix: composite inertia outboard of each hinge, and its load on other hinges.

With all hinges locked, S of the outboard bodies is carried to the parent unchanged.  Unit
acceleration of one speed of a hinge requires the load S H there, which only the hinges on the path
to the root resist.
"""

from __future__ import annotations

from .forward_kinematics import FORWARD, HINGE_MOTION, PRESCRIBED
from .inverse_dynamics import EFFORT_AND_TRANSPORT
from .pass_steps import TIPS_TO_ROOT, Copy, Pass, Run, RunPass, Sweep, call
from .riccati_sweep import BODY

COMPOSED = Pass(
    "composed", "body", "Inertia of a body and of all that hangs on it, carried to the parent.",
    (
        RunPass(whole=HINGE_MOTION, when="own"),
        Copy(to="body.tau"),
        call("generic0.condense", **BODY, H="none", J="none", floor="zero", S="body.S", e="body.e",
             tau="none", S_I="parent.S", e_I="parent.e"),
    ),
    order=TIPS_TO_ROOT, skip="idle",
)  # fmt: skip

EXERTED = Pass(
    "exerted",
    "body",
    "Load of everything outboard under the hinge's given accelerations.",
    (call("generic{nu}.exerted", S="body.S", H="hinge.H", udot="body.given", e="body.e"),),
)

FELT_BY = Pass(
    "felt_by",
    "body",
    "What one hinge feels of a load, and the load on the parent.",
    EFFORT_AND_TRANSPORT,
)

COMPOSITION = Sweep(
    "composition",
    "Inertia of everything outboard of each hinge, as if no hinge moved.",
    (Run(whole=PRESCRIBED), Run(whole=FORWARD), Run(whole=COMPOSED)),
)
