"""M^-1 times columns: S is factored once, then one backward and forward pass per column."""

from __future__ import annotations

from .flexible import MODAL_CONDENSE, MODAL_EFFORT, PORT_ASSEMBLY, PORT_MOTION
from .forward_kinematics import HINGE_MOTION
from .pass_steps import TIPS_TO_ROOT, Add, Copy, Pass, RunPass, ScatterSpeeds, call, only
from .riccati_sweep import BODY, FREE, FREE_EFFORTS

FACTORISE = Pass(
    "factorise", "body", "Mass matrices carried to the root; factors of eliminations stored.",
    (
        RunPass(whole=HINGE_MOTION, when="own"),
        # Loads are carried but not read: each column starts from zero load.
        RunPass(whole=MODAL_CONDENSE, when="modal"),
        *only("outward", PORT_ASSEMBLY),
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
