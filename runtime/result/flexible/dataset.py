"""Flexible bodies in a Dataset: energies and motions over time, and the shapes that give the
deflection anywhere along a beam from the modal coordinates in q."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .names import OF_BODY

if TYPE_CHECKING:
    from ...flexible.modal_body import ModalBody
    from ..record import Record

Variable = tuple[tuple[str, ...], Any, dict[str, str]]

#: Stations along a beam at which its shapes are written.
STATIONS = 41

#: Flexible bodies up to which the shapes of each are written; of more the scene in the file tells.
_WRITTEN = 40


def labels(result: Record) -> dict[str, tuple[str, list[str], str]]:
    """Name -> (dimension, words, long name)."""
    known = result.model.flexible
    if not known:
        return {}
    modes = [f"{name}.{mode}" for name, body in known.items() for mode in body.modes]
    return {
        "flexible": ("flexible", list(known), "flexible body"),
        "mode": ("mode", modes, "modal coordinate, as in coordinate"),
    }


def variables(result: Record) -> dict[str, Variable]:
    """Energies of modes, equivalent motions of flexible bodies, shapes of beams."""
    known = result.model.flexible
    if not known:
        return {}
    found: dict[str, Variable] = {
        "modal_energy": (
            ("time", "mode"), np.concatenate([result.modal_energy(name) for name in known], axis=1),
            _about("J", "strain energy of modes and kinetic energy against the frame"),
        ),
        "strain_energy": (
            ("time", "flexible"),
            np.stack([result.strain_energy(name) for name in known], axis=1),
            _about("J", "strain energy"),
        ),
    }  # fmt: skip
    for kind, (about, method) in OF_BODY.items():
        values = np.stack([getattr(result, method)(name) for name in known], axis=1)
        label = _about(about.unit, f"{about.long_name}, inertial axes")
        found[f"flexible_{kind}"] = (("time", "flexible", "axis"), values, label)
    if len(known) <= _WRITTEN:
        for name, body in known.items():
            found |= {} if body.shapes is None else _shapes(name, body)
    return found


def _shapes(name: str, body: ModalBody) -> dict[str, Variable]:
    """deflection = phi eta - 1/2 eta^T second_order eta."""
    shapes = body.shapes
    assert shapes is not None
    x = np.linspace(0.0, shapes.length, STATIONS)
    at, station, modes = shapes.at(x), f"{name}_x", f"{name}_mode"
    drawn = np.zeros((len(x), 3, body.n, body.n))
    if shapes.stiffening:
        drawn = shapes.second_order.at(x)[:, :3]
    words = np.array(body.modes, dtype=object)
    return {
        station: ((station,), x, _about("m", f"place along {name}")),
        modes: ((modes,), words, {"long_name": f"mode of {name}"}),
        f"{name}_phi": (
            (station, "axis", modes), at.phi,
            _about("1", f"displacement of the axis of {name} per mode, frame axes"),
        ),
        f"{name}_theta": (
            (station, "axis", modes), at.theta,
            _about("1/m", f"rotation vector of the sections of {name} per mode, frame axes"),
        ),
        f"{name}_second_order": (
            (station, "axis", modes, f"{modes}_2"), drawn,
            _about("1/m", f"displacement of second order of {name}, frame axes: -1/2 eta^T g eta"),
        ),
    }  # fmt: skip


def _about(unit: str, long_name: str) -> dict[str, str]:
    return {"units": unit or "1", "long_name": long_name}
