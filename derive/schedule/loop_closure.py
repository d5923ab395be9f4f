"""Closed loops: rows of cut hinges, carried as columns through the sweep.

Instead of `condense` and `recover` the factors of each elimination are kept, as for several
right-hand sides, and the columns of open rows follow the load across the hinge; in code for one
scene stage by stage, as for the load.  See derive/equations/loop_closure.py.
"""

from __future__ import annotations

from dataclasses import replace

from .flexible import MODAL_CONDENSE, PORT_ASSEMBLY, PORT_MOTION, STATION_LOAD
from .forward_kinematics import HINGE_MOTION
from .loads import (
    BIAS_EFFORTS_TO_KNOWN,
    EFFORTS_TO_KNOWN,
    OWN_COUPLINGS,
    OWN_COUPLINGS_BIAS,
    OWN_EFFORTS_TO_KNOWN,
    efforts_of,
    efforts_of_own,
)
from .pass_steps import (
    TIPS_TO_ROOT,
    Add,
    Call,
    Copy,
    EachSpeed,
    ForEach,
    Move,
    Pass,
    RunPass,
    ScatterSpeeds,
    SelectColumns,
    call,
    only,
)
from .riccati_sweep import (
    ADD_TO_PARENT,
    BODY,
    FREE,
    FREE_EFFORTS,
    ONWARD,
    PIVOT_CHECK,
    RECOVERED,
    eliminate_free_speeds,
    eliminate_with_effort,
)

_END_PORTS = {"R_C": "closure.R_C", "r_e": "closure.end"}
_CONSTRAINT_PORTS = {"W": "closure.W", "gap": "closure.gap"}


def _row(k: str) -> Call:
    return call("loops.row", w=f"closure.W[6 * {k}]", **_END_PORTS, Rc="body.R",
                r_A="closure.lever", J_A=f"closure.J_A[6 * {k}]",
                J_B=f"closure.J_B[6 * {k}]")  # fmt: skip


def _known_rows_call(relative: str, when: str) -> Call:
    return call("loops.known_parts", when=when, W="closure.W", relative=relative, l="closure.l")


def _gap_calls(when: str) -> tuple[Call, ...]:
    return (call("loops.gap", when=when, R_e="closure.turn", R_C="closure.R_C", d="closure.d",
                 gap="closure.gap"),)  # fmt: skip


_RELATIVE_MOTION = (
    call("frames.pose", when="staged", A_I="connection.R", x_I="connection.r", Rc="hinge.R",
         r="hinge.d", A="body.R", x="body.r"),
    call("generic{nu}.complement", when="hinged", fails="hinge", H="hinge.H", W="closure.W"),
    call("loops.relative_pose", A_C="body.A", x_C="body.x", A_B="outboard.A", x_B="outboard.x",
         r_e="closure.end", **BODY, R_C="closure.R_C", r_A="closure.lever", d="closure.d"),
    call("loops.slip", **_END_PORTS, d="closure.d", v_C="body.v", w_C="body.w", v_B="outboard.v",
         w_B="outboard.w", slip="closure.slip"),
)  # fmt: skip
#: A constraint defines its own directions and gap.
_CONSTRAINT_STEPS = (
    call("loops.distance", when="distance", p="closure.p", d="closure.d", **_CONSTRAINT_PORTS),
    call("loops.plane", when="plane", p="closure.p", d="closure.d", **_CONSTRAINT_PORTS),
    call("loops.rolling", when="rolling", fails="flat", p="closure.p", R_C="closure.R_C",
         d="closure.d", **_CONSTRAINT_PORTS),
)  # fmt: skip
_DRIFT = call("loops.drift", **_END_PORTS, d="closure.d", slip="closure.slip",
              motion_C="body.motion", motion_B="outboard.motion",
              drift="local.drift")  # fmt: skip
#: Alternative for steps that close gaps by accelerations.
_REQUIRED_ACCELERATION = call(
    "loops.required_acceleration", gap="closure.gap", rate="step.closing", relative="local.relative"
)
#: Terms of rotating directions.
_DIRECTION_RATES = (
    call("loops.distance_drift", when="distance", d="closure.d", slip="closure.slip",
         drift="local.drift"),
    call("loops.rolling_drift", when="rolling", p="closure.p", R_C="closure.R_C",
         slip="closure.slip", drift="local.drift"),
)  # fmt: skip
#: Load of the hinge's laws along its directions.
_EFFORTS = EachSpeed(
    steps=(
        _row("k"),
        call("loops.apply_effort", J="closure.J_A[6 * k]", tau="body.tau[k]", e="parent.e"),
        call("loops.apply_effort", J="closure.J_B[6 * k]", tau="body.tau[k]", e="outboard.e"),
    )
)


