"""Tangent of inverse dynamics: its derivative along one direction, and its factored form.

`DIRECTIONAL` is inverse dynamics differentiated along a direction.  The other sweeps eliminate the
unknowns of an implicit step (derive/equations/tangent_sweep.py): the motion of a body along each of
its unknowns and the change of the carried load come from the same differentiated passes, run for
that body only with its parent at rest.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from . import position_dependent_loads
from .differentiated_passes import (
    SLOPE,
    D,
    DifferentiatedCall,
    differentiate_call,
    differentiate_pass,
)
from .flexible import DRAG, MODAL_OWN, SECTION_MOTION
from .forward_kinematics import (
    BODY,
    CONNECTION,
    COORDINATES,
    DRIVES,
    FORWARD,
    HINGE,
    POSES,
    PRESCRIBED_ACCELERATIONS,
)
from .inverse_dynamics import REQUIRED_EFFORTS
from .loads import COUPLING_LOADS, EFFORTS, FORCES, LAWS, LOADS
from .loop_closure import CLOSURE_LOADS
from .pass_steps import (
    TIPS_TO_ROOT,
    Add,
    Call,
    Copy,
    ForEachDirection,
    Move,
    Pass,
    Run,
    RunPass,
    ScatterSpeeds,
    SelectColumns,
    Step,
    Sweep,
    call,
    only,
    with_renamed_slots,
)

#: Relative motion across any hinge, and of the outboard body.  Inverse dynamics has stored the
#: motion of every hinge in its slots, so one generic step serves all of them.
_HINGE_MOTION = Pass(
    "hinge_motion", "body", "Relative motion across the hinge.",
    (call("hinge.hinge", **COORDINATES, **HINGE, qdot="body.qdot"),),
)  # fmt: skip
#: Its derivative, also used by other sweeps.
HINGE_CHANGE = differentiate_pass(_HINGE_MOTION)
#: The same where later steps do not read it.
_LOCAL_CHANGE_SLOTS = {f"hinge.{name}": f"local.hinge_{name}" for name in HINGE}
_LOCAL_CHANGE_STEPS = with_renamed_slots(HINGE_CHANGE, "", _LOCAL_CHANGE_SLOTS).steps
_FORWARD_CALL = call("generic{nu}.forward", **CONNECTION, **HINGE, s="body.s",
                     motion_I="parent.motion", **BODY)  # fmt: skip
_FORWARD = Pass(
    FORWARD.name, "body", FORWARD.purpose,
    (
        RunPass(whole=SECTION_MOTION, when="section"),
        RunPass(whole=_HINGE_MOTION, when="!section"),
        _FORWARD_CALL,
        RunPass(whole=MODAL_OWN, when="modal"),
        call("body.bias_load", when="!modal", p="body.p", motion="body.motion", e="body.e"),
    ),
    skip=FORWARD.skip,
)  # fmt: skip


def _skip_hinge_motion(whole: Pass) -> Pass:
    """The pass without hinge motion, which is already known."""
    steps = (step for step in whole.steps if not isinstance(step, RunPass))
    return replace(whole, steps=tuple(steps))


_MOTION_RUNS = (
    Run(whole=differentiate_pass(PRESCRIBED_ACCELERATIONS)),
    Run(hook="drive_slopes", when="driven"),
    Run(whole=differentiate_pass(DRIVES), when="driven"),
    Run(hook="expression_slopes", when="expressions"),
    Run(whole=differentiate_pass(_FORWARD)),
)
_POSE_RUN = Run(whole=differentiate_pass(_skip_hinge_motion(POSES)), when="poses")
_LOAD_RUNS = (
    Run(whole=differentiate_pass(DRAG), when="poses flexible"),
    Run(whole=differentiate_pass(LOADS), when="poses"),
    Run(whole=differentiate_pass(FORCES), when="poses"),
)
_COUPLING_RUNS = (
    Run(hook="coupling_slopes", when="couplings"),
    Run(whole=differentiate_pass(COUPLING_LOADS), when="couplings"),
)
_CLOSURE_RUN = Run(whole=differentiate_pass(_skip_hinge_motion(CLOSURE_LOADS)), when="looped")
DIRECTIONAL = Sweep(
    "required_slope", "Derivative of the efforts required by given accelerations.",
    (
        *_MOTION_RUNS,
        Run(whole=differentiate_pass(EFFORTS)),
        Run(whole=differentiate_pass(LAWS)),
        *_COUPLING_RUNS,
        _POSE_RUN,
        *_LOAD_RUNS,
        _CLOSURE_RUN,
        Run(whole=differentiate_pass(_skip_hinge_motion(REQUIRED_EFFORTS))),
    ),
)  # fmt: skip

_NO_LOADS = Pass("no_loads", "body", "Loads set to zero.", (Copy(to=D + "body.e"),))


def _across_tree(whole: Pass, own: str) -> Run:
    """Derivative of a pass, limited to what the elimination does not include."""
    return Run(
        whole=replace(differentiate_pass(whole), name=f"{whole.name}_across", skip=own),
        when="poses",
    )


#: Loads on a body that depend on others: springs between bodies, loads in axes of other bodies,
#: expression values and cut hinges couple distant parts of the tree, so the elimination does not
#: include them.
APPLIED_SLOPE = Sweep(
    "applied_slope",
    "Derivative of loads between branches of the tree, and of the values of expressions.",
    (
        *_MOTION_RUNS,
        _POSE_RUN,
        Run(whole=_NO_LOADS, when="poses"),
        _across_tree(LOADS, "own_load"),
        _across_tree(FORCES, "own_force"),
        Run(whole=differentiate_pass(EFFORTS), when="looped"),
        *_COUPLING_RUNS,
        # Within the tree they are part of the elimination.
        Run(
            whole=replace(differentiate_pass(LAWS), name="laws_across", skip="!loop_hinge"),
            when="looped",
        ),
        _CLOSURE_RUN,
    ),
)


# --- along the unknowns of one body -------------------------------------------------------------


#: Outputs formed from derivatives of a hinge or section, and their further inputs.
_MOTION_PORTS = {"H": "hinge.H", "v": "hinge.v", "w": "hinge.w"}
_CARRIER = call("generic{nu}.tangent_carrier", **_MOTION_PORTS, s="body.s", c="hinge.c",
                motion="body.motion", Q="local.carrier")  # fmt: skip
_DISPLACEMENT_PORTS = {"theta": "local.turn", "x": "local.shift"}


def _displacement_call(change: Callable[[str], str]) -> Call:
    return call(
        "frames.tangent_pose_change",
        R="hinge.R",
        d_R=change("R"),
        d_d=change("d"),
        **_DISPLACEMENT_PORTS,
    )


def _column_ports(b: str, g: str, laws: str) -> dict[str, str]:
    """Slots of a direction's rows of B and G, and of the change of the hinge's rows."""
    return {
        **_DISPLACEMENT_PORTS, **_MOTION_PORTS, "Q": "local.carrier", "f": "body.e",
        "d_s": D + "body.given", "J": "body.rotor", "laws": laws, "B": b, "G": g,
        "row": "local.change",
    }  # fmt: skip


def _section_slot(name: str) -> str:
    return f"{D}hinge.{name}"


def _hinge_slot(name: str) -> str:
    return D + _LOCAL_CHANGE_SLOTS[f"hinge.{name}"]


def _change_ports(change: Callable[[str], str]) -> dict[str, str]:
    return {"s": "body.s"} | {f"d_{name}": change(name) for name in ("H", "v", "w", "c")}


def _mode_steps(b: str, g: str, b_p: str) -> tuple[Step, ...]:
    """B, G and B_p along modes: derivatives of a section and, in d:modes.load_effort, of rows."""
    effort = call("modal.modal_effort", H="section.H", e="body.e", e_f="modes.e_f",
                  tau="modes.load_effort")  # fmt: skip
    return (
        RunPass(whole=differentiate_pass(SECTION_MOTION)),
        _displacement_call(_section_slot),
        call(
            "generic{nu}.tangent_column",
            **_column_ports(b, g, "none"),
            **_change_ports(_section_slot),
        ),
        position_dependent_loads.column(b_p, _section_slot("v")),
        differentiate_call(effort, "e"),
    )


def _section_steps(matrices: str) -> tuple[Step, ...]:
    """Steps of a section, which has no speeds: its rows are those of the modes."""
    return (
        _CARRIER,
        ForEachDirection(
            of="modes",
            steps=(
                Copy(to=D + "modes.e_f"),
                *_mode_steps(
                    f"{matrices}.B[9 * c]", f"{matrices}.G[6 * c]", f"{matrices}.place_B[9 * c]"
                ),
                Move(to=f"{matrices}.W[n * c]", source=D + "modes.load_effort", count="n"),
            ),
        ),
    )


def _hinge_steps(b: str, g: str, b_p: str, laws: str) -> tuple[Step, ...]:
    """B, G and B_p along a hinge's unknown, from its derivatives; its rows in local.change."""
    column = _column_ports(b, g, laws)
    turning = {port: slot for port, slot in column.items() if port not in ("x", "v")}
    return (
        *only("!steady", *_LOCAL_CHANGE_STEPS),
        *only("steady curved", *_LOCAL_CHANGE_STEPS),
        *only("steady !curved placed", *_LOCAL_CHANGE_STEPS),
        call("generic{nu}.tangent_coordinate_change", when="!curved", H="hinge.H", d_q=D + "body.q",
             **_DISPLACEMENT_PORTS),
        replace(_displacement_call(_hinge_slot), when="curved"),
        call("generic{nu}.tangent_rotational", when="turning", **turning, d_u=D + "body.u"),
        call("generic{nu}.tangent_steady", when="steady !turning", **column, d_u=D + "body.u"),
        call("generic{nu}.tangent_column", when="!steady", **column, **_change_ports(_hinge_slot)),
        position_dependent_loads.column(b_p, _hinge_slot("v")),
    )  # fmt: skip


