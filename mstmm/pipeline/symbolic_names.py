"""Names that stay symbols in a symbolic linear model: parameters, coordinates and speeds."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from ..errors import SceneError
from ..runtime.packing import scene_parameters
from ..runtime.packing.parameter_derivatives import folded_parameters
from ..scene.validators.validation_messages import did_you_mean

if TYPE_CHECKING:
    from ..runtime.linear.linear_equations import LinearEquations


@dataclass(frozen=True)
class SymbolNames:
    """Names given by the user: of parameters by full name, of q and u by index."""

    parameters: dict[str, str] = field(default_factory=dict)
    coordinates: dict[int, str] = field(default_factory=dict)
    speeds: dict[int, str] = field(default_factory=dict)


@dataclass(frozen=True)
class _Motion:
    """Coordinate or speed: the table for its name, its index, and whether it is free."""

    among: dict[int, str]
    index: int
    free: bool


def resolve_kept_names(linear: LinearEquations, keep: Sequence[str]) -> SymbolNames:
    """Resolve the names of `keep` to parameters, coordinates and speeds.

    Raises SceneError for a name that is unknown or listed twice, and for coordinates with a
    prescribed motion or whose rates are not their speeds, as those of quaternions.
    """
    if isinstance(keep, str) or not all(isinstance(name, str) for name in keep):
        raise SceneError(f'keep = {keep!r}: expected a list of names such as ["rod1.mass"]')
    symbol_names = SymbolNames()
    motions_by_name = dict(_motions(linear, symbol_names))
    numbers = scene_parameters.scene_parameters(linear.model.scene)
    for name in keep:
        if name in motions_by_name:
            motion = motions_by_name[name]
            if not motion.free:
                raise SceneError(
                    f'keep "{name}": expected a free coordinate whose rate is a speed, or its '
                    "speed, found one that a drive imposes or that is no integral of a speed; "
                    "leave it a number"
                )
            is_duplicate = motion.among.setdefault(motion.index, name) != name
        elif name in numbers or f"{name}[0]" in numbers:
            (full_name,) = scene_parameters.resolve_names(linear.model.scene, [name])
            is_duplicate = symbol_names.parameters.setdefault(full_name, name) != name
        else:
            folded_names = set(folded_parameters(linear.model.scene, numbers))
            candidates = [x for x in numbers if x not in folded_names]
            candidates += (x for x, motion in motions_by_name.items() if motion.free)
            raise SceneError(
                f'keep "{name}": expected a number, coordinate or speed of the scene'
                f"{did_you_mean(name, candidates)}"
            )
        if is_duplicate:
            raise SceneError(f'keep "{name}": this number is listed twice; name it once')
    return symbol_names


def _motions(linear: LinearEquations, found: SymbolNames) -> Iterator[tuple[str, _Motion]]:
    """Iterate over all coordinates and speeds with their full names."""
    for slots in linear.model.coordinate_layout.owners:
        for k, name in enumerate(slots.q_names):
            is_free = slots.rates_are_speeds and slots.u + k in linear.free_speed_indices
            yield f"{slots.name}.{name}", _Motion(found.coordinates, slots.q + k, is_free)
        for k, name in enumerate(slots.u_names):
            is_free = slots.rates_are_speeds and slots.u + k in linear.free_speed_indices
            yield f"{slots.name}.{name}", _Motion(found.speeds, slots.u + k, is_free)
