"""Approximate tangent: mass matrix with the derivatives of hinge laws.

Contributions of velocities and loads are omitted.  The matrix is symmetric and is factored and
solved like the mass matrix: by the same passes over separate slots, after inverse dynamics, whose
hinge motion is reused.  Unknowns are accelerations, with which speeds and coordinates change in
proportion.  A law on several speeds contributes the symmetric part of its derivatives; loads,
springs between bodies and geometric stiffness of flexible bodies are left out.  For iterations and
for methods that allow an approximate tangent.
"""

from __future__ import annotations

from .differentiated_passes import D
from .inverse_dynamics import COLUMN, COLUMN_BACKWARD, COLUMN_FORWARD, FACTORISE
from .pass_steps import (
    Add,
    Copy,
    ForEachDirection,
    Move,
    Pass,
    Run,
    RunPass,
    SelectColumns,
    Sweep,
    call,
    only,
    with_renamed_slots,
)
from .tangent_sweep import HINGE_CHANGE, INCREMENT_LAWS, LAW_CHANGE

#: Slot of the mass matrix -> slot of this tangent.
_SLOTS = {
    "body.S": "mass.S", "parent.S": "inboard.mass", "hinge.H_free": "tangent.H",
    "hinge.F": "mass.F", "hinge.G": "mass.G", "hinge.g": "tangent.y", "zero": "tangent.W",
    **{
        slot: D + slot
        for slot in (
            "body.e", "body.tau", "body.delta", "hinge.rates", "parent.e", "parent.delta",
            "modes.e_f", "modes.etadd", "modes.load_effort",
        )
    },
    **{f"modes.{name}": f"shapes.{name}" for name in ("S_rf", "S_rf_I", "S_ff", "right", "gain")},
    "modes.work": "bend.work", "section.push": "port.K", "section.S_rf": "port.S_rf",
    "inboard.S_rf": "inboard.shapes_S_rf",
}  # fmt: skip
_NAME = "laws"

LAWS_OWN = Pass(
    "laws_own", "body", "Inertia of a body, and its modes within a step.",
    (
        call("body.inertia", when="!modal", p="body.p", S="mass.S"),
        Copy(to="mass.S", source="body.S", when="modal"),
        call("frames.pivot_floor", S="mass.S", floor="body.floor"),
        Copy(to="tangent.laws"),
        Copy(to="port.S_rf", when="segment"),
        *only(
            "modal",
            Copy(to="shapes.S_rf", source="modes.S_rf"),
            Copy(to="shapes.S_ff", source="modes.S_ff"),
            call("modal.step_stiffness", K="modes.K", D="modes.D", rate="step.rate", sq="step.q",
                 S_ff="shapes.S_ff"),
        ),
    ),
    skip="idle",
)  # fmt: skip

LAWS_RATES = Pass(
    "laws_rates", "body", "Derivatives of the coordinate rates by each speed.",
    (
        ForEachDirection(
            of="rates",
            steps=(
                RunPass(whole=HINGE_CHANGE),
                Move(to="tangent.along[nq * c]", source=D + "body.qdot", count="nq"),
            ),
        ),
    ),
    skip="!curved",
)  # fmt: skip

LAWS_OWN_SLOPES = Pass(
    "laws_own_slopes",
    "law",
    "Derivatives of a law along the unknowns of its speeds.",
    (
        ForEachDirection(
            of="law", steps=(*LAW_CHANGE, Add(to="law.own_slopes", source=D + "local.tau"))
        ),
    ),
)

_factorise = with_renamed_slots(FACTORISE, _NAME, _SLOTS)
LAWS_FACTORISE = Pass(
    _factorise.name, "body", "Mass matrices with laws carried to the root.",
    (
        SelectColumns(to="tangent.W", source="tangent.laws", rows=0),
        # Inverse dynamics has left the motion of hinges.
        *(step for step in _factorise.steps if step.when != "own"),
    ),
    order=FACTORISE.order, skip=FACTORISE.skip,
)  # fmt: skip

APPROXIMATE_TANGENT = Sweep(
    "approximate_tangent",
    "Mass matrix and derivatives of laws factored, after inverse dynamics.",
    (
        Run(whole=LAWS_OWN),
        Run(whole=LAWS_RATES, when="laws"),
        Run(whole=LAWS_OWN_SLOPES, when="laws"),
        Run(whole=LAWS_FACTORISE),
    ),
)

# --- one right-hand side ------------------------------------------------------------------------

MODES_CHANGE = Pass(
    "modes_change", "body", "Change of the modal loads due to known increments.",
    (
        call("modal.strain_load", K="modes.K", D="modes.D", eta=D + "modes.eta",
             etad=D + "modes.etad", e_f=D + "modes.e_f"),
    ),
    skip="!modal",
)  # fmt: skip

APPROXIMATE_SOLUTION = Sweep(
    "approximate_solution",
    "One right-hand side solved with the mass matrix and laws.",
    (
        Run(whole=with_renamed_slots(COLUMN, _NAME, _SLOTS)),
        Run(whole=INCREMENT_LAWS, when="shifted laws"),
        Run(whole=MODES_CHANGE, when="shifted flexible"),
        Run(whole=with_renamed_slots(COLUMN_BACKWARD, _NAME, _SLOTS)),
        Run(whole=with_renamed_slots(COLUMN_FORWARD, _NAME, _SLOTS)),
    ),
)

RATES_CHANGE = Pass(
    "rates_change", "body", "Change of the rates of a hinge by that of its coordinates and speeds.",
    (
        RunPass(whole=HINGE_CHANGE),
        Copy(to="body.change", source=D + "body.qdot"),
        Add(to="body.change", source="body.rho"),
    ),
)  # fmt: skip
