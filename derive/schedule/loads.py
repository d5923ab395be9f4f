"""Efforts and laws on speeds, loads and force elements on bodies, and their power."""

from __future__ import annotations

from dataclasses import replace

from .pass_steps import Add, Copy, EachSpeed, Evaluate, ForEach, Gather, Pass, Step, call, only

EFFORTS = Pass(
    "efforts", "body", "Efforts of the caller, copied to the slots of the sweep.",
    (
        Copy(to="body.tau", source="body.efforts", when="efforts"),
        Copy(to="body.tau", when="!efforts"),
    ),
    spares_links="linked !laws",
)  # fmt: skip

EFFORTS_POWER = Pass(
    "efforts_power", "speed", "Power of the caller's efforts.",
    (
        call("frames.speed_power", tau="speed.effort", u="speed.u", P="local.P"),
        Add(to="sums.power", source="local.P"),
    ),
)  # fmt: skip

_LAW = {
    "p": "law.p", "q": "law.q", "u": "law.u", "effort": "local.effort", "tau": "local.tau",
    "V": "local.V", "P": "local.P",
}  # fmt: skip
_SUMS = (
    Add(to="sums.potential", source="local.V", when="balance"),
    Add(to="sums.power", source="local.P", when="balance"),
)

LAWS = Pass(
    "laws", "law", "Laws on hinge coordinates, added to the efforts.",
    (
        Gather(to="local.effort", places="law.effort"),
        call("law.coordinate", when="coordinate", **_LAW),
        call("law.quaternion", when="!coordinate", **_LAW, B="law.axes", twist_ref="law.turn"),
        Add(to="law.tau", source="local.tau"),
        *_SUMS,
    ),
)  # fmt: skip

LOADS = Pass(
    "loads", "load", "Force and moment at a point of a body, added to e.",
    (
        call("frames.end_frame", A="axes.A", R_end="load.axes_own", A_end="local.A_F"),
        Gather(to="local.F", places="load.force"),
        Gather(to="local.M", places="load.moment"),
        call("frames.applied_load", A="on.A", A_F="local.A_F", offset="load.offset", F="local.F",
             M="local.M", e="on.e"),
        call("frames.point", when="balance", A="on.A", x="on.x", v="on.v", motion="on.motion",
             delta="zero", offset="load.offset", gravity="zero", v_K="local.v"),
        call("frames.angular_motion", when="balance", A="on.A", motion="on.motion", delta="zero",
             w_K="local.w"),
        call("frames.power", when="balance", A_F="local.A_F", F="local.F", M="local.M",
             v_K="local.v", w_K="local.w", P="local.P"),
        Add(to="sums.power", source="local.P", when="balance"),
    ),
)  # fmt: skip


def _end(letter: str, on: str) -> tuple[Step, ...]:
    """Position, velocities and axes of one end of a force element, inertial axes."""
    return (
        call("frames.point", A=f"{on}.A", x=f"{on}.x", v=f"{on}.v", motion=f"{on}.motion",
             delta="zero", offset=f"force.offset_{letter}", gravity="zero",
             x_K=f"local.x_{letter}", v_K=f"local.v_{letter}"),
        call("frames.angular_motion", A=f"{on}.A", motion=f"{on}.motion", delta="zero",
             w_K=f"local.w_{letter}"),
        call("frames.end_frame", A=f"{on}.A", R_end=f"force.axes_{letter}",
             A_end=f"local.A_{letter}"),
    )  # fmt: skip


_ENDS = {f"{x}_{end}": f"local.{x}_{end}" for end in "FT" for x in "Axvw"}
_END_MOTIONS = {name: slot for name, slot in _ENDS.items() if name[0] in "xv"}

FORCES = Pass(
    "forces", "force", "Massless elements between two ends, added to e of both.",
    (
        *_end("F", "from"),
        *_end("T", "to"),
        Copy(to="local.effort"),
        call("frames.length", when="effort", **_END_MOTIONS, l="local.length"),
        Evaluate(to="local.effort", expression="force.effort", given=(("length", "local.length"),),
                 when="effort"),
        call("force.wrench", fails="force", p="force.p", t="scene.t", effort="local.effort",
             **_ENDS, F="local.F", M="local.M", V="local.V", P="local.P"),
        call("frames.reaction_wrench", x_F="local.x_F", x_T="local.x_T", F="local.F", M="local.M",
             F_back="local.F_back", M_back="local.M_back"),
        call("frames.applied_load", A="to.A", A_F="identity", offset="force.offset_T",
             F="local.F", M="local.M", e="to.e"),
        call("frames.applied_load", A="from.A", A_F="identity", offset="force.offset_F",
             F="local.F_back", M="local.M_back", e="from.e"),
        *_SUMS,
    ),
)  # fmt: skip

