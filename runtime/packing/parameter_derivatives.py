"""Named numbers of a scene as Duals, and what they do to the numbers p of the fused kernel.

The way from a scene to p (frames, mass moments, axes) is not differentiated by hand: the same code
runs once more on a scene whose chosen numbers are Duals, and p comes out with exact slopes.  Other
numbers than Duals may stand in their places (`seed_derivatives`): Formulas give p as formulas.
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

from . import scene_parameters
from .expression_tapes import MOVING
from .fused_structure import structure_and_numbers, structure_of
from .packed_scene import PackedScene
from .scene_elements import Known
from .scene_frames import Frames
from .system import System
from .system_builder import system_of

Change = Callable[[Any], Any]
#: (number of the scene, number of its name) -> what stands for it.
Seed = Callable[[Any, int], Any]

#: Largest difference that another order of a sum of three products makes, relative above 1.
_ROUNDING = 1e-12
_PART = re.compile(r"[^.\[\]]+|\[\d+\]")


def parameter_derivatives(
    scene: Scene, known: Known, names: Sequence[str], judged: PackedScene | None = None
) -> tuple[Structure, Array, Array]:
    """(structure, p, dp/dnames) with p (np,) and its slopes (np, names).

    The structure is that of the scene, except that a structural zero or axis that a named number
    moves is a place in p; of closed loops it has the rows that are left where they are `judged`.
    Raises SceneError for a name that the scene does not have, and for numbers of flexible bodies.
    """
    reject_folded_parameters(scene, names, "exact derivative; take a difference of two models")

    def dual(value: Any, k: int) -> Dual:
        return Dual(value_of(value), {**getattr(value, "slope", {}), k: 1.0})

    system, _ = seed_derivatives(scene, known, names, dual)
    if judged is not None:
        system = _with_rows(system, judged.system)
    floors = [] if judged is None else judged.floors
    structure, found = structure_and_numbers(system, known, floors=floors)
    values = np.array([value_of(x) for x in found])
    moved = np.zeros((len(found), len(names)))
    for place, dual in enumerate(found):
        if isinstance(dual, Dual):
            for k, slope in dual.slope.items():
                moved[place, k] = slope
    return structure, values, moved


def _with_rows(system: System, judged: System) -> System:
    """With the rows of closed loops that another one has."""
    both = zip(system.closures, judged.closures, strict=True)
    closures = tuple(replace(one, directions=kept.directions) for one, kept in both)
    return replace(system, closures=closures, couplings=judged.couplings)


def seed_derivatives(
    scene: Scene, known: Known, names: Sequence[str], seed: Seed
) -> tuple[System, Frames]:
    """The system of a scene with `seed(number, k)` in place of the number of names[k].

    Frames are not aligned: those that are chosen by cases follow no formula.
    """
    changed, moving = _with_seeds(scene, names, seed)
    plain, frames = system_of(scene, known, align=False)
    _refuse_first_rotors(scene, names, frames)
    system, found = system_of(changed, known, align=False, flexible=frames.modal, moving=moving)
    numbers = [value_of(x) for x in structure_and_numbers(system, known)[1]]
    _check(structure_of(plain, known)[1].tolist(), numbers)
    return system, found


def reject_folded_parameters(scene: Scene, names: Sequence[str], lacking: str) -> None:
    """Named constants, and numbers that go into the shapes of flexible bodies, by quadrature and
    eigenvalues, or into the axes of constraints, and names that the scene does not have:
    SceneError, which says what they are `lacking` and what to do instead."""
    for name in folded_parameters(scene, scene_parameters.resolve_names(scene, names)):
        if name.startswith("constants."):
            raise SceneError(
                f'parameter "{name}": named constants go into numbers and expressions before they '
                f"reach the kernels, and have no {lacking} (with_parameters)"
            )
        raise SceneError(
            f'parameter "{name}": numbers of flexible bodies, and of loads along them, and those '
            f"that turn a constraint or begin it have no {lacking} (with_parameters)"
        )


def _refuse_first_rotors(scene: Scene, names: Sequence[str], frames: Frames) -> None:
    """A rotor on a hinge that closes a loop holds the loop by what is one over its inertia."""
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
                f'parameter "{name}": hinge "{hinge}" closes a loop without a rotor, and has no '
                "exact derivative by the first one there; give it cut = false, or take a "
                "difference of two models (with_parameters)"
            )


def folded_parameters(scene: Scene, names: Iterable[str]) -> list[str]:
    """Those of full names that `refuse_folded` refuses."""
    flexible = {body.name for body in (*scene.beam, *scene.elastic)}
    closing = {one.name for one in scene.constraint}
    along, chosen = ("force_per_length", "span"), ("normal", "axis", "curve", "start")
    parted = ((name, *name.partition(".")[::2]) for name in names)
    return [
        name for name, owner, rest in parted
        if owner in flexible or owner == "constants" or rest.startswith(along)
        or (owner in closing and rest.startswith(chosen))
    ]  # fmt: skip


def _check(plain: Sequence[float], found: Sequence[float]) -> None:
    """Every number of the scene must be there again, bit for bit: a seed that something else than
    its own arithmetic has read would show here.

    Sections of flexible bodies are turned by numpy, which sums seeds in another order than floats:
    there a number may differ by rounding.
    """
    lost = Counter(plain) - Counter(found)
    others = sorted((Counter(found) - Counter(plain)).elements())
    for value in sorted(lost.elements()):
        reach = _ROUNDING * max(1.0, abs(value))
        near = bisect_left(others, value - reach)
        if near == len(others) or others[near] > value + reach:
            raise AssertionError(f"numbers of the scene have been lost: {sorted(lost)}")
        del others[near]


@dataclass(frozen=True)
class _Moving(Expression):
    """A number of the port "moving" in place of a constant expression."""

    number: Any
    place: int

    @property
    def is_zero(self) -> bool:
        """Never: a zero that moves is none."""
        return False

    def build(self, graph: Terms, resolve: Callable[[Name], Node]) -> Node:
        """The entry of the port."""
        return graph.element(MOVING, self.place)


def _with_seeds(scene: Scene, names: Sequence[str], seed: Seed) -> tuple[Scene, dict[int, Any]]:
    """The scene, not validated again, with a seed in place of every named number, and those of
    expressions by their places."""
    moving: dict[int, Any] = {}
    for k, name in enumerate(scene_parameters.resolve_names(scene, names)):

        def change(value: Any, k: int = k) -> Any:
            if isinstance(value, Expression):
                known = value.number if isinstance(value, _Moving) else value.evaluate(_unknown)
                moving[k] = seed(known, k)
                return _Moving(value.text, (), (), -1, moving[k], k)
            return seed(value, k)

        scene = _changed(scene, name, change)
    return scene, moving


def _unknown(_: Name) -> float:
    return math.nan


def _changed(scene: Scene, name: str, change: Change) -> Scene:
    parts: list[str | int] = [
        int(part[1:-1]) if part.startswith("[") else part for part in _PART.findall(name)
    ]
    fields: dict[str, Any] = {key: getattr(scene, key) for key in type(scene).model_fields}
    if parts[0] == "gravity":
        fields["gravity"] = _replaced(scene.gravity, parts[1:], change)
    else:
        for table in scene_parameters.TABLES:
            fields[table] = tuple(
                _element(element, parts[1:], change)
                if element.name == parts[0] and parts[1] in type(element).model_fields
                else element
                for element in fields[table]
            )
    # Constructed afresh: a copy would keep what the scene has cached of its old numbers.
    return Scene.model_construct(**fields)


def _element(element: BaseModel, parts: Sequence[str | int], change: Change) -> BaseModel:
    if isinstance(element, Hinge) and parts[0] == "parameters":
        _refuse_in_expression(element, str(parts[1]))
    changed = _replaced(element, parts, change)
    if isinstance(changed, Hinge) and parts[0] == "normal":
        return changed.model_copy(update={"axis": changed.normal})
    return changed


def _refuse_in_expression(hinge: Hinge, parameter: str) -> None:
    """Numbers of expressions are folded before they reach the kernel."""
    if any(name.quantity == parameter for effort in hinge.law.effort for name in effort.names):
        raise SceneError(
            f'parameter "{hinge.name}.parameters.{parameter}": an effort of the hinge is written '
            "with it, and numbers inside expressions have neither derivative nor formula; compare "
            "two models (with_parameters)"
        )


def _replaced(target: Any, parts: Sequence[str | int], change: Change) -> Any:
    """`target` with the number at the end of the path changed."""
    if not parts:
        return change(target)
    key, rest = parts[0], parts[1:]
    if isinstance(target, tuple):
        return tuple(_replaced(x, rest, change) if i == key else x for i, x in enumerate(target))
    if isinstance(target, Mapping):
        return {**target, key: _replaced(target[key], rest, change)}
    return target.model_copy(update={key: _replaced(getattr(target, str(key)), rest, change)})
