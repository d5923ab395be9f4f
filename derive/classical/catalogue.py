"""Catalogue of the classical transfer matrices and their guards.

`CLASSICAL` contains all of them, including those of the discrete-time form; `classical_guards` are
the pivot guards for lowering.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial

import sympy as sp

from mstmm.ir.element_spec import ElementSpec

from ..definition.derivation import Derivation
from ..lower.kernel_lowering import lower
from . import acceleration_hinge, ball_hinge, body_planar, body_spatial, pin_planar, pin_spatial
from .discrete import body as flexible_body
from .discrete import hinge as flexible_joint
from .discrete import spring_hinges as flexible_spring
from .discrete.body_options import PLANE, SPACE, BodyStatement
from .discrete.hinge import named_pairing
from .hinge_relation import pivot_guards

# --- discrete-time form ---------------------------------------------------------------------------
# The number of modes is a parameter of every derivation; generated are three, two and one for the
# planar beam (three as printed: 10 x 10), one per bending plane for the spatial one (15 x 15), and
# as many for the adjacent hinges.

#: Modes of the beams adjacent to the generated hinges.
PLANAR_MODES, SPATIAL_MODES = 3, 2

_BENDING = (
    "Bending across the straight axis alone: no axial motion, no shear, no rotary inertia of the "
    "sections in bending; their inertia about the input end is in {}.",
)

BODIES = (
    BodyStatement(
        "body_planar_discrete", "planar rigid body, discrete-time classical matrix",
        PLANE, "rigid", 0, "ch. 7 with (8.63), (8.65)", "(8.65)",
    ),
    *(
        BodyStatement(
            f"beam_planar_discrete{suffix}",
            f"planar beam of Euler and Bernoulli with {modes} mode{'s' * (modes > 1)}, "
            "discrete-time classical matrix",
            PLANE, "beam", modes, "(8.63) to (8.89)", "(8.89)", "", (_BENDING[0].format("I_0"),),
        )
        for modes, suffix in ((3, ""), (2, "_2"), (1, "_1"))
    ),
    BodyStatement(
        "elastic_planar_discrete",
        "planar elastic body with two shapes, discrete-time classical matrix",
        PLANE, "elastic", 2, "(8.20) to (8.24), (8.33) to (8.40), (8.65)", "(8.65)",
    ),
    BodyStatement(
        "body_spatial_discrete", "spatial rigid body, discrete-time classical matrix",
        SPACE, "rigid", 0, "ch. 7 with (8.64), (8.65)", "(8.65)",
    ),
    BodyStatement(
        "beam_spatial_discrete",
        "spatial beam of Euler and Bernoulli, a mode per bending plane, "
        "discrete-time classical matrix",
        SPACE, "beam", 2, "(8.140) to (8.186)", "(8.186)", "yz", (_BENDING[0].format("J_0"),),
    ),
    BodyStatement(
        "elastic_spatial_discrete",
        "spatial elastic body with one shape, discrete-time classical matrix",
        SPACE, "elastic", 1, "(8.20) to (8.24), (8.57) to (8.62), (8.65)", "(8.65)",
    ),
)  # fmt: skip

Maker = Callable[..., Derivation]

#: Name -> maker, plane or space, and by pairing (sources, equation of the matrix).
HINGES: dict[str, tuple[Maker, bool, dict[str, tuple[str, str]]]] = {
    "hinge_fixed_planar": (
        partial(flexible_joint.fixed_hinge, number="(8.130)"), True,
        {
            "rigid_rigid": ("section 8.7", "section 8.7"),
            "rigid_beam": ("section 8.7, (8.130) to (8.137)", "(8.137)"),
            "beam_beam": ("section 8.7, (8.130) to (8.135)", "(8.135)"),
            "beam_rigid": ("section 8.7, (8.138), (8.139)", "(8.139)"),
        },
    ),
    "hinge_smooth_planar": (
        partial(flexible_joint.smooth_hinge, number="(8.94), (8.95)"), True,
        {
            "rigid_rigid": ("section 8.5, (7.219), (8.102)", "(7.219)"),
            "rigid_beam": ("section 8.5, (8.90) to (8.101)", "(8.101)"),
            "beam_beam": ("section 8.5, (8.90) to (8.98)", "(8.98)"),
            "beam_rigid": ("section 8.5, (8.103) to (8.105)", "(8.105)"),
        },
    ),
    "hinge_spring_planar": (
        flexible_spring.planar_spring, True,
        {
            "rigid_rigid": ("section 8.6, (8.106) to (8.111); section 7.6", "section 7.6"),
            "rigid_beam": ("section 8.6, (8.122) to (8.125)", "(8.125)"),
            "beam_beam": ("section 8.6, (8.106) to (8.121)", "(8.121)"),
            "beam_rigid": ("section 8.6, (8.126) to (8.129)", "(8.129)"),
        },
    ),
    "hinge_fixed_spatial": (
        partial(flexible_joint.fixed_hinge, number="(8.194) to (8.196)"), False,
        {
            "rigid_rigid": ("section 8.10", "section 8.10"),
            "rigid_beam": ("section 8.10, (8.187) to (8.193)", "(8.193)"),
            "beam_beam": ("section 8.10, (8.194) to (8.199)", "(8.199)"),
            "beam_rigid": ("section 8.10, (8.200), (8.201)", "(8.201)"),
        },
    ),
    "hinge_ball_spatial": (
        partial(flexible_joint.smooth_hinge, number="(8.203)"), False,
        {
            "rigid_rigid": ("section 8.11", "section 8.11"),
            "rigid_beam": ("section 8.11, (8.202) to (8.207)", "(8.207)"),
            "beam_beam": ("section 8.11, (8.208), (8.209)", "(8.209)"),
            "beam_rigid": ("section 8.11, (8.210), (8.211)", "(8.211)"),
        },
    ),
    "hinge_pin_spatial": (
        partial(flexible_joint.pin_hinge, number="cf. (8.203)"), False,
        {
            "rigid_rigid": ("section 8.11 with one axis free", "cf. section 8.11"),
            "rigid_beam": ("(8.202) to (8.207) with one axis free", "cf. (8.207)"),
            "beam_beam": ("(8.208), (8.209) with one axis free", "cf. (8.209)"),
            "beam_rigid": ("(8.210), (8.211) with one axis free", "cf. (8.211)"),
        },
    ),
    "hinge_elastic_spatial": (
        flexible_spring.spatial_spring, False,
        {
            "rigid_rigid": ("section 8.12, (8.212) to (8.216)", "section 8.12"),
            "rigid_beam": ("section 8.12, (8.228), (8.229)", "(8.229)"),
            "beam_beam": ("section 8.12, (8.212) to (8.227)", "(8.227)"),
            "beam_rigid": ("section 8.12, (8.230), (8.231)", "(8.231)"),
        },
    ),
}  # fmt: skip


def _hinge_derivation(name: str, which: str) -> Derivation:
    make_derivation, planar, numbers = HINGES[name]
    pair = named_pairing(
        PLANE if planar else SPACE, which, PLANAR_MODES if planar else SPATIAL_MODES
    )
    return make_derivation(pair, f"{name}_{which}", *numbers[which])


#: Name -> derivation, cached.
DISCRETE_DERIVATIONS: dict[str, Callable[[], Derivation]] = {
    **{body.element: cache(partial(flexible_body.derivation, body)) for body in BODIES},
    **{
        f"{name}_{which}": cache(partial(_hinge_derivation, name, which))
        for name, (_, _, numbers) in HINGES.items()
        for which in numbers
    },
}

#: Elements of the discrete-time method: rigid bodies and beams with the largest number of modes (a
#: beam with fewer modes leaves some unused), and every hinge.
STEPPING_ELEMENTS = (
    "body_planar_discrete", "beam_planar_discrete", "body_spatial_discrete",
    "beam_spatial_discrete",
    *(f"{name}_{which}" for name, (_, _, numbers) in HINGES.items() for which in numbers),
)  # fmt: skip


# --- all matrices ---------------------------------------------------------------------------------


def _planar_acceleration() -> Derivation:
    return acceleration_hinge.derivation(acceleration_hinge.PLANAR_DIRECTIONS, planar=True)


#: Name -> derivation of the classical elements.
CLASSICAL: dict[str, Callable[[], Derivation]] = {
    "body_planar": body_planar.derivation,
    "body_spatial": body_spatial.derivation,
    "pin_planar": pin_planar.derivation,
    "ball": ball_hinge.derivation,
    "pin_spatial": pin_spatial.derivation,
    "acceleration": acceleration_hinge.derivation,
    "acceleration_planar": _planar_acceleration,
    **DISCRETE_DERIVATIONS,
}

#: Elements whose matrices a run multiplies, for `sweep = "product"` and for the discrete-time
#: method.  They are generated and compiled; the others are derived on demand.
RUN_ELEMENTS = ("body_spatial", "pin_spatial", "ball", "acceleration", *STEPPING_ELEMENTS)


def classical_guards(derivation: Derivation) -> tuple[tuple[sp.Basic, int, str], ...]:
    """Guards of a classical element: the pivot's for a hinge, none for a body."""
    has_margin = any(quantity.name == "margin" for quantity in derivation.outputs)
    return pivot_guards(derivation) if has_margin else ()


@cache
def classical_derivation(name: str) -> Derivation:
    """Derivation of the classical matrix `name`, cached in the process."""
    return CLASSICAL[name]()


def classical_spec(name: str) -> ElementSpec:
    """ElementSpec of a classical element: one kernel, `transfer`."""
    derivation = classical_derivation(name)
    kernel = lower(derivation, "transfer", classical_guards(derivation))
    return ElementSpec(
        "classical", name, derivation.title, (), (), (), (kernel,), derivation.sources
    )