def _multiplier_loads(x: str) -> tuple[Call, Call]:
    """Load of a row's multiplier on both bodies."""
    return (
        call("loops.apply_multiplier", K="closure.J_A[6 * c]", x=x, e="parent.e"),
        call("loops.apply_multiplier", K="closure.J_B[6 * c]", x=x, e="outboard.e"),
    )


CLOSURES = Pass(
    "closures", "body",
    "Rows of the element that closes a loop, and the load of the laws of a hinge.",
    (
        *_RELATIVE_MOTION,
        *_gap_calls("position_gap"),
        *_gap_calls("gap_closing"),
        *_CONSTRAINT_STEPS,
        _known_rows_call("closure.gap", "position_gap"),
        _known_rows_call("closure.slip", "velocity_error"),
        efforts_of_own("own.previous_x", "refined"),
        *only("!corrected !gap_closing", _DRIFT, *_DIRECTION_RATES,
              _known_rows_call("local.drift", "")),
        *only("gap_closing", _REQUIRED_ACCELERATION, _known_rows_call("local.relative", "")),
        _EFFORTS,
        ForEach(
            of="rows",
            steps=(
                _row("c"),
                Move(to="side.inner", source="closure.J_A[6 * c]", count="6"),
                Move(to="side.outer", source="closure.J_B[6 * c]", count="6"),
                Move(to="line.known", source="closure.l[c]", count="1"),
                # Rotor inertia enters a correction but has no error of its own.
                Copy(to="line.known", when="corrected soft"),
                *only(
                    "refined",
                    *_multiplier_loads("line.previous_x"),
                    call("loops.rotor_row_residual", when="soft", softness="line.softness",
                         s="body.s[c]", x="line.previous_x", l="line.known"),
                ),
            ),
        ),
        OWN_COUPLINGS,
        OWN_COUPLINGS_BIAS,
    ),
    skip="!cut",
)  # fmt: skip

#: Multipliers are known from an earlier evaluation of accelerations in this workspace.
CLOSURE_LOADS = Pass(
    "closure_loads", "body", "Rows of a cut hinge, and its complete load on its bodies.",
    (
        *_RELATIVE_MOTION,
        *_CONSTRAINT_STEPS,
        _DRIFT,
        *_DIRECTION_RATES,
        _known_rows_call("local.drift", ""),
        efforts_of_own("own.x", ""),
        _EFFORTS,
        ForEach(of="rows", steps=(_row("c"), *_multiplier_loads("line.x"))),
        OWN_EFFORTS_TO_KNOWN,
    ),
    skip="!cut",
)  # fmt: skip

_ROW = {"inverse": "row.inverse", "l": "row.known"}
_COLUMN = {"inverse": "row.inverse", "K": "row.K"}

ROW_ELIMINATION = Pass(
    "row_elimination", "row", "A row eliminated on the body where its ends meet.",
    (
        Copy(to="row.inverse", when="immobile"),
        call("loops.pivot_inverse", when="!immobile", inverse="row.inverse", L="row.pivot",
             floor="row.floor"),
        call("loops.eliminate_row", when="!immobile inside", **_COLUMN, l="row.known",
             S="meeting.S", e="meeting.e"),
        ForEach(
            of="others",
            steps=(
                call("loops.update_column", when="inside", **_COLUMN, L_p="other.L", K_p="other.K"),
                call("loops.update_known_part", **_ROW, L_p="other.L", l_p="other.known"),
                ForEach(
                    of="seconds",
                    steps=(
                        call("loops.update_coupling", inverse="row.inverse", L_p="other.L",
                             L_q="second.L", L_pq="both.L"),
                    ),
                ),
            ),
        ),
    ),
)  # fmt: skip

ROW_MULTIPLIER = Pass(
    "row_multiplier", "row", "Multiplier of a row, from the motion of the body where it closes.",
    (
        call("loops.multiplier", **_ROW, x="row.x"),
        call("loops.multiplier_of_motion", when="inside", **_COLUMN, delta="meeting.delta",
             x="row.x"),
        ForEach(
            of="others",
            steps=(
                call("loops.multiplier_of_row", inverse="row.inverse", L_p="other.L",
                     x_p="other.x", x="row.x"),
            ),
        ),
    ),
    order=TIPS_TO_ROOT,
)  # fmt: skip

