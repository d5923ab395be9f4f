"""Derivatives of the numbers p of the fused kernel by named parameters of the scene.

The computation of p from a scene (frames, mass moments, axes) is not differentiated by hand: it is
repeated on a scene whose parameters are Duals, which yields exact derivatives.  `seed_derivatives`
also admits other number types: with Formulas, p is symbolic.
"""

from __future__ import annotations

import math
import re
from bisect import bisect_left
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from pydantic import BaseModel

from mstmm.array_validation import Array
from mstmm.errors import SceneError
from mstmm.expression.expression import Expression, Name
from mstmm.ir.scene_structure import Structure
from mstmm.ir.terms import Node, Terms
from mstmm.numerics.dual import Dual, value_of
from mstmm.scene import Hinge, Scene

from ..kernels.prebuilt_kernels import Known
from . import scene_parameters
from .expression_tapes import MOVING
from .fused_structure import structure_and_numbers, structure_of
from .packed_scene import Frames, PackedScene
from .system import System
from .system_builder import system_of

Change = Callable[[Any], Any]
#: (value of a parameter, index of its name) -> Dual or Formula in its place.
Seed = Callable[[Any, int], Any]

#: Largest change by another order of a sum of three products, relative for values above 1.
_ROUNDING = 1e-12
_PART = re.compile(r"[^.\[\]]+|\[\d+\]")


def parameter_derivatives(
    scene: Scene, known: Known, names: Sequence[str], reference: PackedScene | None = None
) -> tuple[Structure, Array, Array]:
    """(structure, p, dp/dnames) with p (np,) and its derivatives (np, names).

    The structure is that of the scene, except that structural zeros and axes that depend on a named
    parameter become entries of p.  `reference` supplies the independent rows of closed loops.
    Raises SceneError for unknown names, and for parameters of flexible bodies.
    """
    reject_folded_parameters(scene, names, "exact derivative; take a difference of two models")

    def dual(value: Any, k: int) -> Dual:
        return Dual(value_of(value), {**getattr(value, "slope", {}), k: 1.0})

    system, _ = seed_derivatives(scene, known, names, dual)
    if reference is not None:
        system = _with_rows(system, reference.system)
    floors = [] if reference is None else reference.floors
    structure, numbers = structure_and_numbers(system, known, floors=floors)
    values = np.array([value_of(x) for x in numbers])
    derivatives = np.zeros((len(numbers), len(names)))
    for index, number in enumerate(numbers):
        if isinstance(number, Dual):
            for k, slope in number.slope.items():
                derivatives[index, k] = slope
    return structure, values, derivatives


def _with_rows(system: System, reference: System) -> System:
    """System with the constraint rows of another one."""
    pairs = zip(system.closures, reference.closures, strict=True)
    closures = tuple(replace(closure, directions=other.directions) for closure, other in pairs)
    return replace(system, closures=closures, couplings=reference.couplings)


def seed_derivatives(
    scene: Scene, known: Known, names: Sequence[str], seed: Seed
) -> tuple[System, Frames]:
    """Build the system of a scene with `seed(value, k)` in place of the parameter names[k].

    Frames are not aligned, because alignment is not a smooth function of the parameters.
    """
    seeded, moving = _with_seeds(scene, names, seed)
    plain, plain_frames = system_of(scene, known, align=False)
    _reject_first_rotors(scene, names, plain_frames)
    system, frames = system_of(
        seeded, known, align=False, flexible=plain_frames.modal, moving=moving
    )
    numbers = [value_of(x) for x in structure_and_numbers(system, known)[1]]
    _check_same_numbers(structure_of(plain, known)[1].tolist(), numbers)
    return system, frames


def reject_folded_parameters(scene: Scene, names: Sequence[str], lacking: str) -> None:
    """Raise SceneError for unknown names and for parameters without derivative or formula.

    These are named constants, and numbers that enter shapes of flexible bodies (quadrature,
    eigenvalues) or axes of constraints.  `lacking` states what they do not have, and a remedy.
    """
    for name in folded_parameters(scene, scene_parameters.resolve_names(scene, names)):
        if name.startswith("constants."):
            raise SceneError(
                f'parameter "{name}": named constants are evaluated before they reach the kernels '
                f"and have no {lacking} (with_parameters)"
            )
        raise SceneError(
            f'parameter "{name}": numbers of flexible bodies and of loads along them, and the '
            f"direction or start of a constraint, have no {lacking} (with_parameters)"
        )


def _reject_first_rotors(scene: Scene, names: Sequence[str], frames: Frames) -> None:
    """Raise SceneError for zero rotor inertia of a cut hinge, whose row uses its inverse."""
    cuts = {cut.hinge for cut in frames.expanded.cuts}
    rotors = {
        f"{hinge.name}.law.inertia[{k}]": value
        for hinge in scene.hinge if hinge.name in cuts
        for k, value in enumerate(hinge.law.inertia)
    }  # fmt: skip
    for name in scene_parameters.resolve_names(scene, names):
        if rotors.get(name, 1.0) == 0:
            hinge = name.partition(".")[0]
            raise SceneError(
                f'parameter "{name}": the rotor inertia of the cut hinge "{hinge}" is zero and has '
                "no exact derivative; set cut = false, or take a difference of two models "
                "(with_parameters)"
            )


