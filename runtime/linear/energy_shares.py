"""Energy shares of modes: kinetic by body, elastic by hinge law, flexible body and spring.

For a shape x the kinetic share of body b is x* M_b x / x* M x, where M_b is the mass matrix of the
scene with the inertia of that body only; the elastic share of coordinate j is
conj(x_j) (K_e x)_j / x* K_e x.  Both result from passes over the bodies, without a matrix.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array

from .frozen_loads import with_frozen_springs, without_laws
from .mck_matrices import Pencil

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene
    from .linear_equations import LinearEquations


def operator_products(product: Callable[[Array], Array], shapes: NDArray[Any]) -> NDArray[Any]:
    """Product (n, k) of a real operator and each shape, complex shapes in two parts."""
    columns = [
        product(x.real) + (1j * product(x.imag) if np.iscomplexobj(x) else 0.0) for x in shapes.T
    ]
    return np.array(columns).reshape(len(columns), len(shapes)).T


def kinetic(linear: LinearEquations, shapes: NDArray[Any]) -> dict[str, Array]:
    """Share (k,) of each body in the kinetic energy of each shape."""
    return kinetic_shares(linear.model, linear.state.q, linear.expand(shapes))


def kinetic_shares(model: CompiledScene, q: Array, speeds: NDArray[Any]) -> dict[str, Array]:
    """Share (k,) of each body in the kinetic energy of speeds (nu, k) at q (nq,)."""
    engine, parts = model.unmerged_engine, [np.real(speeds)]
    if np.iscomplexobj(speeds):
        parts.append(np.imag(speeds))
    energies = np.zeros((speeds.shape[1], engine.packed.topology.count))
    for part in parts:
        energies += engine.kinetic_energies(q, np.ascontiguousarray(part.T))
    frames = {closure.frame for closure in engine.packed.system.closures}
    bodies = [tree_index for tree_index in range(energies.shape[1]) if tree_index not in frames]
    names = [engine.body_name(tree_index).partition("/")[0] for tree_index in bodies]
    return _parts(names, energies[:, bodies].T)


def strain_shares(linear: LinearEquations, shapes: NDArray[Any]) -> dict[str, Array]:
    """Share (k,) of each owner of coordinates, and of "springs", in the elastic energy."""
    tree, free = linear.open_tree, list(linear.model.free_speed_indices)
    shapes = linear.expand(shapes)[free]
    whole, lawless, held = (
        operator_products(_stiffness_operator(linear, engine), shapes)
        for engine in (tree, without_laws(tree), with_frozen_springs(tree, linear.state))
    )
    own = np.real(
        np.conj(shapes) * (whole - lawless + _modal_stiffness_product(linear.model, shapes))
    )
    names = [name.rpartition(".")[0] for name, _ in linear.model.tangent_increments]
    if not linear.model.scene.forces:
        return _parts(names, own)
    sprung = np.real(np.conj(shapes) * (lawless - held)).sum(axis=0)
    return _parts([*names, "springs"], np.vstack([own, sprung]))


def _stiffness_operator(linear: LinearEquations, engine: Any) -> Callable[[Array], Array]:
    """Operator x -> K x of a scene; x' = G x + speeds, where it has a rate matrix G."""
    pencil = Pencil(engine, linear.state, list(linear.model.free_speed_indices))
    turning = linear.rate_matrix if linear.constrained_motion is None else None
    if turning is None:
        return pencil.stiffness
    return lambda x: pencil.stiffness(x) - pencil.damping(turning @ x)


def _modal_stiffness_product(model: CompiledScene, x: NDArray[Any]) -> NDArray[Any]:
    """Product (n, k) of the stiffness of flexible bodies and increments x of all free speeds."""
    moved = np.zeros((model.nu, x.shape[1]), dtype=x.dtype)
    moved[list(model.free_speed_indices)] = x
    pressed = np.zeros_like(moved)
    for name, slots in model.coordinate_layout.modal.items():
        pressed[slots.u_slice] = model.flexible_bodies[name].K @ moved[slots.u_slice]
    return pressed[list(model.free_speed_indices)]


def _parts(names: Iterable[str], energies: Array) -> dict[str, Array]:
    """Sums of rows (k,) by name relative to the total; nan where the total is zero."""
    parts: dict[str, Array] = {}
    for name, row in zip(names, energies, strict=True):
        parts[name] = parts[name] + row if name in parts else row
    total = energies.sum(axis=0)
    with np.errstate(all="ignore"):
        return {name: np.where(np.abs(total) > 0, row / total, np.nan)
                for name, row in parts.items()}  # fmt: skip