_HINGE = (
    call("hinge.directions", when="directed", **COORDINATES, s="body.s", motion="body.motion",
         f="body.e", J="body.rotor", laws="tangent.laws", along="tangent.along", rate="step.rate",
         scale="step.s", sq="step.q", **{name: f"tangent.{name}" for name in "BGWH"}),
    *only(
        "!directed",
        _CARRIER,
        ForEachDirection(
            of="free",
            steps=(
                *_hinge_steps(
                    "tangent.B[9 * c]", "tangent.G[6 * c]", "place.B[9 * c]",
                    "tangent.laws[nu * c]",
                ),
                SelectColumns(to="tangent.W[speeds * c]", source="local.change"),
            ),
        ),
        SelectColumns(to="tangent.H", source="hinge.H", rows=6),
    ),
)  # fmt: skip

INCREMENT_MATRIX = Pass(
    "increment_matrix", "body", "Derivatives of a hinge's coordinates by its speeds within a step.",
    (
        call("hinge.rates_by_coordinates", **COORDINATES, J="tangent.rates_by_coordinates"),
        call("hinge.rates_by_speeds", **COORDINATES, J="tangent.rates_by_speeds"),
        ForEachDirection(
            of="coordinates",
            steps=(Move(to="tangent.unit[nq * c]", source=D + "body.q", count="nq"),),
        ),
        call("tangent.increment_matrix", n="nq", sq="step.q", kappa="step.kappa",
             one="tangent.unit", g_q="tangent.rates_by_coordinates", A="tangent.rates",
             Q="tangent.Q", work="tangent.Q_work"),
        ForEachDirection(
            of="rates",
            steps=(
                call("tangent.coordinate_increment", n="nq", Q="tangent.Q",
                     rate="tangent.rates_by_speeds[nq * c]", dq="tangent.along[nq * c]"),
            ),
        ),
    ),
)  # fmt: skip

