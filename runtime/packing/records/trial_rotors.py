"""Temporary rotors on hinges, to find out which motions are possible."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from ...kernels import prebuilt_kernels
from .model_record import Written


@contextmanager
def trial_rotors(written: Written) -> Iterator[Callable[[int], None]]:
    """Context in which hinges, by position in the tree, can be given rotors of 1 kg m^2.

    All rotors are removed at its end.  Links do not support them, so the sweep then goes body by
    body.
    """
    ffi, _ = prebuilt_kernels.module()
    rotor = ffi.new("real[]", [1.0] * 6)
    before: dict[int, tuple[object, int]] = {}
    model = written.model
    posed, model.needs_pose = model.needs_pose, 1

    def add_rotor(place: int) -> None:
        record = model.bodies[place]
        before[place] = (record.rotor, int(record.generic))
        record.rotor, record.generic = rotor, 1

    try:
        yield add_rotor
    finally:
        model.needs_pose = posed
        for place, (old, generic) in before.items():
            record = model.bodies[place]
            record.rotor, record.generic = old, generic
