"""Frequencies beyond the valid range of the shape functions of flexible bodies."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

import numpy as np

from mstmm.array_validation import Array
from mstmm.risk import Risk

from ...flexible.beam.beam_data import beam_data
from ...flexible.beam.boundary_conditions import BeamEnvironment, boundary_conditions
from ...flexible.resolution import beam_resolution

if TYPE_CHECKING:
    from ...engine.compiled_scene import CompiledScene

#: Accepted ratio of a frequency to the limit, and share of the strain energy of a mode from which
#: on a body matters.
_TOLERANCE, _MIN_ENERGY_SHARE = 1.05, 0.1
_REMEDY = "use more modes"

_limits_by_model: WeakKeyDictionary[CompiledScene, Mapping[str, float]] = WeakKeyDictionary()


def shape_limits(model: CompiledScene) -> Mapping[str, float]:
    """Flexible body -> largest frequency that its shapes resolve, rad/s, if it is limited.

    The limit depends on the boundary conditions at its ends in the scene.
    """
    if model not in _limits_by_model:
        _limits_by_model[model] = dict(_compute_limits(model))
    return _limits_by_model[model]


def _compute_limits(model: CompiledScene) -> Iterator[tuple[str, float]]:
    beams = {beam.name: beam for beam in model.scene.beam}
    environment = BeamEnvironment(model.scene) if beams else None
    limits_by_beam = dict[str, float]()  # equal beams share one computation
    for name, body in model.flexible_bodies.items():
        limit = body.resolved
        if body.shapes is not None and name in beams and environment is not None:
            beam, data = beams[name], body.shapes.data
            boundary = boundary_conditions(environment, beam, beam_data(beam))
            key = repr((beam.model_copy(update={"name": ""}), boundary, body.modes))
            if key not in limits_by_beam:
                limits_by_beam[key] = (
                    beam_resolution(body.shapes, boundary) if data.mass else np.inf
                )
            limit = limits_by_beam[key]
        if limit is not None and np.isfinite(limit):
            yield name, limit


def response_range_risks(
    model: CompiledScene, omega: Array, exact: Collection[str] = ()
) -> Iterator[Risk]:
    """Bodies whose shapes do not resolve the highest frequency omega (k,), rad/s, of a response.

    Bodies named in `exact` are computed without shapes.
    """
    highest = float(omega.max(initial=0.0))
    limits = {name: x for name, x in shape_limits(model).items() if name not in exact}
    exceeded = sorted((x, name) for name, x in limits.items() if highest > _TOLERANCE * x)
    if exceeded:
        limit, name = exceeded[0]
        yield Risk(
            "frequency-range", f'"{name}"',
            f"the response is requested up to {_hertz(highest):.5g} Hz, but the shapes of "
            f'"{name}" are valid up to {_hertz(limit):.5g} Hz'
            f"{_other_bodies_text(len(exceeded) - 1)}",
            f"{_REMEDY}, or exact = True for uniform beams", _hertz(highest), _hertz(limit),
            "Hz",
        )  # fmt: skip


def motion_range_risks(
    model: CompiledScene, omega: Array, strain: Mapping[str, Array]
) -> Iterator[Risk]:
    """Bodies that matter in modes of frequencies omega (k,), rad/s, beyond their valid range.

    `strain` are their shares (k,) of the strain energy of each mode.
    """
    exceeded = list[tuple[float, str, Array]]()
    for name, limit in shape_limits(model).items():
        shares = np.nan_to_num(strain.get(name, np.zeros(len(omega))))
        invalid = (omega > _TOLERANCE * limit) & (np.abs(shares) > _MIN_ENERGY_SHARE)
        if invalid.any():
            exceeded.append((limit, name, omega[invalid]))
    if exceeded:
        limit, name, frequencies = min(exceeded, key=lambda row: row[:2])
        modes = f"{len(frequencies)} modes" if len(frequencies) > 1 else "a mode"
        yield Risk(
            "frequency-range", f'"{name}"',
            f"{modes} from {_hertz(frequencies.min()):.5g} Hz on cannot be trusted: the shapes of "
            f'"{name}" are valid up to {_hertz(limit):.5g} Hz'
            f"{_other_bodies_text(len(exceeded) - 1)}",
            f"{_REMEDY}, or compute the lowest modes only, modes(count)",
            _hertz(frequencies.max()), _hertz(limit), "Hz",
        )  # fmt: skip


def _hertz(omega: float) -> float:
    return float(omega) / (2 * np.pi)


def _other_bodies_text(count: int) -> str:
    return f" (as for {count} more bodies)" if count else ""
