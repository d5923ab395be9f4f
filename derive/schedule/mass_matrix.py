"""The mass matrix: inertia of all that hangs on a hinge, and what its acceleration asks of others.

With every hinge held, S of what is outboard is carried to the parent as it is.  One speed of a
hinge that changes at 1 a second then asks for the load S H there, which the hinges on the way to
the root feel, and no other.
"""

from __future__ import annotations

from .forward_kinematics import FORWARD, HINGE_MOTION, PRESCRIBED
from .inverse_dynamics import FELT_ON_THE_WAY
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
    FELT_ON_THE_WAY,
)

COMPOSITION = Sweep(
    "composition",
    "Inertia of everything outboard of each hinge, as if no hinge moved.",
    (Run(whole=PRESCRIBED), Run(whole=FORWARD), Run(whole=COMPOSED)),
)
