"""Flexible bodies: passing sections, modal rows, condensation and recovery."""

from __future__ import annotations

from .pass_steps import ROOT_TO_TIPS, Add, Copy, Pass, call

_FIELDS = (
    "p", "C", "P", "B", "Z_xx", "Z_xy", "Z_xz", "Z_yy", "Z_yz", "Z_zz", "Y_x", "Y_y", "Y_z",
    "G_x", "G_y", "G_z", "M",
)  # fmt: skip
_MOMENTS = {name: f"moments.{name}" for name in _FIELDS}
_DRAG = {name: f"drag.{name}" for name in _FIELDS}
_SECTION_DATA = {
    name: f"section.{name}"
    for name in ("r", "phi", "theta", "g_x", "g_y", "g_z", "h_x", "h_y", "h_z")
}
_SEGMENT_MOTION = {name: f"section.{name}" for name in ("Om", "Omd", "Omdd")}
_STATE = {"eta": "modes.eta", "etad": "modes.etad"}
_MOTION_PORTS = {name: f"section.{name}" for name in ("x", "Psi", "xd", "Psid", "xdd", "Psidd")}
_HINGE_PORTS = {
    "R": "hinge.R", "d": "hinge.d", "H6": "section.H6", "v": "hinge.v", "w": "hinge.w",
    "c": "hinge.c",
}  # fmt: skip

SECTION_MOTION = Pass(
    "section_motion", "body", "Relative motion across a section of a flexible body.",
    (
        call("modal.segment", when="segment", b="section.b", Bm="section.Bm", **_STATE,
             dC1="section.dC1", dC2="section.dC2", dX="section.dX",
             Phi="section.Phi", **_SEGMENT_MOTION),
        call("modal.segment_motion", when="segment", fails="section", R_end="section.end",
             **_SEGMENT_MOTION, **_HINGE_PORTS),
        call("modal.section", when="!segment", **_SECTION_DATA, **_STATE, Phi="section.Phi",
             **_MOTION_PORTS),
        call("modal.end_motion", when="outward !segment", fails="section", R_end="section.end",
             **_MOTION_PORTS, **_HINGE_PORTS),
        call("modal.frame_motion", when="!outward", fails="section", R_end="section.end",
             **_MOTION_PORTS, **_HINGE_PORTS),
        call("modal.subspace", H6="section.H6", Phi="section.Phi", H="section.H"),
        call("modal.prescribed_bias", when="inverse", H="section.H", s="modes.given", c="hinge.c",
             c_s="local.c"),
        Copy(to="hinge.c", source="local.c", when="inverse"),
    ),
)  # fmt: skip

MODAL_OWN = Pass(
    "modal_own", "body", "S, e and the modal rows of a flexible body at its bias motion.",
    (
        call("modal.residual", **_MOMENTS, K="modes.K", D="modes.D", **_STATE,
             motion="body.motion", S="body.S", S_rf="modes.S_rf", A="modes.A", S_ff="modes.S_ff",
             e="body.e", e_f="modes.e_f"),
        Copy(to="modes.qdot", source="modes.etad"),
        call("modal.prescribed_load", when="inverse", S_rf="modes.S_rf", S_ff="modes.S_ff",
             s="modes.given", e="body.e", e_f="modes.e_f"),
    ),
)  # fmt: skip

#: Elimination of modes from S and e of the body, before its hinge is passed.
_CONDENSED = {"S_c": "local.S_c", "e_c": "local.e_c", "Gg": "modes.gain", "right": "modes.right"}
MODAL_CONDENSE = Pass(
    "modal_condense", "body", "Modes eliminated from S and e of a flexible body.",
    (
        Add(to="modes.e_f", source="modes.efforts", times=-1, when="efforts"),
        call("modal.rebase", when="section", H="section.H", S="body.S", e="body.e",
             S_rf="modes.S_rf", S_rf_I="modes.S_rf_I", S_ff="modes.S_ff", e_f="modes.e_f"),
        call("modal.condense", when="section", fails="modes", S="body.S", e="body.e",
             S_rf="modes.S_rf_I", S_ff="modes.S_ff", e_f="modes.e_f", work="modes.work",
             **_CONDENSED),
        call("modal.condense", when="!section", fails="modes", S="body.S", e="body.e",
             S_rf="modes.S_rf", S_ff="modes.S_ff", e_f="modes.e_f", work="modes.work",
             **_CONDENSED),
        Copy(to="body.S", source="local.S_c"),
        Copy(to="body.e", source="local.e_c"),
    ),
)  # fmt: skip

#: Contribution of the bodies outboard of an end to the modes of the flexible body.  A station of an
#: exact beam adds the columns of the stations outboard of it and carries them to the one before.
PORT_ASSEMBLY = (
    call("modal.assemble_port", when="!segment", Rc="hinge.R", r="hinge.d", H="section.H",
         S="body.S", e="body.e", U="section.push", S_rf="modes.S_rf", S_ff="modes.S_ff",
         e_f="modes.e_f"),
    call("modal.rebase", when="segment", H="section.H", S="body.S", e="body.e",
         S_rf="section.S_rf", S_rf_I="section.push", S_ff="modes.S_ff", e_f="modes.e_f"),
    call("modal.carry_columns", when="segment", Rc="hinge.R", r="hinge.d", S_rf_I="section.push",
         S_rf="inboard.S_rf"),
)  # fmt: skip

#: Contribution of the modes to the deviation outboard of a section.
PORT_MOTION = (
    call("modal.port_deviation", H="section.H", etadd="modes.etadd", delta_I="body.delta",
         delta="local.delta"),
    Copy(to="body.delta", source="local.delta"),
)  # fmt: skip

#: Part of the load on a station that S and e of its outboard part do not contain.
STATION_LOAD = call("modal.outboard_load", when="segment loads_read", S_rf="section.S_rf",
                    etadd="modes.etadd", e="body.e")  # fmt: skip

#: Modal efforts of the load on a section.
MODAL_EFFORT = (
    call("modal.modal_effort", H="section.H", e="body.e", e_f="modes.e_f", tau="modes.load_effort"),
    Copy(to="modes.e_f", source="modes.load_effort"),
)

STRAIN = Pass(
    "strain", "body", "Strain energy and damping of flexible bodies.",
    (
        call("modal.strain_energy", K="modes.K", D="modes.D", **_STATE, V="local.V",
             W_d="local.P"),
        Add(to="sums.potential", source="local.V"),
        Add(to="sums.power", source="local.P", times=-1),
    ),
    skip="!modal",
)  # fmt: skip

DRAG = Pass(
    "drag", "body", "Viscous drag of flexible bodies: momentum with the drag as density.",
    (
        call("modal.momentum", **_DRAG, **_STATE, v="body.v", w="body.w", S="local.S",
             S_rf="modes.S_rf_I", A="modes.A_drag", h="local.h", h_f="modes.load_effort",
             T="local.T"),
        Add(to="body.e", source="local.h"),
        Add(to="modes.e_f", source="modes.load_effort"),
        Add(to="sums.power", source="local.T", times=-2, when="balance"),
    ),
    order=ROOT_TO_TIPS, skip="!drag",
)  # fmt: skip

MOMENTUM = Pass(
    "momentum", "body", "Mass matrix of the frame, momentum and energy of a flexible body.",
    (
        call("modal.momentum", **_MOMENTS, **_STATE, v="body.v", w="body.w", S="given.S",
             S_rf="modes.S_rf_I", A="modes.A", h="given.h", h_f="modes.load_effort", T="given.T"),
    ),
    given=("given.S", "given.h", "given.T"),
)  # fmt: skip
