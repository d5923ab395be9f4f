"""Inverse dynamics; mass matrix: its entries by composite inertias, its inverse times columns."""

from __future__ import annotations

from .flexible import MODAL_CONDENSE, MODAL_EFFORT, PORT_ASSEMBLY, PORT_MOTION
from .forward_kinematics import FORWARD, HINGE_MOTION, PRESCRIBED_ACCELERATIONS
from .pass_steps import (
    TIPS_TO_ROOT,
    Add,
    Copy,
    EachSpeed,
    Pass,
    Run,
    RunPass,
    ScatterSpeeds,
    Sweep,
    call,
    only,
)
from .riccati_sweep import BODY, FREE, FREE_EFFORTS

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


# --- mass matrix ----------------------------------------------------------------------------------
# With all hinges locked, S of the outboard bodies is carried to the parent unchanged.  Unit
# acceleration of one speed of a hinge requires the load S H there, which only the hinges on the
# path to the root resist.  For M^-1 times columns S is factored once; then one backward and one
# forward pass follow for each column.

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

# --- inverse times columns ------------------------------------------------------------------------

FACTORISE = Pass(
    "factorise", "body", "Mass matrices carried to the root; factors of eliminations stored.",
    (
        RunPass(whole=HINGE_MOTION, when="own"),
        # Loads are carried but not read: each column starts from zero load.
        RunPass(whole=MODAL_CONDENSE, when="modal"),
        *only("outward", *PORT_ASSEMBLY),
        *FREE,
        call("generic{free}.factor", fails="undetermined", **BODY, H="hinge.H_free",
             J="hinge.J_free", W="zero", floor="body.floor", S="body.S", F="hinge.F",
             G="hinge.G", S_I="parent.S"),
    ),
    order=TIPS_TO_ROOT, skip="idle",
)  # fmt: skip

COLUMN = Pass(
    "column", "body", "Efforts of one right-hand side; loads set to zero.",
    (
        Copy(to="body.e"),
        Copy(to="body.tau", source="body.column"),
        *only("modal", Copy(to="modes.e_f"),
              Add(to="modes.e_f", source="modes.column", times=-1)),
    ),
)  # fmt: skip

COLUMN_BACKWARD = Pass(
    "column_backward", "body", "Load of the right-hand side carried to the parent.",
    (
        *only("modal section", *MODAL_EFFORT),
        *only("modal", call("modal.column_load", Gg="modes.gain", e="body.e", e_f="modes.e_f",
                            e_c="local.e_c"),
              Copy(to="body.e", source="local.e_c")),
        *only("outward", *MODAL_EFFORT),
        FREE_EFFORTS,
        call("generic{free}.column_load", **BODY, H="hinge.H_free", G="hinge.G", e="body.e",
             tau="hinge.tau_free", y="hinge.g", e_I="parent.e"),
    ),
    order=TIPS_TO_ROOT, skip="idle",
)  # fmt: skip

COLUMN_FORWARD = Pass(
    "column_forward", "body", "Accelerations due to the right-hand side.",
    (
        call("generic{free}.column_acceleration", **BODY, H="hinge.H_free", F="hinge.F",
             G="hinge.G", y="hinge.g", delta_I="parent.delta", udot="hinge.rates",
             delta="body.delta"),
        ScatterSpeeds(to="body.answer", free="hinge.rates"),
        *only("modal", call("modal.column_acceleration", S_ff="modes.S_ff", e_f="modes.e_f",
                            Gg="modes.gain", delta_I="body.delta", y="modes.load_effort",
                            etadd="modes.etadd", work="modes.work"),
              Copy(to="modes.answer", source="modes.etadd")),
        *only("section", *PORT_MOTION),
    ),
    skip="idle",
)  # fmt: skip
