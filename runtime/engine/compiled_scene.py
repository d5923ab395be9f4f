"""Compiled scene: packed for the engines; basis of runs, results and models."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property
from typing import Any, Self

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure, SceneError
from mstmm.scene import Scene

from ..flexible.modal_body import ModalBody, modal_sizes, radius_of_gyration
from ..kernels import kernel_store
from ..kernels.prebuilt_kernels import Known
from ..packing import scene_parameters as named_parameters
from ..packing.coordinate_layout import Layout
from ..packing.packed_scene import PackedScene, resize_workspace
from ..packing.scene_packing import enable_product_sweep, pack, without_merging
from ..packing.simplification import LINKED, Simplification, SimplifyOptions
from .compiled_derivatives import LinearisationCode
from .fused_code import FusedCode, NoFusedCode
from .inputs import InputValue, apply_without_recompile, scene_with_inputs, with_input_values
from .looped_engine import LoopedEngine
from .loops.acceleration_refinement import count_tree_refinements
from .loops.independent_speeds import IndependentSpeeds
from .loops.loop_analysis import LoopStart

#: Options of a compilation: fused code, accuracy of the plain product, sweep, simplifications.
CompileOptions = tuple[
    Callable[[PackedScene, Known], FusedCode] | None, float | None, str, SimplifyOptions
]


class CompiledScene:
    """Scene compiled for evaluation.

    Attributes:
        scene: the given scene.
        known: elements that are not prebuilt, by (kind, name).
        looped: looped engine on the packed scene.
        fusion: fused code of the scene.
        loop_start: assembled closed loops; None for a tree.
        sweep: "riccati", "refined" or "qr".
    """

    def __init__(
        self,
        scene: Scene,
        known: Known | None = None,
        fusing: Callable[[PackedScene, Known], FusedCode] | None = None,
        product_accuracy: float | None = None,
        sweep: str = "riccati",
        simplify: SimplifyOptions = LINKED,
    ) -> None:
        self.scene = scene
        self._fusing, self._product_accuracy, self.sweep = fusing, product_accuracy, sweep
        self._simplify = simplify if product_accuracy is None else LINKED
        self.looped = LoopedEngine(
            pack(scene, known, product_accuracy, sweep=sweep, simplify=self._simplify)
        )
        self.known = self.packed_scene.elements.known
        self.loop_start: LoopStart | None = None
        if self.packed_scene.system.has_loops:
            try:
                self.loop_start = LoopStart(self.looped, len(self.free_speed_indices))
            except NumericalFailure as failure:
                raise SceneError(f"scene: {failure}") from None
            self.looped = self.loop_start.engine
            if product_accuracy is not None:
                enable_product_sweep(self.packed_scene, product_accuracy)
                resize_workspace(self.packed_scene, self.packed_scene.written.slots)
        elif self.packed_scene.refined:
            self.packed_scene.model.refines = count_tree_refinements(self.looped)
        self.fusion: FusedCode = fusing(self.packed_scene, self.known) if fusing else NoFusedCode()

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle the scene and its options; unpickling searches for compiled code again."""
        return _unpickle, (
            type(self),
            self.scene,
            self._compile_options,
            self.fusion.library is not None,
        )

    @property
    def _compile_options(self) -> CompileOptions:
        return self._fusing, self._product_accuracy, self.sweep, self._simplify

    @cached_property
    def unmerged_engine(self) -> LoopedEngine:
        """Looped engine without merging, for quantities of merged bodies or hinges."""
        packed = without_merging(self.packed_scene)
        if packed is self.packed_scene:
            return self.looped
        engine = LoopedEngine(packed)
        return (
            engine
            if self.loop_start is None
            else LoopStart(engine, len(self.free_speed_indices)).engine
        )

    @property
    def simplifications(self) -> tuple[Simplification, ...]:
        """Simplifications of the packed scene; they do not change its motion."""
        return self.packed_scene.simplified

    @property
    def packed_scene(self) -> PackedScene:
        """Packed scene; its numbers refer to internal frames."""
        return self.looped.packed

    @property
    def engine(self) -> str:
        """Engine in use: "fused" or "looped"."""
        return "looped" if self.fusion.library is None else "fused"

    @property
    def engine_reason(self) -> str:
        """Engine in use, with the reason."""
        fused_code = self.fusion
        if fused_code.library is not None:
            return f"fused: {fused_code.note}"
        if fused_code.obstacle:
            return f"looped: {fused_code.obstacle}"
        return "looped: fused code of this scene is not compiled yet; a long run or batch builds it"

    @property
    def coordinate_layout(self) -> Layout:
        """Layout of hinges and modes in q and u."""
        return self.packed_scene.layout

    @property
    def flexible_bodies(self) -> Mapping[str, ModalBody]:
        """Data of the flexible bodies by name: modes, moments, stiffness, interface nodes."""
        return self.packed_scene.flexible

    @cached_property
    def free_speed_indices(self) -> tuple[int, ...]:
        """Indices in u of the speeds that no drive prescribes."""
        indices = list[int]()
        for number, hinge in enumerate(self.packed_scene.scene.hinges):
            slots = self.coordinate_layout.slots(number)
            drive = hinge.drive or (None,) * slots.nu
            if not hinge.is_weld:
                indices += [slots.u + k for k in range(slots.nu) if drive[k] is None]
        for slots in self.coordinate_layout.modal.values():
            indices += range(slots.u, slots.u + slots.nu)
        return tuple(indices)

    @cached_property
    def tangent_increments(self) -> tuple[tuple[str, str], ...]:
        """Name and unit of the tangent increment of every free speed.

        If a speed is the rate of a coordinate, they are those of the coordinate.
        """
        names_and_units = list[tuple[str, str]]()
        for speed in self.free_speed_indices:
            slots = self.coordinate_layout.hinge_of_speed(speed)
            k = speed - slots.u
            if slots.rates_are_speeds:
                names_and_units.append((f"{slots.name}.{slots.q_names[k]}", slots.q_units[k]))
            else:
                unit = slots.u_units[k].removesuffix("/s")
                names_and_units.append((f"{slots.name}.{slots.u_names[k]}_increment", unit))
        return tuple(names_and_units)

    @cached_property
    def independent_speeds(self) -> IndependentSpeeds | None:
        """Independent speeds of closed loops; None for a tree."""
        if self.loop_start is None:
            return None
        return IndependentSpeeds(
            self.looped, self.free_speed_indices, speed_scales(self), self.loop_start
        )

    @cached_property
    def compiled_linearisation(self) -> LinearisationCode:
        """Linearisation of the scene by fused code."""
        return LinearisationCode(self.looped, self.fusion, self.free_speed_indices)

    @property
    def nq(self) -> int:
        """Number of coordinates."""
        return self.looped.nq

    @property
    def nu(self) -> int:
        """Number of speeds."""
        return self.looped.nu

    @property
    def parameters(self) -> dict[str, float]:
        """Values of all parameters of the scene by name, such as "rod1.mass"."""
        return named_parameters.scene_parameters(self.scene)

    def with_parameters(self, changes: Mapping[str, float]) -> Self:
        """Copy of this model with other parameter values.

        Recompilation is needed only if the model is fused and a number that was exactly zero (or an
        axis along a coordinate axis) changes; the new code is compiled or found in the cache.

        Raises SceneError for an unknown name (the nearest one is suggested) or an invalid value.
        """
        return self._with(named_parameters.with_parameters(self.scene, changes))

    def with_inputs(self, inputs: Mapping[str, InputValue]) -> Self:
        """Copy of this model with other inputs, by name; nothing is recompiled.

        An input is a number, the name of a signal of the scene, (times, values) with increasing
        times (s) and linear interpolation, or the keys of a [[signal]] that it follows:
        {"times": ..., "values": ..., "interpolation": "cubic"}.

        Raises SceneError for an unknown name (the nearest one is suggested) or an invalid value.
        """
        values = apply_without_recompile(self.scene, inputs)
        if values is not None:
            return self.with_packed_scene(with_input_values(self.packed_scene, values))
        return self._with(scene_with_inputs(self.scene, inputs))

    def with_packed_scene(self, packed: PackedScene) -> Self:
        """Copy of this model for a packed scene with other inputs, without validation.

        The packed scene must match the existing compiled code.
        """
        attributes = {
            name: value for name, value in vars(self).items()
            if not isinstance(getattr(type(self), name, None), cached_property)
        }  # fmt: skip
        copy = object.__new__(type(self))
        copy.__dict__.update(attributes, scene=packed.user_scene, looped=LoopedEngine(packed))
        copy.fusion = self.fusion.for_system(packed.system)
        return copy

    def _with(self, scene: Scene) -> Self:
        """Compile the same scene with other numbers and the same options."""
        recompiled = type(self)(scene, self.known, *self._compile_options)
        recompiled.fusion.follow(self.fusion)
        return recompiled