CLEAR_LOADS = Pass(
    "clear_loads", "body", "Loads and efforts set to zero: only the rows are to be satisfied.",
    (Copy(to="body.e"), Copy(to="body.tau"), *only("modal", Copy(to="modes.e_f"))),
)  # fmt: skip

#: Elimination of modes from rows that pass or end at a flexible body, after S and e.
_ROW_CONDENSATION = ForEach(
    of="bent",
    steps=(
        call("modal.modal_column", when="section", H="section.H", K="bent.K", K_f="bent.modes"),
        call("modal.condense_row", S_ff="modes.S_ff", K_f="bent.modes", Gg="modes.gain",
             work="modes.work", Y="bent.y", K="bent.K", l="bent.known"),
        ForEach(
            of="bent_before",
            steps=(
                call("modal.row_coupling", K_f="bent_before.modes", Y="bent.y",
                     L_ij="bent_pair.L"),
            ),
        ),
    ),
)  # fmt: skip
_MODAL_SOLUTION = (
    call("modal.recover", Gg="modes.gain", delta_I="body.delta", etadd="modes.etadd"),
    ForEach(
        of="bent",
        steps=(call("modal.multiplier_acceleration", Y="bent.y", x="bent.x", etadd="modes.etadd"),),
    ),
    Copy(to="modes.udot", source="modes.etadd"),
    Add(to="modes.udot", source="modes.given", when="refined"),
)

_FACTOR_PORTS = {"H": "hinge.H_free", "G": "hinge.G"}

#: Coupling of a row's column with the load and with other columns at the hinge.
_ROW_COUPLING = only(
    "moving",
    call("generic{free}.divide", F="hinge.F", y="pending.y", z="local.z"),
    call("generic{free}.add_known_part", y="hinge.g", z="local.z", l="pending.known"),
    ForEach(
        of="before", steps=(call("generic{free}.couple", y="before.y", z="local.z", L_ij="pair.L"),)
    ),
)


def _effort_remainder(load: str, effort: str, remainder: str) -> Call:
    """Remainder of an effort after a load, where the hinge's speeds are eliminated."""
    return call("generic{free}.column_load", when="moving", Rc="identity", r="zero",
                H="hinge.H_free", G="zero", e=load, tau=effort, y=remainder)  # fmt: skip


def _carry_load(when: str, load: str, effort: str, remainder: str, onward: str) -> tuple[Call, ...]:
    """Load carried to the parent; a hinge on the ground only computes its efforts."""
    ports = {"e": load, "tau": effort, "y": remainder}
    return (
        call("generic{free}.column_load", when=f"{when} on_body".strip(), **BODY, **_FACTOR_PORTS,
             **ports, e_I=onward),
        call("generic{free}.ground_column_load", when=f"{when} moving !on_body".strip(),
             H="hinge.H_free", **ports),
    )  # fmt: skip


#: Modal part of a column at an end of a flexible body.
_MODAL_COLUMN = call("modal.modal_column", when="outward", H="section.H", K="pending.K",
                     K_f="pending.modes")  # fmt: skip

_UNSTAGED_STEPS = only(
    "!staged",
    call("generic{free}.factor", fails="undetermined", **BODY, H="hinge.H_free",
         J="hinge.J_free", W="zero", floor="body.floor", S="body.S", F="hinge.F",
         G="hinge.G", S_I="parent.S"),
    *_carry_load("", "body.e", "hinge.tau_free", "hinge.g", "parent.e"),
    ForEach(
        of="pending",
        steps=(
            _MODAL_COLUMN,
            *_carry_load("!coupled", "pending.K", "zero", "pending.y", "pending.onward"),
            *only(
                "coupled",
                SelectColumns(to="local.tau", source="pending.tau"),
                *_carry_load("", "pending.K", "local.tau", "pending.y", "pending.onward"),
                replace(EFFORTS_TO_KNOWN, when=""),
            ),
            *_ROW_COUPLING,
        ),
    ),
)  # fmt: skip
_STAGED_STEPS = only(
    "staged",
    *eliminate_free_speeds("body.e"),
    _effort_remainder("local.e", "hinge.tau_free", "hinge.g"),
    *eliminate_with_effort("hinge.tau_free", "hinge.z"),
    PIVOT_CHECK,
    *ONWARD,
    *ADD_TO_PARENT,
    ForEach(
        of="pending",
        steps=(
            _MODAL_COLUMN,
            *eliminate_free_speeds("pending.K"),
            *only(
                "!coupled",
                _effort_remainder("local.e", "zero", "pending.y"),
                *eliminate_with_effort("zero", "pending.z"),
            ),
            *only(
                "coupled",
                SelectColumns(to="local.tau", source="pending.tau"),
                _effort_remainder("local.e", "local.tau", "pending.y"),
                *eliminate_with_effort("local.tau", "pending.z"),
                replace(EFFORTS_TO_KNOWN, when=""),
                replace(BIAS_EFFORTS_TO_KNOWN, when="!corrected"),
            ),
            *ONWARD,
            Add(to="pending.onward", source="local.e", when="on_body"),
            *_ROW_COUPLING,
        ),
    ),
)