COORDINATE_INCREMENT = Pass(
    "coordinate_increment", "body", "Change of the coordinates of a hinge by that of its speeds.",
    (
        RunPass(whole=HINGE_CHANGE),
        Add(to=D + "body.qdot", source="body.rho"),
        call("tangent.coordinate_increment", n="nq", Q="tangent.Q", rate=D + "body.qdot",
             dq="body.change"),
    ),
)  # fmt: skip


# --- factored -----------------------------------------------------------------------------------

#: Change of a law's efforts by its own hinge only; expressions may depend on more.
LAW_CHANGE = tuple(
    DifferentiatedCall(
        step.when, step.kernel + SLOPE, tuple({**dict(step.ports), "effort": "none"}.items()),
        still=("effort",),
    )
    for step in LAWS.steps
    if isinstance(step, Call)
)  # fmt: skip

LAW_SLOPES = Pass(
    "law_slopes",
    "law",
    "Derivatives of a law along the unknowns of its hinge.",
    (
        ForEachDirection(
            of="law_inputs", steps=(*LAW_CHANGE, Add(to="law.slopes", source=D + "local.tau"))
        ),
    ),
)

TANGENT_OWN = Pass(
    "tangent_own", "body", "Derivatives of a body's own load by its motion and its modes.",
    (
        Copy(to="tangent.laws", when="laws"),
        RunPass(whole=INCREMENT_MATRIX, when="curved"),
        *position_dependent_loads.BEGUN,
        call("body.load_by_motion", when="!modal", p="body.p", motion="body.motion",
             J="tangent.S"),
        *only(
            "modal",
            ForEachDirection(
                of="motion",
                steps=(
                    RunPass(whole=differentiate_pass(MODAL_OWN)),
                    position_dependent_loads.DRAG_DERIVATIVE,
                    Move(to="tangent.S[6 * c]", source=D + "body.e", count="6"),
                    Move(to="bend.Z_z[n * c]", source=D + "modes.e_f", count="n"),
                ),
            ),
            ForEachDirection(
                of="modes",
                steps=(
                    RunPass(whole=differentiate_pass(MODAL_OWN)),
                    position_dependent_loads.DRAG_DERIVATIVE,
                    Move(to="bend.K[6 * c]", source=D + "body.e", count="6"),
                    Move(to="bend.Z_x[n * c]", source=D + "modes.e_f", count="n"),
                ),
            ),
        ),
        *position_dependent_loads.OWN_BY_PLACE,
        Copy(to="port.outboard_K", when="segment"),
        Copy(to="port.outboard_Z_z", when="segment"),
        Copy(to="port.outboard_Z_p", when="segment placed"),
        *only("modal !section", Copy(to="bend.B"), Copy(to="bend.G"), Copy(to="bend.W"),
              Copy(to="bend.zero_H")),
    ),
    skip="idle",
)  # fmt: skip