def _unpickle(
    kind: type[CompiledScene], scene: Scene, options: CompileOptions, fused: bool
) -> CompiledScene:
    """Restore a pickled model, with its fused code if the local cache contains it."""
    known, definitions = kernel_store.load_known(kernel_store.required_types(scene))
    scene.check_types(definitions)
    model = kind(scene, known, *options)
    if fused:
        model.fusion.find()
    return model


#: Scene length below which distances are rounding errors: relative to the largest radius of
#: gyration, and in m if all masses are points.
_MIN_LENGTH_RATIO, _MIN_LENGTH_M = 1e-3, 1e-5


def speed_scales(model: CompiledScene) -> Array:
    """Characteristic scales (nu,) of the speeds: 1 rad, the scene length (m), or modal sizes."""
    layout, scales = model.coordinate_layout, np.ones(model.nu)
    length = scene_length(model)
    for slots in layout.hinges.values():
        is_length = [unit.startswith("m") for unit in slots.u_units]
        scales[slots.u_slice] = np.where(is_length, length, 1.0)
    for name, slots in layout.modal.items():
        scales[slots.u_slice] = modal_sizes(model.flexible_bodies[name])
    return scales


def scene_length(model: CompiledScene) -> float:
    """Largest distance within a body or between successive hinges, m.

    It is 1 if all distances are zero or rounding errors relative to the radii of gyration.
    """
    scene = model.scene
    positions = [hinge.position for hinge in scene.hinge]
    positions += [chain.position for chain in scene.chain]
    for body in (*scene.body, *(inner_body for chain in scene.chain for inner_body in chain.body)):
        positions += [body.center_of_mass, *(end.position for end in body.ends.values())]
    lengths = [float(np.linalg.norm(position)) for position in positions]
    lengths += [radius_of_gyration(body) for body in model.flexible_bodies.values()]
    length = max(lengths, default=0.0)
    rigid = [body for body in scene.bodies.by_name.values() if hasattr(body, "inertia")]
    radii = [
        np.sqrt(sum(inner_body.inertia[:3]) / 2 / inner_body.mass)
        for inner_body in rigid
        if inner_body.mass > 0
    ]
    radius = float(max(radii, default=0.0))
    min_length = _MIN_LENGTH_RATIO * radius if radius else _MIN_LENGTH_M
    return length if length > min_length else 1.0


def total_mass(model: CompiledScene) -> float:
    """Mass of all moving bodies, kg."""
    scene = model.scene
    mass = sum(body.mass for body in scene.body)
    mass += sum(chain.body_of(k).mass for chain in scene.chain for k in range(chain.count))
    for body in model.flexible_bodies.values():
        mass += sum(point.mass for point in body.points) if body.points else float(body.mass)
    return mass


def total_weight(model: CompiledScene) -> float:
    """Weight of all moving bodies, N."""
    return total_mass(model) * float(np.linalg.norm(model.scene.gravity))
