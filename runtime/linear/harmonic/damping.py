"""Damping added in a frequency response: hysteretic (loss factors) and modal (damping ratios)."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array, finite_float, one_row
from mstmm.errors import SceneError
from mstmm.scene.validators.validation_messages import did_you_mean

from ...engine.looped_engine import LoopedEngine
from ...packing.coordinate_layout import check_dense_size
from ...packing.scene_packing import packed_system
from ...packing.system import Arrays, BodyNumbers, BodyRun, ForceNumbers, LawNumbers
from ..frozen_loads import bushing_deflection, spring_length
from ..mck_matrices import State
from ..mode_solvers import modes
from ..modes import Complex
from ..operating_point.friction import change_laws

if TYPE_CHECKING:
    from ...engine.compiled_scene import CompiledScene
    from ..input_channels import Channel
    from ..linear_equations import LinearEquations


# --- hysteretic damping ---------------------------------------------------------------------------
#
# In harmonic motion a loss factor eta turns the stiffness k of an element into k (1 + i eta)
# (Crandall, J. Sound Vib. 11 (1970) 3-18).  The added term i (K' - K) follows from two lossless
# scenes: the scene itself, with K, and one with stiffness k (1 + eta) under the same static loads,
# with K'.

#: One loss factor for all elastic elements, or by name of hinge, chain, flexible body or spring.
Losses = float | Mapping[str, float]

#: Number of rows of the matrices of bushings and bearings.
_SIZES = {"bushing6": 6, "bearing6": 6, "bearing3": 3}
#: Indices of stiffnesses among the parameters of a law; those of a rotation follow the shifts.
_STIFF = {
    "linear": (0,), "full": (0, 9), "rotation": (0, 1, 2), "six": (0, 1, 2, 9, 10, 11),
}  # fmt: skip


def stiffer(linear: LinearEquations, losses: Losses) -> LoopedEngine:
    """Engine with each stiffness k raised to k (1 + eta), at unchanged loads of the state.

    Efforts given by expressions and user-defined elements are lossless.

    Raises SceneError for a name without stiffness and for a negative loss factor.
    """
    model, engine, state = linear.model, linear.open_tree, linear.state
    system, lossy = engine.packed.system, loss_factor_lookup(model, losses)
    bodies = tuple(_stiffer_shapes(model, run, lossy) for run in system.bodies)

    def stiffer_body_law(law: LawNumbers, body: int) -> LawNumbers:
        return _stiffer_law(law, lossy(engine.hinge_name(body)))

    laws = tuple(law for run in system.laws for law in change_laws(run, stiffer_body_law))
    forces = tuple(
        _stiffer_force(engine, force, state, lossy(element.name))
        for force, element in zip(system.forces, engine.packed.scene.forces, strict=True)
    )
    stiffer_system = replace(system, bodies=bodies, laws=laws, forces=forces)
    return LoopedEngine(packed_system(stiffer_system, engine.packed))


def loss_factor_lookup(model: CompiledScene, losses: Losses) -> Callable[[str], float]:
    """Function from element name to loss factor; chain members have that of their chain."""
    if not isinstance(losses, Mapping):
        factor = _factor("structural", losses)
        return lambda name: factor
    known = set(_elastic(model))
    for name in losses:
        if name not in known:
            raise SceneError(
                f'structural: "{name}": expected a hinge with a law, a chain, a flexible body, a '
                f"spring or a bushing{did_you_mean(str(name), sorted(known))}"
            )
    factors = {name: _factor(f'structural["{name}"]', value) for name, value in losses.items()}
    return lambda name: factors.get(name, factors.get(name.partition("[")[0], 0.0))


def _factor(what: str, value: float) -> float:
    factor = finite_float(what, value, "a loss factor, such as 0.02")
    if factor < 0:
        raise SceneError(f"{what} = {factor:g}: expected a loss factor of 0 or more, such as 0.02")
    return factor


def _elastic(model: CompiledScene) -> Iterator[str]:
    """Names of elements that may have a loss factor."""
    packed = model.packed_scene
    yield from model.coordinate_layout.modal
    yield from (force.name for force in packed.scene.forces)
    for run in packed.system.laws:
        for _, body, _, _ in run.iterate_laws():
            name = model.looped.hinge_name(body)
            yield name
            yield name.partition("[")[0]


def _stiffer_shapes(model: CompiledScene, run: BodyRun, lossy: Callable[[str], float]) -> BodyRun:
    names = {slots.q: name for name, slots in model.coordinate_layout.modal.items()}

    def stiffen_body(body: BodyNumbers) -> BodyNumbers:
        if body.modal is None:
            return body
        matrices = dict(body.modal.matrices.named)
        matrices["stiffness"] = matrices["stiffness"] * (1 + lossy(names[body.modal.q]))
        return replace(body, modal=replace(body.modal, matrices=Arrays(matrices)))

    if all(body.modal is None for body in run.members):
        return run
    return replace(run, members=tuple(map(stiffen_body, run.members)))


def _stiffer_law(law: LawNumbers, factor: float) -> LawNumbers:
    p = list(law.p)
    for index in _STIFF[law.kernel]:
        p[index] *= 1 + factor
    return replace(law, p=tuple(p))


def _stiffer_force(
    engine: LoopedEngine, force: ForceNumbers, state: State, factor: float
) -> ForceNumbers:
    if force.element[1] in _SIZES and force.element[0] == "force" and factor:
        return _stiffer_bushing(engine, force, state, factor)
    return _stiffer_spring(engine, force, state, factor)


def _stiffer_bushing(
    engine: LoopedEngine, force: ForceNumbers, state: State, factor: float
) -> ForceNumbers:
    """Bushing with raised stiffness; added preload keeps its load at the state."""
    n = _SIZES[force.element[1]]
    pairs, above = n * (n + 1) // 2, n * (n - 1) // 2
    ends = np.cumsum([pairs, pairs, n, above])
    stiffness, damping, preload, circulatory, gyroscopic = np.split(np.array(force.p), ends)
    matrix = np.zeros((n, n))
    matrix[np.triu_indices(n)] = stiffness
    matrix += np.triu(matrix, 1).T
    if len(circulatory):
        skew = np.zeros((n, n))
        skew[np.triu_indices(n, 1)] = circulatory
        matrix += skew - skew.T
    more = factor * matrix @ bushing_deflection(engine, force, state)[:n]
    stiffer_ones, turned = ((1 + factor) * part for part in (stiffness, circulatory))
    p = np.concatenate([stiffer_ones, damping, preload + more, turned, gyroscopic])
    return replace(force, p=tuple(p.tolist()))


def _stiffer_spring(
    engine: LoopedEngine, force: ForceNumbers, state: State, factor: float
) -> ForceNumbers:
    """Spring with raised stiffness; a changed free length keeps its tension at the state."""
    if force.element != ("force", "spring") or not factor * force.p[0]:
        return force
    stiffness, rest, damping = force.p
    length, _ = spring_length(engine, force, state)
    more = stiffness * (1 + factor)
    return replace(force, p=(more, length - (length - rest) / (1 + factor), damping))


# --- modal damping --------------------------------------------------------------------------------
#
# For modes of unit modal mass, with shapes Phi and U = M Phi, the damping matrix
#
#     C = U diag(2 zeta omega) U^T
#
# damps each mode by its zeta and no other mode.  The Woodbury identity adds it to the damping of
# the scene through one small equation for each s, so that the sweep needs no dense matrix:
#
#     (Z + s U R U^T)^-1 r = x - Y c,    x = Z^-1 r,  Y = Z^-1 U,  (1 + s R U^T Y) c = s R U^T x

#: Damping ratios: one for all normal modes, or one for each of the slowest.
Ratios = float | Sequence[float]


@dataclass(frozen=True)
class ModalDamping:
    """Damping of k modes: `columns` U (n, k) and `rates` 2 zeta omega (k,), 1/s."""

    columns: Array
    rates: Array

    def damp(self, s: Complex, x: Complex, answers: Complex) -> Complex:
        """Amplitudes (m, r, n) at s (m,) with modal damping.

        They follow from the responses without it: x (m, r, n) to the right-hand sides, `answers`
        (m, k, n) to the columns U.
        """
        factor = s[:, None, None] * self.rates[:, None]
        matrix = np.eye(len(self.rates)) + factor * (answers @ self.columns).swapaxes(1, 2)
        with np.errstate(all="ignore"):
            amounts = np.linalg.solve(matrix, factor * (x @ self.columns).swapaxes(1, 2))
        return np.asarray(x - amounts.swapaxes(1, 2) @ answers)


def modal_damping(linear: LinearEquations, ratios: Ratios) -> ModalDamping:
    """Modal damping of a model at rest.

    Raises SceneError for invalid ratios, and where the undamped modes are no vibrations: a mode is
    unstable, or K does not derive from a potential.
    """
    alone = np.ndim(ratios) == 0
    zeta = one_row("modal", [ratios] if alone else ratios)
    if (zeta < 0).any():
        raise SceneError(
            f"modal = {zeta.min():g}: expected damping ratios of 0 or more, such as 0.02"
        )
    if len(zeta) > len(linear):
        raise SceneError(
            f"modal: {len(zeta)} ratios, but the scene has {len(linear)} modes; give one "
            "number for all, or fewer"
        )
    if alone:
        check_dense_size(len(linear), "the matrix of all modes")
    undamped_modes = modes(linear, None if alone else len(zeta), False)
    if not undamped_modes.is_undamped or undamped_modes.unstable.any():
        raise SceneError(
            "modal: damping ratios require undamped vibration modes, but this state is unstable or "
            "has follower loads; define damping in laws, or give structural"
        )
    rates = 2 * zeta * undamped_modes.omega
    damped = np.flatnonzero(rates)
    if (
        linear.constrained_motion is not None
    ):  # the mass matrix of the sweep is that of the spanning tree
        return ModalDamping(linear.M @ undamped_modes.shapes[:, damped], rates[damped])
    mass = [linear.operators.mass(undamped_modes.shapes[:, k]) for k in damped]
    return ModalDamping(np.array(mass).reshape(len(damped), len(linear)).T, rates[damped])


# --- compatibility --------------------------------------------------------------------------------


def is_requested(damping: Losses | Ratios) -> bool:
    """Whether any damping is requested."""
    return not (isinstance(damping, int | float) and damping == 0)


def check_state_at_rest(linear: LinearEquations, structural: Losses, modal: Ratios) -> None:
    """Raise SceneError for structural or modal damping about a moving state."""
    if linear.state.u.any() and (is_requested(structural) or is_requested(modal)):
        raise SceneError(
            "frequency response: structural and modal damping require a state at rest, found a "
            "moving one; leave them out, or define damping in laws and flexible bodies"
        )


def reject_modal_damping(modal: Ratios) -> None:
    """Raise SceneError for modal damping ratios together with exact beams."""
    if is_requested(modal):
        raise SceneError(
            "modal: damping ratios refer to normal modes with shape functions, which exact beams "
            "do not have; give structural, or leave exact out"
        )


def reject_drives(pushes: Sequence[Channel], changed: bool) -> None:
    """Raise SceneError for drive motions if stiffness or inertia is `changed` from M, C, K."""
    moved = next((channel.name for channel in pushes if channel.drive_factors), "")
    if changed and moved:
        raise SceneError(
            f'"{moved}": motions of drives cannot be combined with structural damping or exact '
            "beams; leave these out, or use an acceleration of the ground"
        )
