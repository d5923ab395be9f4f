"""Riccati sweep: S and e from tips to root, accelerations from root to tips."""

from __future__ import annotations

from dataclasses import replace

from .flexible import MODAL_CONDENSE, PORT_ASSEMBLY, PORT_MOTION, STATION_LOAD
from .forward_kinematics import HINGE_MOTION
from .pass_steps import (
    TIPS_TO_ROOT,
    Add,
    ByScrew,
    CheckPivots,
    Copy,
    EachSpeed,
    Pass,
    RunPass,
    ScatterSpeeds,
    SelectColumns,
    Step,
    call,
    only,
)

BODY = {"Rc": "body.R", "r": "body.r"}
COORDINATES = {"p": "hinge.p", "q": "body.q"}
_LOCAL_PORTS = {"S": "local.S", "e": "local.e"}
_LOCAL_OUTPUTS = {"S_I": "local.S", "e_I": "local.e"}
_NO_SPEEDS = {"H": "none", "J": "none", "floor": "zero", "tau": "none"}

#: Columns of H, rotor inertia and efforts of the free speeds.
FREE = (
    SelectColumns(to="hinge.H_free", source="hinge.H", rows=6),
    SelectColumns(to="hinge.J_free", source="body.rotor"),
)
FREE_EFFORTS = SelectColumns(to="hinge.tau_free", source="body.tau")


def _transport_steps(rotation: str, place: str) -> tuple[Step, ...]:
    """S and e carried by the plain products; the kernel adds to the stored values."""
    return (
        Copy(to="local.S_I"),
        Copy(to="local.e_I"),
        call("generic0.condense", Rc=rotation, r=place, **_NO_SPEEDS, **_LOCAL_PORTS,
             S_I="local.S_I", e_I="local.e_I"),
        Copy(to="local.S", source="local.S_I"),
        Copy(to="local.e", source="local.e_I"),
    )  # fmt: skip


def transport(stage: str, place: str, when: str) -> Step:
    """S and e across one stage, by the cheapest kernel for its structure.

    S is carried across a screw by plain products: the double-angle form needs fewer operations,
    but computes small moments outboard of a long chain as differences of large ones.
    """
    rotation = f"{stage}.R"

    def screw(axis: str, turn: str, along: int) -> tuple[Step, ...]:
        return (
            call(f"screw.condense_{axis}", turn=f"{rotation}[{turn}]", d=f"{place}[{along}]",
                 **_LOCAL_PORTS, **_LOCAL_OUTPUTS),
        )  # fmt: skip

    return ByScrew(
        rotation=rotation, position=place, when=when,
        about_x=screw("x", "4 7", 0),
        about_z=screw("z", "0 3", 2),
        turning=(
            call("screw.condense_turn_by_trace", Rc=rotation, **_LOCAL_PORTS, **_LOCAL_OUTPUTS),
            *_transport_steps("identity", place),
        ),
        otherwise=_transport_steps(rotation, place),
    )  # fmt: skip


#: Elimination separate from the transport.  After a screw about z that leaves H unchanged, it is
#: done in inboard axes, which removes the rotation from the chain of divisions.
_ELIMINATION_PORTS = {
    **_LOCAL_PORTS, "F": "hinge.F", "Z": "hinge.Z", "W": "hinge.W", "S_Q": "local.S",
    "e_Q": "local.e", "D_ii": "local.pivots",
}  # fmt: skip


def eliminate_free_speeds(load: str) -> tuple[Step, ...]:
    """S and a load after elimination of the hinge's free speeds."""
    return (
        Copy(to="local.S", source="body.S"),
        Copy(to="local.e", source=load),
        transport("hinge", "hinge.d", when="axial"),
    )


def eliminate_with_effort(effort: str, offset: str) -> tuple[Step, ...]:
    """S and a load after elimination of the hinge's free speeds, on which an effort acts."""
    ports = {**_ELIMINATION_PORTS, "tau": effort, "z": offset}
    return (
        call("hinge.eliminate", when="free special", fails="undetermined", **COORDINATES, **ports),
        call("generic{free}.eliminate", when="free !special", fails="undetermined",
             H="hinge.H_free", J="hinge.J_free", **ports),
    )  # fmt: skip


