"""Efforts and laws on speeds, loads and force elements on bodies, and their power."""

from __future__ import annotations

from .pass_steps import Add, Copy, EachSpeed, Evaluate, Gather, Pass, Step, call

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