_OWN = {name: f"bend.{name}" for name in ("K", "Z_z", "Z_x")}
_NODE = {
    **{name: f"bend.{name}" for name in ("B", "G", "W", "V", "D", "right", "gain", "work")},
    **_OWN, "S": "tangent.S", "S_c": "local.S_c",
}  # fmt: skip
_PORT = {
    "Rc": "body.R", "r": "body.r", "H": "section.H", "B": "port.B", "G": "port.G", "W": "port.W",
    "S": "tangent.S", "T": "local.T", "K_x": "port.K",
}  # fmt: skip
_ROWS = {"K": "local.K", "right": "local.right"}
_CARRY_PORTS = {"Rc": "body.R", "r": "body.r", "w_I": "parent.w", "v": "hinge.v", "w": "hinge.w"}

#: Contribution of a body, linear in its unknowns, before elimination.
_COLUMNS = (
    *only("modal section", *_section_steps("bend")),
    *only("moving", *_HINGE),
    *only("outward", *_section_steps("port")),
)
_ELIMINATION_STEPS = (
    *position_dependent_loads.MODES_OWN_LOAD,
    call("tangent.node", n="modes", when="modal section", fails="tangent", H="section.H",
         **_NODE),
    call("tangent.node", n="modes", when="modal !section", fails="tangent", H="bend.zero_H",
         **_NODE),
    *only("modal", Copy(to="tangent.S", source="local.S_c")),
    *position_dependent_loads.MODES_REDUCED,
    *position_dependent_loads.HINGE_ROWS,
    *only(
        "moving",
        call("generic{free}.tangent_rows", H="tangent.H", B="tangent.B", W="tangent.W",
             S="tangent.S", **_ROWS, D="local.D", one="local.one"),
        call("tangent.invert", n="free", fails="tangent", D="local.D", one="local.one",
             inverse="tangent.inverse", work="local.work"),
        call("generic{free}.tangent_reduce", inverse="tangent.inverse", **_ROWS,
             G="tangent.G", gain="tangent.gain", V="tangent.V", S="tangent.S"),
    ),
    *position_dependent_loads.HINGE_REDUCED,
    call("frames.tangent_carry", **_CARRY_PORTS, S="tangent.S", T="local.T", S_I="inboard.S"),
    position_dependent_loads.CARRY_TO_PARENT,
    call("tangent.assemble_port", n="modes", when="outward !segment", **_PORT, **_OWN),
    call("tangent.assemble_port", n="modes", when="segment", **_PORT, K="inboard.K",
         Z_z="inboard.Z_z", Z_x="bend.Z_x"),
    call("tangent.carry_columns", n="modes", when="segment", **_CARRY_PORTS, H="section.H",
         B="port.B", K_o="port.outboard_K", Z_o="port.outboard_Z_z", K="inboard.K",
         Z_z="inboard.Z_z", Z_x="bend.Z_x"),
    *position_dependent_loads.PORT_ASSEMBLY,
)  # fmt: skip