#: To the parent, unless it is the ground.
ONWARD = (
    transport("hinge", "hinge.d", when="on_body !axial"),
    transport("connection", "connection.r", when="on_body"),
)
PIVOT_CHECK = CheckPivots(
    pivots="local.pivots", subspace="hinge.H_free", own="body.own", whole="body.S",
    fails="undetermined", when="free",
)  # fmt: skip
ADD_TO_PARENT = (
    Add(to="parent.S", source="local.S", when="on_body"),
    Add(to="parent.e", source="local.e", when="on_body"),
)
_STAGED_STEPS = only(
    "staged",
    *eliminate_free_speeds("body.e"),
    *eliminate_with_effort("hinge.tau_free", "hinge.z"),
    PIVOT_CHECK,
    *ONWARD,
    *ADD_TO_PARENT,
)

_GAINS = {"G": "hinge.G", "g": "hinge.g"}
_BODY_PORTS = {"floor": "body.floor", "S": "body.S", "e": "body.e"}
_PARENT_PORTS = {"S_I": "parent.S", "e_I": "parent.e"}

CONDENSE = Pass(
    "condense", "body", "S and e of a body, complete, carried across its hinge to the parent.",
    (
        RunPass(whole=MODAL_CONDENSE, when="modal"),
        *only("outward", *PORT_ASSEMBLY),
        *only("parts", *FREE, FREE_EFFORTS),
        call("hinge.condense", when="own", fails="undetermined", **BODY, **COORDINATES,
             **_BODY_PORTS, tau="body.tau", **_GAINS, **_PARENT_PORTS),
        call("generic{free}.condense", when="parts !staged", fails="undetermined", **BODY,
             H="hinge.H_free", J="hinge.J_free", **_BODY_PORTS, tau="hinge.tau_free", **_GAINS,
             **_PARENT_PORTS),
        *_STAGED_STEPS,
    ),
    order=TIPS_TO_ROOT, skip="idle",
)  # fmt: skip

_FACTORED = {"H": "hinge.H_free", "F": "hinge.F", "Z": "hinge.Z", "z": "hinge.z", "W": "hinge.W"}
_RATES = {"udot": "hinge.rates"}
_NO_GAINS = {"H": "none", "G": "none", "g": "none"}

#: After `eliminate_with_effort`, stage by stage.
RECOVERED = (
    call("generic0.recover", Rc="connection.R", r="connection.r", **_NO_GAINS,
         delta_I="parent.delta", delta="local.delta"),
    call("generic{free}.recover_factored", when="free axial", Rc="identity", r="zero",
         **_FACTORED, delta_I="local.delta", **_RATES, delta="local.delta"),
    call("generic0.recover", when="free axial", Rc="hinge.R", r="hinge.d", **_NO_GAINS,
         delta_I="local.delta", delta="body.delta"),
    call("generic{free}.recover_factored", when="free !axial", Rc="hinge.R", r="hinge.d",
         **_FACTORED, delta_I="local.delta", **_RATES, delta="body.delta"),
    call("generic0.recover", when="!free", Rc="hinge.R", r="hinge.d", **_NO_GAINS,
         delta_I="local.delta", delta="body.delta"),
)  # fmt: skip