CONDENSE_WITH_ROWS = Pass(
    "condense_with_rows", "body", "S, e and columns of open rows carried to the parent.",
    (
        *only("modal", RunPass(whole=MODAL_CONDENSE), _ROW_CONDENSATION),
        ForEach(of="closings", steps=(RunPass(whole=ROW_ELIMINATION),)),
        *only("outward", *PORT_ASSEMBLY),
        *FREE,
        efforts_of("pending.previous_x", "refined"),
        FREE_EFFORTS,
        *_UNSTAGED_STEPS,
        *_STAGED_STEPS,
    ),
    order=TIPS_TO_ROOT, skip="omitted",
)  # fmt: skip


def _multiplier_efforts(column: str, offset: str) -> ForEach:
    """Efforts from the multipliers of open rows."""
    return ForEach(
        of="pending",
        steps=(
            call("generic{free}.add_multiplier_effort", when="moving", y=column, x="pending.x",
                 y_0=offset),
            call("loops.apply_multiplier", when="loads_read", K="pending.K", x="pending.x",
                 e="body.e"),
        ),
    )  # fmt: skip


RECOVER_WITH_ROWS = Pass(
    "recover_with_rows", "body", "Accelerations of a hinge under the multipliers of its open rows.",
    (
        *only(
            "!staged",
            _multiplier_efforts("pending.y", "hinge.g"),
            call("generic{free}.column_acceleration", **BODY, **_FACTOR_PORTS, F="hinge.F",
                 y="hinge.g", delta_I="parent.delta", udot="hinge.rates", delta="body.delta"),
        ),
        *only("staged", _multiplier_efforts("pending.z", "hinge.z"), *RECOVERED),
        efforts_of("pending.x", "loads_read"),
        ScatterSpeeds(to="body.udot", free="hinge.rates", imposed="body.s", when="!refined"),
        *only(
            "refined",
            ScatterSpeeds(to="body.udot", free="hinge.rates"),
            Add(to="body.udot", source="body.s"),
        ),
        Add(to="body.udot", source="body.bias_offset", when="staged !corrected"),
        ForEach(of="openings", steps=(RunPass(whole=ROW_MULTIPLIER),)),
        *only("modal", *_MODAL_SOLUTION),
        *only("section", *PORT_MOTION),
        STATION_LOAD,
        # The elimination has overwritten H.
        RunPass(whole=HINGE_MOTION, when="!staged imposed balance"),
    ),
    skip="omitted",
)  # fmt: skip

CLOSURE_ACCELERATIONS = Pass(
    "closure_accelerations", "body", "Accelerations and load of a cut hinge.",
    (
        Copy(to="body.udot", source="body.s"),
        Add(to="body.udot", source="body.bias_offset", when="staged !corrected"),
        EachSpeed(
            steps=(
                call("loops.row_acceleration", J_A="closure.J_A[6 * k]", J_B="closure.J_B[6 * k]",
                     l="closure.l[k]", delta_A="parent.delta", delta_B="outboard.delta",
                     c="local.along"),
                Add(to="body.udot[k]", source="local.along"),
            ),
        ),
        ForEach(of="rows", when="refined", steps=(Add(to="line.x", source="line.previous_x"),)),
        *only(
            "loads_read",
            efforts_of_own("own.x", ""),
            Copy(to="body.e"),
            Copy(to="body.delta", when="staged"),  # a massless frame has no deviation
            EachSpeed(
                steps=(call("loops.apply_multiplier", K="closure.W[6 * k]", x="body.tau[k]",
                            e="body.e"),),
            ),
            ForEach(
                of="rows",
                steps=(call("loops.apply_effort", J="closure.W[6 * c]", tau="line.x", e="body.e"),),
            ),
        ),
    ),
    skip="!cut",
)  # fmt: skip
