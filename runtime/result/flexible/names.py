"""Names of quantities of flexible bodies: "blade.strain_energy", "blade.tip.deflection.y".

They complement the names that every body and end has.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

from mstmm.scene import split

from ...engine.shown import Kind

if TYPE_CHECKING:
    from ..names import Table
    from .quantities import FlexibleResults


_XYZ = ("x", "y", "z")

#: Of any body: unit, long name, columns, and the method of `Result` that gives it.
OF_BODY = {
    "momentum": (Kind("kg*m/s", "linear momentum", _XYZ, ()), "momentum_of"),
    "angular_momentum": (
        Kind("kg*m2/s", "angular momentum about the mass centre", _XYZ, ()), "angular_momentum_of",
    ),
    "center_of_mass": (Kind("m", "position of the mass centre", _XYZ, ()), "center_of_mass"),
    "equivalent_velocity": (
        Kind("m/s", "velocity of a rigid body of the same momentum", _XYZ, ()),
        "equivalent_velocity",
    ),
    "equivalent_spin": (
        Kind("rad/s", "spin of a rigid body of the same angular momentum", _XYZ, ()),
        "equivalent_spin",
    ),
}  # fmt: skip

#: At the ends of beams, in axes of the frame or of the section.
AT_END = {
    "deflection": (Kind("m", "elastic displacement, frame axes", _XYZ, ()), "deflection"),
    "slope": (Kind("", "slope against the frame along", ("y", "z"), ()), "slope"),
    "section_force": (
        Kind("N", "force of the part beyond, section axes", _XYZ, ()), "section_force",
    ),
    "section_moment": (
        Kind("N*m", "moment of the part beyond, section axes", _XYZ, ()), "section_moment",
    ),
}  # fmt: skip

#: Of these only the first is written into files for every end: the others take longer to compute
#: than everything else together.
LISTED = ("deflection",)


def add_body(table: Table, results: FlexibleResults, reference: str) -> None:
    """Names of a body or an end, behind those that all have."""
    body, end = split(reference)
    flexible = results.model.flexible.get(body)
    if end:
        if flexible is not None and flexible.shapes is not None:
            _at_end(table, results, body, end)
        return
    for name, (about, method) in OF_BODY.items():
        get = partial(getattr(results, method), body)
        table.vector(f"{body}.{name}", body, about, get, listed=flexible is not None)
    if flexible is None:
        return
    modes = Kind("J", "energy by modes, strain and motion against the frame", flexible.modes, ())
    table.vector(f"{body}.modal_energy", body, modes, partial(results.modal_energy, body))
    table.scalar(
        f"{body}.strain_energy", "J", "strain energy", partial(results.strain_energy, body),
        owner=body,
    )  # fmt: skip


def _at_end(table: Table, results: FlexibleResults, body: str, end: str) -> None:
    for name, (about, method) in AT_END.items():
        get: Callable[[], Any] = partial(getattr(results, method), body, end)
        owner, listed = f"{body}.{end}", name in LISTED
        table.vector(f"{owner}.{name}", owner, about, get, listed=listed)
