"""Catalogue of the classical transfer matrices and their guards.

`CLASSICAL` contains all of them, including those of the discrete-time form; `classical_guards` are
the pivot guards for lowering.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import sympy as sp

from mstmm.ir.element_spec import ElementSpec

from ..definition.derivation import Derivation
from ..lower.kernel_lowering import lower
from . import acceleration_hinge, ball_hinge, body_planar, body_spatial, pin_planar, pin_spatial
from .discrete.catalogue import DISCRETE_DERIVATIONS, STEPPING_ELEMENTS
from .hinge_relation import pivot_guards


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
