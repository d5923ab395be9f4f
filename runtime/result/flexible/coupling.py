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

from mstmm.arrays import Array
from mstmm.errors import NumericalFailure
from mstmm.scene import split

if TYPE_CHECKING:
    from ...engine.compiled import Compiled
    from .bodies import FlexibleBodies


#: Speeds of a scene up to which its mass matrix is formed for this.
LARGEST = 300


def couplings(flexible: FlexibleBodies) -> dict[str, Array]:
    """Body -> chi (modes,) at the start of the run; without bodies that no moving hinge carries.
    Empty for scenes with more than LARGEST speeds, loops in which shapes do not move by themselves,
    and for a start that has no inertia matrix, as the run itself says."""
    if flexible.model.nu > LARGEST or not len(flexible.run.t):
        return {}
    model, q = flexible.coupled_start()
    try:
        return _in_loops(flexible, model, q) if model.freedom else _in_tree(flexible, model, q)
    except NumericalFailure:
        return {}


def _in_tree(flexible: FlexibleBodies, model: Compiled, q: Array) -> dict[str, Array]:
    inertia, tree, found = model.looped.mass_matrix(q), _Tree(model), dict[str, Array]()
    for name in flexible.known:
        own, others = tree.hinge_of(name)
        if own:
            found |= _named(name, inertia, own, _modes(model, name), others)
    return found


def _in_loops(flexible: FlexibleBodies, model: Compiled, q: Array) -> dict[str, Array]:
    """By the motions that loops leave, of which every shape has to be one."""
    assert model.freedom is not None
    found, shapes = dict[str, Array](), {name: _modes(model, name) for name in flexible.known}
    bent = [k for modes in shapes.values() for k in modes]
    hinges, free = model.freedom.settling(q, bent, (), ())
    if not hinges or {*free} != {*bent}:
        return {}
    places, own = (*hinges, *bent), list(range(len(hinges)))
    ways = model.freedom.following(q, places)
    inertia = np.asarray(model.looped.required_by_inertia(q, ways.T) @ ways)
    for name, modes in shapes.items():
        found |= _named(name, inertia, own, [places.index(k) for k in modes], [])
    return found


def _named(
    name: str, inertia: Array, own: list[int], modes: list[int], others: list[int]
) -> dict[str, Array]:
    """Empty where a hinge has no inertia: not known."""
    try:
        return {name: _coupling_of(inertia, own, modes, others)}
    except np.linalg.LinAlgError:
        return {}


def _modes(model: Compiled, name: str) -> list[int]:
    return list(range(*_bounds(model.layout.modal[name].u_slice)))


def _coupling_of(inertia: Array, own: list[int], modes: list[int], others: list[int]) -> Array:
    """chi of modes from the mass matrix, by speeds of the hinge, the modes and hinges beyond."""
    kept, size = [*own, *modes], len(own)
    block = inertia[np.ix_(kept, kept)]
    if others:
        away = np.linalg.solve(inertia[np.ix_(others, others)], inertia[np.ix_(others, kept)])
        block = block - inertia[np.ix_(kept, others)] @ away
    return coupling(block[:size, size:], block[:size, :size], np.diag(block)[size:])


def _bounds(places: slice) -> tuple[int, int]:
    return int(places.start), int(places.stop)


def coupling(rows: Array, hinge: Array, modal: Array) -> Array:
    """(modes,) chi from the inertia between hinge and modes (nu, modes), that at the hinge (nu, nu)
    and that of each mode (modes,)."""
    carried = np.linalg.solve(hinge, rows)
    return np.asarray(np.einsum("jk,jk->k", rows, carried) / modal)


class _Tree:
    """Free speeds of the hinges, and what hangs on what."""

    def __init__(self, model: Compiled) -> None:
        layout, scene = model.layout, model.scene
        self.speeds: dict[str, list[int]] = {}
        self.inboard: dict[str, str] = {}
        for hinge in scene.hinges:
            body = split(hinge.outboard)[0]
            self.inboard[body] = split(hinge.inboard)[0]
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
        beyond = [k for b, some in self.speeds.items() if b != body and self._hangs(b, body)
                  for k in some]  # fmt: skip
        return self.speeds[body], beyond

    def _hangs(self, body: str, on: str) -> bool:
        while body in self.inboard:
            body = self.inboard[body]
            if body == on:
                return True
        return False