DRIVE_POWER = Pass(
    "drive_power", "body", "Power supplied by drives and locked hinges.",
    (
        call("frames.reaction", S="body.S", e="body.e", delta="body.delta", A="identity",
             f="local.f"),
        call("generic{nu}.effort", H="hinge.H", f="local.f", tau="local.tau"),
        EachSpeed(
            steps=(
                call("frames.driven_effort", load="local.tau[k]", J="body.rotor[k]",
                     udot="body.udot[k]", tau="body.tau[k]", tau_d="local.driven"),
                call("frames.speed_power", tau="local.driven", u="body.u[k]", P="local.P"),
                Add(to="sums.power", source="local.P"),
            ),
            imposed=True,
        ),
    ),
    skip="!imposed",
)  # fmt: skip


# --- couplings of coordinates ---------------------------------------------------------------------
# A row starts at each hinge that it names.  For a hinge of the tree its column is zero there, and
# -C is the effort of a unit multiplier; a hinge that closes a loop takes its speeds from the two
# bodies that it connects.  See docs/explanation/closed-loops.md.

#: Contribution of the accelerations of a tree hinge to the rows that name it.
EFFORTS_TO_KNOWN = call(
    "generic{nu}.add_known_part", when="coupled", y="body.s", z="pending.tau", l="pending.known"
)
#: The same for the accelerations chosen in the bias motion.
BIAS_EFFORTS_TO_KNOWN = replace(
    EFFORTS_TO_KNOWN,
    ports=(("y", "body.bias_offset"), ("z", "pending.tau"), ("l", "pending.known")),
)
#: The same for a hinge that closes a loop: accelerations along its rows, and prescribed ones.
_OWN_ROW_TERMS = (
    call("generic{nu}.add_known_part", y="closure.l", z="own.tau", l="own.known"),
    call("generic{nu}.add_known_part", y="body.s", z="own.tau", l="own.known"),
)
#: Rows of couplings on a hinge's own speeds start on both sides of it.
OWN_COUPLINGS = ForEach(
    of="own",
    steps=(
        EachSpeed(
            steps=(
                call("loops.apply_effort", J="closure.J_A[6 * k]", tau="own.tau[k]", e="own.inner"),
                call("loops.apply_effort", J="closure.J_B[6 * k]", tau="own.tau[k]", e="own.outer"),
            ),
        ),
        *_OWN_ROW_TERMS,
    ),
)  # fmt: skip
#: Additional contribution where the bias motion chooses accelerations.
OWN_COUPLINGS_BIAS = ForEach(
    of="own",
    when="staged !corrected",
    steps=(call("generic{nu}.add_known_part", y="body.bias_offset", z="own.tau", l="own.known"),),
)
#: The same with known multipliers.
OWN_EFFORTS_TO_KNOWN = ForEach(of="own", steps=_OWN_ROW_TERMS)


def efforts_of_own(x: str, when: str) -> ForEach:
    """Efforts of couplings on own speeds, from their multipliers."""
    effort_call = call("generic{nu}.add_multiplier_effort", y="own.tau", x=x, y_0="body.tau")
    return ForEach(of="own", when=when, steps=(effort_call,))


def efforts_of(x: str, when: str, *more: Step) -> ForEach:
    """Efforts of the couplings of a tree hinge, from their multipliers."""
    effort_call = call("generic{nu}.add_multiplier_effort", when="coupled", y="pending.tau", x=x,
                       y_0="body.tau")  # fmt: skip
    return ForEach(of="pending", when=when, steps=(effort_call, *more))


#: Multipliers are known from an earlier evaluation of accelerations in this workspace.
COUPLING_LOADS = Pass(
    "coupling_loads", "body",
    "Rows of couplings at the given accelerations, and the efforts of their multipliers.",
    (efforts_of("pending.x", "", EFFORTS_TO_KNOWN),),
    skip="omitted",
)  # fmt: skip

COUPLING_MULTIPLIERS = Pass(
    "coupling_multipliers", "coupling",
    "Multipliers of couplings, and the power supplied by time-dependent couplings.",
    (
        Add(to="coupling.x", source="coupling.previous_x", when="refined"),
        *only(
            "balance",
            call("frames.speed_power", tau="coupling.x", u="coupling.time_rate", P="local.P"),
            Add(to="sums.power", source="local.P"),
        ),
    ),
    skip="redundant",
)  # fmt: skip
