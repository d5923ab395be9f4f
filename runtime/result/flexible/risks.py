"""Findings about flexible bodies outside the validity range of their model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from mstmm.risk import Risk

from .estimators import BENDING_ENERGY

if TYPE_CHECKING:
    from .certify import Flexibility

#: From where on there is one: slope, load ratio of a linear beam and spin in first frequencies,
#: bending energy that the shapes miss, shear, rotation of a section (rad), buckling, strain.
SLOPE, GAMMA, SPIN, TAIL, SHEAR, TURN, BUCKLING, STRAIN = 0.3, 0.1, 1.0, 0.1, 0.05, 1.4, -0.9, 0.05


def risks(found: Sequence[Flexibility]) -> list[Risk]:
    """Objections to flexible models, one finding per kind, for its worst body."""
    rows = []
    for one in found:
        for text in one.said:
            means, _, remedy = text.partition("; ")
            rows.append(Risk("body-model", f'"{one.name}"', means, remedy))
    worst_first = sorted(found, key=lambda one: -max(one.slope, one.spin_ratio, one.load_ratio))
    for kind in (_linear, _steep, _turned, _strained, _missed, _buckled, _aside, _sheared):
        seen = [risk for one in worst_first if (risk := kind(one)) is not None]
        if seen:
            more = f" (and {len(seen) - 1} more bodies likewise)" if len(seen) > 1 else ""
            rows.append(replace(seen[0], means=seen[0].means + more))
    return rows


def _linear(one: Flexibility) -> Risk | None:
    if one.stiffening:
        return None
    stiffens = 'use flexibility = "coupled"' if one.one_way else "leave stiffening on"
    lacks = "responds one way, without stiffening" if one.one_way else "has no geometric stiffening"
    if one.spin_ratio > SPIN:
        way_out = stiffens if one.gamma or one.one_way else "model it by beams, or from a mesh"
        return Risk(
            "stiffening", f'"{one.name}"',
            f'"{one.name}" {lacks} and spins at {one.spin_ratio:.2g} times its '
            "first frequency: its deflection grows without bound where a real body stiffens",
            way_out, one.spin_ratio, SPIN,
        )  # fmt: skip
    if one.load_ratio > GAMMA:
        return Risk(
            "stiffening", f'"{one.name}"',
            f'"{one.name}" {lacks}, but its loads change its stiffness by '
            f"{one.load_ratio:.0%} (gamma): deflections err by about as much",
            stiffens, one.load_ratio, GAMMA,
        )  # fmt: skip
    return None


def _steep(one: Flexibility) -> Risk | None:
    if one.slope <= SLOPE:
        return None
    return Risk(
        "slope", f'"{one.name}"',
        f'"{one.name}" bends by a slope of {one.slope:.2g} against its floating frame; beyond '
        f"{SLOPE:g} one frame is too little (error up to {one.frame_error:.0%} of the deflection, "
        f"{min(one.shortening_error, 9.99):.0%} of the shortening)",
        "split the body into welded parts", one.slope, SLOPE,
    )  # fmt: skip


def _strained(one: Flexibility) -> Risk | None:
    if one.strain is None or one.strain <= STRAIN:
        return None
    return Risk(
        "strain", f'"{one.name}"',
        f'"{one.name}" is strained by {one.strain:.2g}; beyond {STRAIN:g} the model, which is '
        "linear in the strain, has no meaning", "check stiffness and loads", one.strain, STRAIN,
    )  # fmt: skip


def _turned(one: Flexibility) -> Risk | None:
    if one.turn <= TURN:
        return None
    return Risk(
        "turn", f'"{one.name}"',
        f'a section of "{one.name}" turns by {one.turn:.2g} rad against its floating frame; the '
        "model has no meaning beyond 1.5 rad", "split the body into welded parts", one.turn, TURN,
        "rad",
    )  # fmt: skip


def _missed(one: Flexibility) -> Risk | None:
    if one.tail is None or one.tail <= TAIL:
        return None
    beam = one.tail_of == BENDING_ENERGY
    carries = 'basis = "static+fixed-interface"' if beam else "static_shapes at its ends"
    return Risk(
        "shapes", f'"{one.name}"',
        f'the shapes of "{one.name}" miss {one.tail:.0%} of {"its" if beam else "the"} '
        f"{one.tail_of}",
        f"take more modes, or {carries}, which carries the loads of its hinges", one.tail, TAIL,
    )  # fmt: skip


def _buckled(one: Flexibility) -> Risk | None:
    if one.gamma is None or one.gamma[0] >= BUCKLING:
        return None
    return Risk(
        "buckling", f'"{one.name}"',
        f'its loads take {-one.gamma[0]:.0%} of the stiffness of "{one.name}" (gamma): it is at '
        "its buckling load, by compression, or sideways by bending moments at work on its twist",
        "make it stiffer, or its loads less", one.gamma[0], BUCKLING,
    )  # fmt: skip


def _aside(one: Flexibility) -> Risk | None:
    if one.sideways is None or one.sideways < -BUCKLING:
        return None
    return Risk(
        "buckling", f'"{one.name}"',
        f'the loads of "{one.name}" reach {one.sideways:.0%} of those that buckle it out of the '
        "plane of its shapes, which does not show", "give it shapes of y, z and twist",
        one.sideways, -BUCKLING,
    )  # fmt: skip


def _sheared(one: Flexibility) -> Risk | None:
    if one.shear is None or one.shear <= SHEAR:
        return None
    return Risk(
        "shear", f'"{one.name}"',
        f'shapes by which "{one.name}" bends are too short for a beam without shear: their '
        f"frequencies err by about {min(one.shear, 1.0):.0%}, by the share that they have",
        "take an elastic body", one.shear, SHEAR,
    )  # fmt: skip
