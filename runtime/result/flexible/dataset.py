"""Variables of flexible bodies in a Dataset: energies, motions and shape functions.

The shape functions give the deflection anywhere along a beam from the modal coordinates in q.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .flexible_quantity_names import BODY_QUANTITIES

if TYPE_CHECKING:
    from ...flexible.modal_body import ModalBody
    from ..result_record import Record

Variable = tuple[tuple[str, ...], Any, dict[str, str]]

#: Stations along a beam at which its shape functions are written.
STATION_COUNT = 41

#: Largest number of flexible bodies whose shape functions are written; for more, use the scene in
#: the file.
_MAX_WRITTEN_BODIES = 40


def labels(result: Record) -> dict[str, tuple[str, list[str], str]]:
    """Map from name to (dimension, labels, long name)."""
    bodies = result.model.flexible_bodies
    if not bodies:
        return {}
    modes = [f"{name}.{mode}" for name, body in bodies.items() for mode in body.modes]
    return {
        "flexible": ("flexible", list(bodies), "flexible body"),
        "mode": ("mode", modes, "modal coordinate, as in coordinate"),
    }


def variables(result: Record) -> dict[str, Variable]:
    """Modal energies, equivalent motions of flexible bodies, and shape functions of beams."""
    bodies = result.model.flexible_bodies
    if not bodies:
        return {}
    dataset_variables: dict[str, Variable] = {
        "modal_energy": (
            ("time", "mode"),
            np.concatenate([result.modal_energy(name) for name in bodies], axis=1),
            _attributes("J", "strain energy of modes and kinetic energy relative to the frame"),
        ),
        "strain_energy": (
            ("time", "flexible"),
            np.stack([result.strain_energy(name) for name in bodies], axis=1),
            _attributes("J", "strain energy"),
        ),
    }
    for kind, (description, method) in BODY_QUANTITIES.items():
        values = np.stack([getattr(result, method)(name) for name in bodies], axis=1)
        label = _attributes(description.unit, f"{description.long_name}, inertial axes")
        dataset_variables[f"flexible_{kind}"] = (("time", "flexible", "axis"), values, label)
    if len(bodies) <= _MAX_WRITTEN_BODIES:
        for name, body in bodies.items():
            dataset_variables |= {} if body.shapes is None else _shape_variables(name, body)
    return dataset_variables


def _shape_variables(name: str, body: ModalBody) -> dict[str, Variable]:
    """Shape functions of a beam: deflection = phi eta - 1/2 eta^T second_order eta."""
    shapes = body.shapes
    assert shapes is not None
    x = np.linspace(0.0, shapes.length, STATION_COUNT)
    values, station, modes = shapes.values_at(x), f"{name}_x", f"{name}_mode"
    second_order = np.zeros((len(x), 3, body.n, body.n))
    if shapes.stiffening:
        second_order = shapes.second_order.field_at(x)[:, :3]
    words = np.array(body.modes, dtype=object)
    return {
        station: ((station,), x, _attributes("m", f"position along {name}")),
        modes: ((modes,), words, {"long_name": f"mode of {name}"}),
        f"{name}_phi": (
            (station, "axis", modes),
            values.phi,
            _attributes("1", f"displacement of the axis of {name} per mode, frame axes"),
        ),
        f"{name}_theta": (
            (station, "axis", modes),
            values.theta,
            _attributes("1/m", f"rotation vector of the sections of {name} per mode, frame axes"),
        ),
        f"{name}_second_order": (
            (station, "axis", modes, f"{modes}_2"),
            second_order,
            _attributes(
                "1/m", f"displacement of second order of {name}, frame axes: -1/2 eta^T g eta"
            ),
        ),
    }


def _attributes(unit: str, long_name: str) -> dict[str, str]:
    return {"units": unit or "1", "long_name": long_name}