def folded_parameters(scene: Scene, names: Iterable[str]) -> list[str]:
    """Full names of parameters without derivative or formula (`reject_folded_parameters`)."""
    flexible = {body.name for body in (*scene.beam, *scene.elastic)}
    constraints = {constraint.name for constraint in scene.constraint}
    load_keys, constraint_keys = ("force_per_length", "span"), ("normal", "axis", "curve", "start")
    parts = ((name, *name.partition(".")[::2]) for name in names)
    return [
        name for name, owner, rest in parts
        if owner in flexible or owner == "constants" or rest.startswith(load_keys)
        or (owner in constraints and rest.startswith(constraint_keys))
    ]  # fmt: skip


def _check_same_numbers(plain: Sequence[float], seeded: Sequence[float]) -> None:
    """Check that both systems have the same numbers, bit for bit.

    A difference means that code other than the seed's arithmetic has used a seeded number.  Numbers
    of sections of flexible bodies may differ by rounding: numpy sums seeds in another order.
    """
    missing = Counter(plain) - Counter(seeded)
    others = sorted((Counter(seeded) - Counter(plain)).elements())
    for value in sorted(missing.elements()):
        tolerance = _ROUNDING * max(1.0, abs(value))
        nearest = bisect_left(others, value - tolerance)
        if nearest == len(others) or others[nearest] > value + tolerance:
            raise AssertionError(f"numbers of the scene missing after seeding: {sorted(missing)}")
        del others[nearest]


@dataclass(frozen=True)
class _Moving(Expression):
    """Entry of the port "moving" in place of a constant expression."""

    number: Any
    index: int

    @property
    def is_zero(self) -> bool:
        """False, because a seeded zero has a derivative."""
        return False

    def build(self, graph: Terms, resolve: Callable[[Name], Node]) -> Node:
        """Node of the port's entry."""
        return graph.element(MOVING, self.index)


def _with_seeds(scene: Scene, names: Sequence[str], seed: Seed) -> tuple[Scene, dict[int, Any]]:
    """Scene with seeds in place of named parameters, not validated, and those in expressions.

    The latter are entries of the port "moving", by index.
    """
    moving: dict[int, Any] = {}
    for k, name in enumerate(scene_parameters.resolve_names(scene, names)):

        def change(value: Any, k: int = k) -> Any:
            if isinstance(value, Expression):
                number = value.number if isinstance(value, _Moving) else value.evaluate(_nan)
                moving[k] = seed(number, k)
                return _Moving(value.text, (), (), -1, moving[k], k)
            return seed(value, k)

        scene = _with_changed_number(scene, name, change)
    return scene, moving


def _nan(_: Name) -> float:
    return math.nan


def _with_changed_number(scene: Scene, name: str, change: Change) -> Scene:
    parts: list[str | int] = [
        int(part[1:-1]) if part.startswith("[") else part for part in _PART.findall(name)
    ]
    fields: dict[str, Any] = {key: getattr(scene, key) for key in type(scene).model_fields}
    if parts[0] == "gravity":
        fields["gravity"] = _replace_number(scene.gravity, parts[1:], change)
    else:
        for table in scene_parameters.TABLES:
            fields[table] = tuple(
                _change_element(element, parts[1:], change)
                if element.name == parts[0] and parts[1] in type(element).model_fields
                else element
                for element in fields[table]
            )
    # A copy would keep properties cached with the old numbers.
    return Scene.model_construct(**fields)


def _change_element(element: BaseModel, parts: Sequence[str | int], change: Change) -> BaseModel:
    if isinstance(element, Hinge) and parts[0] == "parameters":
        _check_not_in_effort(element, str(parts[1]))
    changed = _replace_number(element, parts, change)
    if isinstance(changed, Hinge) and parts[0] == "normal":
        return changed.model_copy(update={"axis": changed.normal})
    return changed


def _check_not_in_effort(hinge: Hinge, parameter: str) -> None:
    """Raise SceneError if an effort expression contains the parameter: it is constant there."""
    if any(name.quantity == parameter for effort in hinge.law.effort for name in effort.names):
        raise SceneError(
            f'parameter "{hinge.name}.parameters.{parameter}": an effort expression of the hinge '
            "contains it, and numbers in expressions have neither derivative nor formula; compare "
            "two models (with_parameters)"
        )


def _replace_number(target: Any, parts: Sequence[str | int], change: Change) -> Any:
    """Copy of `target` with the number at the end of the path changed."""
    if not parts:
        return change(target)
    key, rest = parts[0], parts[1:]
    if isinstance(target, tuple):
        return tuple(
            _replace_number(x, rest, change) if i == key else x for i, x in enumerate(target)
        )
    if isinstance(target, Mapping):
        return {**target, key: _replace_number(target[key], rest, change)}
    return target.model_copy(update={key: _replace_number(getattr(target, str(key)), rest, change)})
