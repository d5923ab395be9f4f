"""Names of quantities of flexible bodies: "blade.strain_energy", "blade.tip.deflection.y".

They complement the names that every body and end has.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

from mstmm.scene import split_reference

from ...engine.quantity_registry import QuantityKind

if TYPE_CHECKING:
    from ..quantity_names import Table
    from .quantities import FlexibleResults


_XYZ = ("x", "y", "z")

#: For every body: unit, long name, columns, and the method of `Result` that returns it.
BODY_QUANTITIES = {
    "momentum": (QuantityKind("kg*m/s", "linear momentum", _XYZ, ()), "body_momentum"),
    "angular_momentum": (
        QuantityKind("kg*m2/s", "angular momentum about the mass centre", _XYZ, ()),
        "body_angular_momentum",
    ),
    "center_of_mass": (
        QuantityKind("m", "position of the mass centre", _XYZ, ()),
        "center_of_mass",
    ),
    "equivalent_velocity": (
        QuantityKind("m/s", "velocity of a rigid body of the same momentum", _XYZ, ()),
        "equivalent_velocity",
    ),
    "equivalent_spin": (
        QuantityKind("rad/s", "spin of a rigid body of the same angular momentum", _XYZ, ()),
        "equivalent_angular_velocity",
    ),
}

#: At the ends of beams, in frame or section axes.
END_QUANTITIES = {
    "deflection": (QuantityKind("m", "elastic displacement, frame axes", _XYZ, ()), "deflection"),
    "slope": (QuantityKind("", "slope relative to the frame along", ("y", "z"), ()), "slope"),
    "section_force": (
        QuantityKind("N", "force of the outboard part, section axes", _XYZ, ()), "section_force",
    ),
    "section_moment": (
        QuantityKind("N*m", "moment of the outboard part, section axes", _XYZ, ()),
        "section_moment",
    ),
}  # fmt: skip

#: Only these are written into files for every end; the others take longer to compute than all other
#: quantities together.
LISTED_END_QUANTITIES = ("deflection",)


def add_body_quantities(table: Table, results: FlexibleResults, reference: str) -> None:
    """Add the names of a body or an end after those common to all."""
    body, end = split_reference(reference)
    flexible = results.model.flexible_bodies.get(body)
    if end:
        if flexible is not None and flexible.shapes is not None:
            _add_end_quantities(table, results, body, end)
        return
    for name, (kind, method) in BODY_QUANTITIES.items():
        get = partial(getattr(results, method), body)
        table.vector(f"{body}.{name}", body, kind, get, listed=flexible is not None)
    if flexible is None:
        return
    modes = QuantityKind(
        "J", "energy by modes, strain and motion against the frame", flexible.modes, ()
    )
    table.vector(f"{body}.modal_energy", body, modes, partial(results.modal_energy, body))
    table.scalar(
        f"{body}.strain_energy", "J", "strain energy", partial(results.strain_energy, body),
        owner=body,
    )  # fmt: skip


def _add_end_quantities(table: Table, results: FlexibleResults, body: str, end: str) -> None:
    for name, (kind, method) in END_QUANTITIES.items():
        get: Callable[[], Any] = partial(getattr(results, method), body, end)
        owner, is_listed = f"{body}.{end}", name in LISTED_END_QUANTITIES
        table.vector(f"{owner}.{name}", owner, kind, get, listed=is_listed)