TANGENT_CONDENSE = Pass(
    "tangent_condense", "body", "Unknowns of a body eliminated, the rest carried to the parent.",
    (*_COLUMNS, *_ELIMINATION_STEPS),
    order=TIPS_TO_ROOT, skip="omitted",
)  # fmt: skip

#: The same in two passes, for many tangents at one state: contributions are computed once.
TANGENT_CONTRIBUTIONS = Pass(
    "tangent_contributions", "body", "Contribution of a body to the elimination.", _COLUMNS,
    skip="omitted",
)  # fmt: skip
TANGENT_ELIMINATION = replace(
    TANGENT_CONDENSE, name="tangent_elimination",
    purpose="Unknowns of a body eliminated from its contribution.", steps=_ELIMINATION_STEPS,
)  # fmt: skip

_CONTRIBUTION_RUNS = (
    Run(whole=TANGENT_OWN),
    Run(whole=LAW_SLOPES),
    Run(whole=position_dependent_loads.LOADS_BY_PLACE, when="poses"),
    Run(whole=position_dependent_loads.FORCES_BY_PLACE, when="poses"),
)
TANGENT = Sweep(
    "tangent",
    "Tangent of inverse dynamics factored, after inverse dynamics itself.",
    (*_CONTRIBUTION_RUNS, Run(whole=TANGENT_CONDENSE)),
)
CONTRIBUTIONS = Sweep(
    "tangent_contributions",
    "Contributions to the tangent before elimination, after inverse dynamics.",
    (*_CONTRIBUTION_RUNS, Run(whole=TANGENT_CONTRIBUTIONS)),
)


# --- one right-hand side ------------------------------------------------------------------------

_MODAL_EFFORT_CHANGE = (
    call("modal.modal_effort", H="section.H", e=D + "body.e", e_f=D + "modes.e_f",
         tau=D + "modes.load_effort"),
    Copy(to=D + "modes.e_f", source=D + "modes.load_effort"),
)  # fmt: skip

_NO_LOAD = Copy(to=D + "body.e")
_RIGHT = Add(to=D + "modes.e_f", source="modes.column", times=-1)

TANGENT_COLUMN = Pass(
    "tangent_column", "body", "A right-hand side as loads of the rows.",
    (
        _NO_LOAD,
        Copy(to=D + "body.tau"),
        Add(to=D + "body.tau", source="body.column", times=-1),
        *only("modal", Copy(to=D + "modes.e_f"), _RIGHT),
    ),
)  # fmt: skip


