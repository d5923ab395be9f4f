"""Links: rigid bodies outboard of an axial or ball-like hinge, one kernel per pass.

The hinge moves about and along z, or rotates about a point.  Consecutive links are swept without
their workspace blocks: only what the next pass reads is stored, and S and e stay in registers or
local arrays from link to link.
"""

from __future__ import annotations

from .pass_steps import TIPS_TO_ROOT, Pass, call

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