RECOVER = Pass(
    "recover", "body", "Accelerations of a hinge and deviation of the body from its bias motion.",
    (
        call("hinge.recover", when="own", **BODY, **COORDINATES, **_GAINS,
             delta_I="parent.delta", udot="body.udot", delta="body.delta"),
        call("generic{free}.recover", when="parts !staged", **BODY, H="hinge.H_free", **_GAINS,
             delta_I="parent.delta", **_RATES, delta="body.delta"),
        *only("staged", *RECOVERED),
        ScatterSpeeds(to="body.udot", free="hinge.rates", imposed="body.s", when="parts !refined"),
        ScatterSpeeds(to="body.udot", free="hinge.rates", when="parts refined"),
        Add(to="body.udot", source="body.s", when="refined"),
        Add(to="body.udot", source="body.bias_offset", when="staged"),
        call("modal.recover", when="modal", Gg="modes.gain", delta_I="body.delta",
             etadd="modes.etadd"),
        Copy(to="modes.udot", source="modes.etadd", when="modal"),
        Add(to="modes.udot", source="modes.given", when="modal refined"),
        *only("section", *PORT_MOTION),
        STATION_LOAD,
    ),
    skip="idle", given=("parent.delta",),
)  # fmt: skip


# --- least-squares sweep --------------------------------------------------------------------------
# It keeps accuracy for large mass ratios (heavy bodies outboard of light ones).  Rows use the
# storage of S, and d that of deviations; S and e are recomputed from them for later readers.  The
# forward pass is that of the Riccati sweep, with the same gains.

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


# --- links ----------------------------------------------------------------------------------------
# The hinge moves about and along z, or rotates about a point.  Consecutive links are swept without
# their workspace blocks: only what the next pass reads is stored, and S and e stay in registers or
# local arrays from link to link.

_LINK = {"link": "link.numbers", "turn": "link.turn"}
_BODY = {"b": "link.b", "p": "link.p"}

LINK_TURN = Pass(
    "link_turn",
    "link",
    "Rotation across the hinge; about z only its angle, because sines and cosines of two links"
    " are computed together.",
    (call("link.turn", **_LINK, q="link.q"),),
)

LINK_FORWARD = Pass(
    "link_forward", "link", "Bias motion and own load of a link.",
    (
        call("link.forward", fails="hinge", **_LINK, **_BODY, q="link.q", u="link.u",
             motion_I="outer.motion", d="link.shift", motion="link.motion", e_B="link.load",
             qdot="link.qdot"),
    ),
)  # fmt: skip

LINK_CONDENSE = Pass(
    "link_condense", "link", "S and e of a link and its outboard part, carried to the parent.",
    (
        call("link.condense", fails="undetermined", **_LINK, d="link.shift", **_BODY,
             S_K="inner.S", e_K="inner.e", e_B="link.load", tau="link.tau", G="link.G",
             g="link.g", S_I="outer.S", e_I="outer.e"),
    ),
    order=TIPS_TO_ROOT,
)  # fmt: skip

LINK_RECOVER = Pass(
    "link_recover", "link", "Acceleration of a link, and its deviation, which replaces its motion.",
    (
        call("link.recover", **_LINK, d="link.shift", p="link.p", G="link.G", g="link.g",
             delta_I="outer.delta", udot="link.udot", delta="link.motion"),
    ),
)  # fmt: skip


# --- iterative refinement -------------------------------------------------------------------------
# The accelerations of the first solution are the bias motion.  Their inverse dynamics, which
# eliminates nothing, is the right-hand side of the same sweep: large mass ratios then only affect
# the digits of the correction.

ROTOR_RESIDUAL = Pass(
    "rotor_residual", "body", "Efforts less those of the rotors at the computed accelerations.",
    (
        EachSpeed(
            steps=(
                call("frames.driven_effort", load="zero", J="body.rotor[k]", udot="body.s[k]",
                     tau="body.tau[k]", tau_d="local.lack"),
                Copy(to="body.tau[k]"),
                Add(to="body.tau[k]", source="local.lack", times=-1),
            ),
        ),
        # Prescribed speeds have no equation.
        EachSpeed(
            steps=(
                call("frames.driven_effort", load="zero", J="body.rotor[k]", udot="body.s[k]",
                     tau="zero", tau_d="local.rotor"),
                Add(to="body.tau[k]", source="local.rotor"),
            ),
            imposed=True, when="imposed",
        ),
    ),
    skip="cut",
)  # fmt: skip

#: For trees without cut hinges.
ROTOR_RESIDUAL_OF_TREE = replace(ROTOR_RESIDUAL, name="rotor_residual_of_tree", skip="")