def _modal_load_steps(subspace: str) -> tuple[Step, ...]:
    return (
        call("tangent.column_load", n="modes", H=subspace, V="bend.V", D="bend.D", e=D + "body.e",
             e_f=D + "modes.e_f", rest="bend.rest", y="bend.y", e_c="local.e_c",
             work="bend.work"),
        Copy(to=D + "body.e", source="local.e_c"),
    )  # fmt: skip


_LOAD_PORTS = {
    "Rc": "body.R", "r": "body.r", "H": "tangent.H", "V": "tangent.V",
    "inverse": "tangent.inverse", "e": D + "body.e", "e_f": "local.rows", "y": "tangent.y",
    "e_I": D + "parent.e",
}  # fmt: skip
_LOAD_TRANSPORT = call("frames.transport", when="!moving", Rc="body.R", r="body.r", e=D + "body.e",
                       e_I=D + "parent.e")  # fmt: skip

TANGENT_BACKWARD = Pass(
    "tangent_backward", "body", "Loads of a right-hand side carried to the parent.",
    (
        *only("modal section", *_modal_load_steps("section.H")),
        *only("modal !section", *_modal_load_steps("bend.zero_H")),
        *only("outward", *_MODAL_EFFORT_CHANGE),
        *only(
            "moving",
            SelectColumns(to="local.rows", source=D + "body.tau"),
            call("generic{free}.tangent_load", **_LOAD_PORTS),
        ),
        _LOAD_TRANSPORT,
    ),
    order=TIPS_TO_ROOT, skip="omitted",
)  # fmt: skip

_STORE_MOTION = Copy(to=D + "body.motion", source="local.z")
_OUTBOARD_MOTION_PORTS = _CARRY_PORTS | {"z_I": D + "parent.motion", "z": D + "body.motion"}
_SOLUTION_PORTS = _OUTBOARD_MOTION_PORTS | {
    "B": "tangent.B",
    "gain": "tangent.gain",
    "y": "tangent.y",
    "x": "local.x",
}
_STORE_SOLUTION = ScatterSpeeds(to="body.answer", free="local.x")


def _motion_with_modes(*known_steps: Step) -> tuple[Step, ...]:
    """Motion outboard of a body's own modes, or of those of the body that it is an end of."""
    return (
        call("frames.tangent_motion", when="!moving", **_OUTBOARD_MOTION_PORTS),
        *known_steps,
        call("tangent.port_motion", n="modes", when="outward", B="port.B", x="modes.answer",
             z_c=D + "body.motion", z="local.z"),
        *only("outward", _STORE_MOTION),
        *position_dependent_loads.PORT_DISPLACED,
        *position_dependent_loads.MODES_REMAINDER,
        *only(
            "modal",
            call("tangent.column_solution", n="modes", B="bend.B", gain="bend.gain", y="bend.y",
                 z_c=D + "body.motion", x="modes.answer", z="local.z"),
            _STORE_MOTION,
        ),
        *position_dependent_loads.MODES_DISPLACED,
    )  # fmt: skip


TANGENT_FORWARD = Pass(
    "tangent_forward", "body", "Solution for a right-hand side.",
    (
        Copy(to="body.answer"),
        position_dependent_loads.POSITION_CHANGE,
        *position_dependent_loads.HINGE_REMAINDER,
        *only("moving", call("generic{free}.tangent_solution", **_SOLUTION_PORTS), _STORE_SOLUTION),
        *position_dependent_loads.HINGE_DISPLACED,
        *_motion_with_modes(),
    ),
    skip="omitted",
)  # fmt: skip

TANGENT_SOLUTION = Sweep(
    "tangent_solution",
    "One right-hand side solved with the factored tangent.",
    (
        Run(whole=TANGENT_COLUMN),
        Run(hook="unit_load", when="unit_load"),
        Run(whole=TANGENT_BACKWARD),
        Run(whole=TANGENT_FORWARD),
    ),
)


# --- one right-hand side, and increments that are known -----------------------------------------

