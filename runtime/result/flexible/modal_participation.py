"""Share of the inertia at its hinge that each shape of a flexible body holds (chi).

With chi_i = M_ri^T D^-1 M_ri / M_ii, 0 to 1, the coupled frequency of a shape is
omega_i / sqrt(1 - chi_i): whether the vibration's reaction on the hinge may be left out.  D is the
inertia at the nearest hinge inboard that moves, with the hinges outboard of it free and all modes
held; M_ii is the inertia of the shape with what it carries.  Where loops close, D is the inertia of
all independent motions of the hinges, and M that along speeds which keep the loops closed.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure
from mstmm.scene import split_reference

if TYPE_CHECKING:
    from ...engine.compiled_scene import CompiledScene
    from .body_motions import FlexibleBodies


#: Speeds of a scene up to which its mass matrix is formed for this.
MAX_SPEEDS = 300


def participation_by_body(flexible: FlexibleBodies) -> dict[str, Array]:
    """Body -> chi (modes,) at the start of the run; without bodies that no moving hinge carries.
    Empty for scenes with more than LARGEST speeds, loops in which shapes do not move by themselves,
    and for a start that has no inertia matrix, as the run itself says."""
    if flexible.model.nu > MAX_SPEEDS or not len(flexible.run.t):
        return {}
    model, q = flexible.coupled_start()
    try:
        return (
            _loop_participation(flexible, model, q)
            if model.freedom
            else _tree_participation(flexible, model, q)
        )
    except NumericalFailure:
        return {}


def _tree_participation(
    flexible: FlexibleBodies, model: CompiledScene, q: Array
) -> dict[str, Array]:
    inertia, tree, result = model.looped.mass_matrix(q), _Tree(model), dict[str, Array]()
    for name in flexible.known:
        hinge_speeds, outboard_speeds = tree.hinge_of(name)
        if hinge_speeds:
            result |= _participation_row(
                name, inertia, hinge_speeds, _modal_speed_indices(model, name), outboard_speeds
            )
    return result


def _loop_participation(
    flexible: FlexibleBodies, model: CompiledScene, q: Array
) -> dict[str, Array]:
    """By the motions that loops leave, of which every shape has to be one."""
    assert model.freedom is not None
    result, shapes = (
        dict[str, Array](),
        {name: _modal_speed_indices(model, name) for name in flexible.known},
    )
    modal_speeds = [k for modes in shapes.values() for k in modes]
    hinges, free_speeds = model.freedom.settling(q, modal_speeds, (), ())
    if not hinges or {*free_speeds} != {*modal_speeds}:
        return {}
    speed_indices, hinge_indices = (*hinges, *modal_speeds), list(range(len(hinges)))
    motions = model.freedom.following(q, speed_indices)
    inertia = np.asarray(model.looped.required_by_inertia(q, motions.T) @ motions)
    for name, modes in shapes.items():
        result |= _participation_row(
            name, inertia, hinge_indices, [speed_indices.index(k) for k in modes], []
        )
    return result


def _participation_row(
    name: str, inertia: Array, own: list[int], modes: list[int], others: list[int]
) -> dict[str, Array]:
    """Empty where a hinge has no inertia: not known."""
    try:
        return {name: _participation_of_modes(inertia, own, modes, others)}
    except np.linalg.LinAlgError:
        return {}


def _modal_speed_indices(model: CompiledScene, name: str) -> list[int]:
    return list(range(*_bounds(model.layout.modal[name].u_slice)))


def _participation_of_modes(
    inertia: Array, own: list[int], modes: list[int], others: list[int]
) -> Array:
    """chi of modes from the mass matrix, by speeds of the hinge, the modes and hinges beyond."""
    indices, hinge_count = [*own, *modes], len(own)
    block = inertia[np.ix_(indices, indices)]
    if others:
        coupling_gain = np.linalg.solve(
            inertia[np.ix_(others, others)], inertia[np.ix_(others, indices)]
        )
        block = block - inertia[np.ix_(indices, others)] @ coupling_gain
    return participation(
        block[:hinge_count, hinge_count:],
        block[:hinge_count, :hinge_count],
        np.diag(block)[hinge_count:],
    )


def _bounds(places: slice) -> tuple[int, int]:
    return int(places.start), int(places.stop)


def participation(rows: Array, hinge: Array, modal: Array) -> Array:
    """(modes,) chi from the inertia between hinge and modes (nu, modes), that at the hinge (nu, nu)
    and that of each mode (modes,)."""
    reaction = np.linalg.solve(hinge, rows)
    return np.asarray(np.einsum("jk,jk->k", rows, reaction) / modal)


class _Tree:
    """Free speeds of the hinges, and what hangs on what."""

    def __init__(self, model: CompiledScene) -> None:
        layout, scene = model.layout, model.scene
        self.speeds: dict[str, list[int]] = {}
        self.inboard: dict[str, str] = {}
        for hinge in scene.hinges:
            body = split_reference(hinge.outboard)[0]
            self.inboard[body] = split_reference(hinge.inboard)[0]
            drive = hinge.drive or ()
            first, last = _bounds(layout.hinges[hinge.name].u_slice)
            self.speeds[body] = [
                first + k for k in range(last - first) if k >= len(drive) or drive[k] is None
            ]

    def hinge_of(self, body: str) -> tuple[list[int], list[int]]:
        """Speeds of the nearest moving hinge inboard of a body, and of all hinges beyond it."""
        while body in self.inboard and not self.speeds[body]:
            body = self.inboard[body]
        if body not in self.inboard:
            return [], []
        outboard_speeds = [
            k
            for b, speeds in self.speeds.items()
            if b != body and self._hangs(b, body)
            for k in speeds
        ]
        return self.speeds[body], outboard_speeds

    def _hangs(self, body: str, on: str) -> bool:
        while body in self.inboard:
            body = self.inboard[body]
            if body == on:
                return True
        return False
