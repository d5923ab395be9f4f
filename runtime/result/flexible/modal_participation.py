"""Modal participation chi: share of each shape function in the inertia at its hinge.

With chi_i = M_ri^T D^-1 M_ri / M_ii, 0 to 1, the coupled frequency of a shape function is omega_i /
sqrt(1 - chi_i); chi decides whether the reaction of the vibration on the hinge may be neglected. D
is the inertia at the nearest moving hinge inboard, with the hinges outboard of it free and all
modes fixed; M_ii is the inertia of the shape function including what it carries. In closed loops, D
is the inertia of all independent hinge motions, and M is taken along speeds that satisfy the
constraints.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure
from mstmm.scene import split_reference

if TYPE_CHECKING:
    from ...engine.compiled_scene import CompiledScene
    from .section_loads import FlexibleBodies


#: Largest number of speeds for which the mass matrix is formed here.
MAX_SPEEDS = 300


def participation_by_body(flexible: FlexibleBodies) -> dict[str, Array]:
    """Map from body to chi (modes,) at the start of the run; without bodies on no moving hinge.

    Empty for scenes with more than `MAX_SPEEDS` speeds, for loops in which shape functions are not
    independent motions, and for a start without an inertia matrix, which the run itself reports.
    """
    if flexible.model.nu > MAX_SPEEDS or not len(flexible.run.t):
        return {}
    model, q = flexible.coupled_start()
    try:
        return (
            _loop_participation(flexible, model, q)
            if model.independent_speeds
            else _tree_participation(flexible, model, q)
        )
    except NumericalFailure:
        return {}


def _tree_participation(
    flexible: FlexibleBodies, model: CompiledScene, q: Array
) -> dict[str, Array]:
    inertia, tree, result = model.looped.mass_matrix(q), _Tree(model), dict[str, Array]()
    for name in flexible.modal_bodies:
        hinge_speeds, outboard_speeds = tree.moving_hinge(name)
        if hinge_speeds:
            result |= _participation_row(
                name, inertia, hinge_speeds, _modal_speed_indices(model, name), outboard_speeds
            )
    return result


def _loop_participation(
    flexible: FlexibleBodies, model: CompiledScene, q: Array
) -> dict[str, Array]:
    """Participation by independent motions of loops, which must include every shape function."""
    assert model.independent_speeds is not None
    result, shapes = (
        dict[str, Array](),
        {name: _modal_speed_indices(model, name) for name in flexible.modal_bodies},
    )
    modal_speeds = [k for modes in shapes.values() for k in modes]
    hinges, free_speeds = model.independent_speeds.select_fixed_speeds(q, modal_speeds, (), ())
    if not hinges or {*free_speeds} != {*modal_speeds}:
        return {}
    speed_indices, hinge_indices = (*hinges, *modal_speeds), list(range(len(hinges)))
    motions = model.independent_speeds.motion_matrix(q, speed_indices)
    inertia = np.asarray(model.looped.mass_matrix_product(q, motions.T) @ motions)
    for name, modes in shapes.items():
        result |= _participation_row(
            name, inertia, hinge_indices, [speed_indices.index(k) for k in modes], []
        )
    return result


def _participation_row(
    name: str, inertia: Array, own: list[int], modes: list[int], other_modes: list[int]
) -> dict[str, Array]:
    """Participation of one body; empty (unknown) where a hinge has no inertia."""
    try:
        return {name: _participation_of_modes(inertia, own, modes, other_modes)}
    except np.linalg.LinAlgError:
        return {}


def _modal_speed_indices(model: CompiledScene, name: str) -> list[int]:
    return list(range(*_bounds(model.coordinate_layout.modal[name].u_slice)))


def _participation_of_modes(
    inertia: Array, own: list[int], modes: list[int], other_modes: list[int]
) -> Array:
    """Participation chi of modes from the mass matrix.

    `own`, `modes` and `other_modes` are speed indices of hinge, modes and outboard hinges.
    """
    indices, hinge_count = [*own, *modes], len(own)
    block = inertia[np.ix_(indices, indices)]
    if other_modes:
        coupling_gain = np.linalg.solve(
            inertia[np.ix_(other_modes, other_modes)], inertia[np.ix_(other_modes, indices)]
        )
        block = block - inertia[np.ix_(indices, other_modes)] @ coupling_gain
    return participation(
        block[:hinge_count, hinge_count:],
        block[:hinge_count, :hinge_count],
        np.diag(block)[hinge_count:],
    )


def _bounds(indices: slice) -> tuple[int, int]:
    return int(indices.start), int(indices.stop)


def participation(rows: Array, hinge: Array, modal: Array) -> Array:
    """Participation chi (modes,) from blocks of the inertia matrix.

    `rows` (nu, modes) couples hinge and modes, `hinge` (nu, nu) is the inertia at the hinge and
    `modal` (modes,) that of each mode.
    """
    reaction = np.linalg.solve(hinge, rows)
    return np.asarray(np.einsum("jk,jk->k", rows, reaction) / modal)


class _Tree:
    """Free speeds of the hinges, and the inboard body of each body."""

    def __init__(self, model: CompiledScene) -> None:
        layout, scene = model.coordinate_layout, model.scene
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

    def moving_hinge(self, body: str) -> tuple[list[int], list[int]]:
        """Speeds of the nearest moving hinge inboard of a body, and of all outboard of it."""
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
