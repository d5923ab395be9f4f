"""Couplings of coordinates: start of their rows, and efforts of their multipliers.

A row starts at each hinge that it names.  For a hinge of the tree its column is zero there, and -C
is the effort of a unit multiplier; a hinge that closes a loop takes its speeds from the two bodies
that it connects.  See docs/explanation/closed-loops.md.
"""

from __future__ import annotations

from dataclasses import replace

from .pass_steps import Add, EachSpeed, ForEach, Pass, Step, call, only

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
