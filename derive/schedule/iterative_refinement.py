"""An answer refined: its accelerations are the bias motion, and what they leave over is answered.

That is inverse dynamics of the answer, which eliminates nothing, as right-hand side of the same
sweep: heavy bodies behind light ones cost digits of the change alone.
"""

from __future__ import annotations

from dataclasses import replace

from .pass_steps import Add, Copy, EachSpeed, Pass, call

RESTATED = Pass(
    "restated", "body", "Efforts without what rotors take of the accelerations in the answer.",
    (
        EachSpeed(
            steps=(
                call("frames.driven_effort", felt="zero", J="body.rotor[k]", udot="body.s[k]",
                     tau="body.tau[k]", tau_d="local.lack"),
                Copy(to="body.tau[k]"),
                Add(to="body.tau[k]", source="local.lack", times=-1),
            ),
        ),
        # Nobody asks them of speeds that are imposed.
        EachSpeed(
            steps=(
                call("frames.driven_effort", felt="zero", J="body.rotor[k]", udot="body.s[k]",
                     tau="zero", tau_d="local.rotor"),
                Add(to="body.tau[k]", source="local.rotor"),
            ),
            imposed=True, when="imposed",
        ),
    ),
    skip="cut",
)  # fmt: skip

#: Of a tree, in which nothing is cut.
RESTATED_OF_TREE = replace(RESTATED, name="restated_of_tree", skip="")
