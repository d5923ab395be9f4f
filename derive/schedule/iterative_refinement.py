"""Iterative refinement: a second solution for the residual of the first.

The accelerations of the first solution are the bias motion.  Their inverse dynamics, which
eliminates nothing, is the right-hand side of the same sweep: large mass ratios then only affect the
digits of the correction.
"""

from __future__ import annotations

from dataclasses import replace

from .pass_steps import Add, Copy, EachSpeed, Pass, call

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
