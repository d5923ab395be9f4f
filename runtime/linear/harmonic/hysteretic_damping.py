"""Hysteretic damping: complex stiffness with frequency-independent loss factors.

In harmonic motion a loss factor eta turns the stiffness k of an element into k (1 + i eta)
(Crandall, J. Sound Vib. 11 (1970) 3-18).  The added term i (K' - K) follows from two lossless
scenes: the scene itself, with K, and one with stiffness k (1 + eta) under the same static loads,
with K'.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import finite_float
from mstmm.errors import SceneError
from mstmm.scene.validators.validation_messages import did_you_mean

from ...engine.looped_engine import LoopedEngine
from ...packing.scene_packing import packed_system
from ...packing.system import Arrays, BodyNumbers, BodyRun, ForceNumbers, LawNumbers
from ..frozen_loads import bushing_deflection, spring_length
from ..mck_matrices import State
from ..operating_point.friction import change_laws

if TYPE_CHECKING:
    from ...engine.compiled_scene import CompiledScene
    from ..linear_equations import LinearEquations

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