INCREMENT_COLUMN = Pass(
    "increment_column",
    "body",
    "A right-hand side, with own loads due to known modal increments.",
    (
        _NO_LOAD,
        Copy(to=D + "body.tau", source="body.column"),
        *only(
            "modal",
            Copy(to=D + "body.motion"),
            Copy(to=D + "body.v"),
            RunPass(whole=differentiate_pass(MODAL_OWN)),
            position_dependent_loads.DRAG_DERIVATIVE,
            _RIGHT,
        ),
    ),
)

INCREMENT_LAWS = Pass(
    "increment_laws", "law", "Change of the efforts of a law due to known increments of its hinge.",
    (*LAW_CHANGE, Add(to=D + "law.tau", source=D + "local.tau")),
)  # fmt: skip

_KNOWN = call("frames.tangent_known_load", S="tangent.S", b="tangent.known", g="local.G",
              e_S="local.row_load", e_b="local.known")  # fmt: skip
_KNOWN_ROWS = (
    *_mode_steps("tangent.known", "local.G", "place.known"),
    Copy(to=D + "modes.e_f", source=D + "modes.load_effort"),
)
#: Rows of the stations outboard of a segment, whose modes are not eliminated yet.
_KNOWN_OUTBOARD_ROWS = (
    call("tangent.outboard_rows", n="modes", when="segment", Z_o="port.outboard_Z_z",
         b="tangent.known", e_f=D + "modes.e_f"),
    call("tangent.outboard_rows", n="modes", when="segment placed", Z_o="port.outboard_Z_p",
         b="place.known", e_f=D + "modes.e_f"),
)  # fmt: skip
_KNOWN_LOAD = Add(to=D + "body.e", source="local.known")

#: Rows of a hinge: carried load by the known increments, less the right-hand side and the change of
#: laws, which INCREMENT_COLUMN and INCREMENT_LAWS add.
INCREMENT_BACKWARD = Pass(
    "increment_backward", "body", "The same loads carried to the parent, with known increments.",
    (
        *only("section", _CARRIER, *_KNOWN_ROWS),
        *only("modal section", *_modal_load_steps("section.H")),
        *only("modal !section", *_modal_load_steps("bend.zero_H")),
        *only("section", _KNOWN, position_dependent_loads.KNOWN_LOAD),
        *_KNOWN_OUTBOARD_ROWS,
        *only("outward", Add(to=D + "body.e", source="local.row_load"), *_MODAL_EFFORT_CHANGE,
              Add(to=D + "body.e", source="local.G")),
        *only("modal section", _KNOWN_LOAD),
        *only(
            "moving",
            _CARRIER,
            *_hinge_steps("tangent.known", "local.G", "place.known", D + "body.tau"),
            SelectColumns(to="local.rows", source="local.change"),
            _KNOWN,
            position_dependent_loads.KNOWN_LOAD,
            call("generic{free}.tangent_load_with_increments", **_LOAD_PORTS, e_b="local.known"),
        ),
        _LOAD_TRANSPORT,
    ),
    order=TIPS_TO_ROOT, skip="omitted",
)  # fmt: skip

INCREMENT_FORWARD = Pass(
    "increment_forward", "body", "Solution for a right-hand side with known increments.",
    (
        Copy(to="body.answer"),
        position_dependent_loads.POSITION_CHANGE,
        *only("moving placed", position_dependent_loads.KNOWN_POSITION_CHANGE),
        *position_dependent_loads.HINGE_REMAINDER,
        *only("moving",
              call("generic{free}.tangent_solution_with_increments", **_SOLUTION_PORTS,
                   b="tangent.known"),
              _STORE_SOLUTION),
        *position_dependent_loads.HINGE_DISPLACED,
        *_motion_with_modes(
            Add(to=D + "body.motion", source="tangent.known", when="section"),
            *only("section placed", position_dependent_loads.KNOWN_POSITION_CHANGE),
        ),
    ),
    skip="omitted",
)  # fmt: skip

TANGENT_WITH_INCREMENTS = Sweep(
    "tangent_with_increments",
    "One right-hand side solved with the factored tangent and known increments.",
    (
        Run(whole=INCREMENT_COLUMN),
        Run(whole=INCREMENT_LAWS),
        Run(whole=INCREMENT_BACKWARD),
        Run(whole=INCREMENT_FORWARD),
    ),
)
