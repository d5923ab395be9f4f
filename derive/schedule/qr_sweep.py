"""Least-squares sweep in place of `condense`: rows U, d and loads e from tips to root.

It keeps accuracy for large mass ratios (heavy bodies outboard of light ones).  Rows use the storage
of S, and d that of deviations; S and e are recomputed from them for later readers.  The forward
pass is that of the Riccati sweep, with the same gains.
"""

from __future__ import annotations

from .forward_kinematics import HINGE_MOTION
from .pass_steps import TIPS_TO_ROOT, Copy, Pass, RunPass, call
from .riccati_sweep import FREE, FREE_EFFORTS

QR_OWN = Pass(
    "qr_own", "body", "Rows of a single body, with its load at the bias motion.",
    (
        RunPass(whole=HINGE_MOTION, when="own"),
        call("qr.factor", S="body.S", U="local.U"),
        Copy(to="body.U", source="local.U"),
        call("qr.bias", when="rigid", U="body.U", motion="body.motion", d="body.d", e="body.e"),
        Copy(to="body.d", when="!rigid"),
    ),
    skip="idle",
)  # fmt: skip

_ROWS = {"U": "body.U", "d": "body.d", "e": "body.e"}
_REDUCED_PORTS = {"V": "local.V", "d_V": "local.d_V", "e_Q": "local.e_Q"}

QR_CONDENSE = Pass(
    "qr_condense", "body", "Rows of a body, complete, carried across its hinge to the parent.",
    (
        *FREE,
        FREE_EFFORTS,
        call("generic{free}.qr_eliminate", fails="undetermined", H="hinge.H_free",
             J="hinge.J_free", floor="body.floor", **_ROWS, tau="hinge.tau_free", G="hinge.G",
             g="hinge.g", **_REDUCED_PORTS),
        call("qr.merge", when="on_body", Rc="body.R", r="body.r", **_REDUCED_PORTS, U_P="parent.U",
             d_P="parent.d", U="local.U", d="local.d", e_I="parent.e"),
        Copy(to="parent.U", source="local.U", when="on_body"),
        Copy(to="parent.d", source="local.d", when="on_body"),
        call("qr.rows_to_riccati", when="loads_read", **_ROWS, S="local.S", e_S="local.e_S"),
        Copy(to="body.S", source="local.S", when="loads_read"),
        Copy(to="body.e", source="local.e_S", when="loads_read"),
    ),
    order=TIPS_TO_ROOT, skip="idle",
)  # fmt: skip
