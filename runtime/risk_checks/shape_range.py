"""Frequencies beyond those up to which the shapes of flexible bodies hold."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

import numpy as np

from mstmm.array_validation import Array
from mstmm.risk import Risk

from ..flexible.beam.beam_data import beam_data
from ..flexible.beam.boundary_conditions import BeamEnvironment, boundary_conditions
from ..flexible.beam_resolution import beam_resolution

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene

#: How far beyond its limit, and what share of the strain energy of a motion makes it one of a body.
_BEYOND, _SHARE = 1.05, 0.1
_REMEDY = "take more modes"

_known: WeakKeyDictionary[CompiledScene, Mapping[str, float]] = WeakKeyDictionary()


def shape_limits(model: CompiledScene) -> Mapping[str, float]:
    """Flexible body -> frequency in rad/s up to which its shapes hold with its ends as the scene
    has them; without those that no shapes of theirs limit."""
    if model not in _known:
        _known[model] = dict(_limits(model))
    return _known[model]


def _limits(model: CompiledScene) -> Iterator[tuple[str, float]]:
    beams = {beam.name: beam for beam in model.scene.beam}
    around, alike = BeamEnvironment(model.scene) if beams else None, dict[str, float]()
    for name, body in model.flexible.items():
        limit = body.resolved
        if body.shapes is not None and name in beams and around is not None:
            beam, data = beams[name], body.shapes.data
            held = boundary_conditions(around, beam, beam_data(beam))
            key = repr((beam.model_copy(update={"name": ""}), held, body.modes))
            if key not in alike:
                alike[key] = beam_resolution(body.shapes, held) if data.mass else np.inf
            limit = alike[key]
        if limit is not None and np.isfinite(limit):
            yield name, limit


def response_range_risks(
    model: CompiledScene, omega: Array, exact: Collection[str] = ()
) -> Iterator[Risk]:
    """Bodies whose shapes do not hold up to the highest of the frequencies omega (k,) in rad/s of a
    response; those of the names `exact` need none."""
    highest = float(omega.max(initial=0.0))
    limits = {name: x for name, x in shape_limits(model).items() if name not in exact}
    short = sorted((x, name) for name, x in limits.items() if highest > _BEYOND * x)
    if short:
        limit, name = short[0]
        yield Risk(
            "frequency-range", f'"{name}"',
            f"the response is asked for up to {_hertz(highest):.5g} Hz, but the shapes of "
            f'"{name}" hold up to {_hertz(limit):.5g} Hz{_others(len(short) - 1)}',
            f"{_REMEDY}, or exact = True for beams that are uniform",
            _hertz(highest), _hertz(limit), "Hz",
        )  # fmt: skip


def motion_range_risks(
    model: CompiledScene, omega: Array, strain: Mapping[str, Array]
) -> Iterator[Risk]:
    """Bodies that hold more than a tenth of the strain energy of motions of frequencies omega (k,)
    in rad/s beyond those up to which their shapes hold; `strain`, its parts (k,) by body."""
    limits, found = shape_limits(model), list[tuple[float, str, Array]]()
    for name, limit in limits.items():
        parts = np.nan_to_num(strain.get(name, np.zeros(len(omega))))
        places = np.flatnonzero((omega > _BEYOND * limit) & (np.abs(parts) > _SHARE))
        if len(places):
            found.append((limit, name, omega[places]))
    if found:
        limit, name, beyond = min(found, key=lambda one: one[:2])
        few = f"{len(beyond)} motions" if len(beyond) > 1 else "a motion"
        yield Risk(
            "frequency-range", f'"{name}"',
            f"{few} from {_hertz(beyond.min()):.5g} Hz on cannot be trusted: the shapes of "
            f'"{name}" hold up to {_hertz(limit):.5g} Hz{_others(len(found) - 1)}',
            f"{_REMEDY}, or ask for the slowest modes alone, modes(count)",
            _hertz(beyond.max()), _hertz(limit), "Hz",
        )  # fmt: skip


def _hertz(omega: float) -> float:
    return float(omega) / (2 * np.pi)


def _others(count: int) -> str:
    return f" (and {count} more bodies likewise)" if count else ""
