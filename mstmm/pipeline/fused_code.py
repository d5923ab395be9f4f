"""Fused code of one scene: found in the cache, built when that pays off, or impossible.

The structure and the numbers come from runtime, the source text from derive, the library from the
cache.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from copy import copy
from dataclasses import dataclass, replace
from functools import cache, partial
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Self

import numpy as np

from mstmm.runtime.kernels.scene_libraries import (
    DerivativeLibrary,
    FusedLibrary,
    open_derivative_library,
    open_library,
)

from ..abi import derivative_library as columns_abi
from ..abi.fused_library import ABI_VERSION, COMPILER_FLAGS, OPTIONAL_FLAGS
from ..errors import ElementError, EnvironmentFailure, SceneError
from ..ir import KernelIR
from ..ir.element_spec import ElementSpec, builtin_kernel
from ..ir.scene_structure import BodyStructure, Key, Structure
from ..runtime.libraries.cache import BuiltLibrary, Recipe, find, open_cached_library
from ..runtime.packing.fused_structure import structure_of

if TYPE_CHECKING:
    from mstmm.runtime.engine.inputs import IndexPairs
    from mstmm.runtime.kernels.prebuilt_kernels import Known

    from ..derive.fuse.scene_kernels import FusedSceneIR
    from ..runtime.linear.linear_equations import LinearEquations
    from ..runtime.linear.mck_matrices import SymbolicLinearModel
    from ..runtime.packing.packed_scene import PackedScene
    from ..runtime.packing.system import System

#: Largest number of bodies (including ends and sections of flexible bodies) that are fused unless
#: the user requires it.  Beyond it compilers take seconds (of CPU, on two busy cores: 7 for 64
#: pins, 9 for 100), and the gain is smaller (half of the evaluation time remains at 100 pins, four
#: fifths at 100 balls).
DEFAULT_MAX_BODIES = 100
#: Largest number of bodies that can be fused at all: 400 pins take half a minute of CPU.
MAX_BODIES = 400
#: Seconds that a compiler takes for the scalar code, by bodies, and seconds that one evaluation
#: saves per body; measured, see benchmarks/startup.  Only their ratio matters, and
#: only for the choice of engine "auto"; fixed numbers, so that the choice is the same on every run.
_COMPILE_SECONDS, _COMPILE_SECONDS_PER_BODY = 0.1, 0.04
_SECONDS_SAVED_PER_BODY = 6e-8
#: Calls for points of a body that justify a library where fused code is required: every body needs
#: a separate library.
_MIN_POINT_CALLS = 128
#: Largest number of unknowns with a fused tangent matrix, whose cost grows with their square; more
#: are eliminated body by body, by the looped engine.
_MAX_UNKNOWNS = 20
#: The same limit for matrices of a linear model, in pairs of speeds of which one moves the hinge of
#: the other: that of 28 pins in a row, or a humanoid of 38 speeds.  They compile in 10 to 20 s.
_MAX_SPEED_PAIRS = 406
#: A frame or section of a flexible body with n shapes compiles like 1 + n^2 / this many bodies.
_MODES_PER_BODY = 24
#: A hinge passed by n constraint rows of loops compiles like n^2 / this many bodies.
_ROWS_PER_BODY = 32

#: Folders of the code that prints fused code; with structure and kernels they determine its text.
PRINTER_FOLDERS = {"mstmm": ("abi", "ir"), "mstmm.derive": ("fuse", "codegen", "schedule")}


class Fusion:
    """Fused libraries of one packed scene.

    `numbers` is the vector p that they read, `inputs` the indices of inputs in it.
    """

    def __init__(
        self,
        packed: PackedScene,
        known: Known,
        definitions: Mapping[Key, ElementSpec],
        obstacle: str = "",
        bake: bool = False,
        most: int = DEFAULT_MAX_BODIES,
    ) -> None:
        user_specs = {
            key: element.spec for key, element in known.items() if element.spec is not None
        }
        self._definitions = {**definitions, **user_specs}
        self.obstacle = obstacle or _obstacle(packed, most)
        self.libraries: dict[str, FusedLibrary] = {}
        self.note = ""
        self._is_required = False  # engine="fused": batches too
        self.inputs: IndexPairs = ()
        if not self.obstacle:
            self.structure, self.numbers = structure_of(packed.system, known, bake, packed.floors)
            self.structure = replace(self.structure, refines=int(packed.model.refines))
            self.inputs = self.structure.inputs
            self.obstacle = _loop_obstacle(self.structure, most)
        self._is_always_looped = bool(self.obstacle)

    @property
    def library(self) -> FusedLibrary | None:
        """Scalar library if it has been found or built, else None; the others likewise."""
        return self.libraries.get("scalar")

    @property
    def lanes(self) -> FusedLibrary | None:
        return self.libraries.get("lanes")

    @property
    def implicit(self) -> FusedLibrary | None:
        return self.libraries.get("implicit")

    @property
    def inverse(self) -> FusedLibrary | None:
        return self.libraries.get("inverse")

    def find(self) -> FusedLibrary | None:
        """Find the scalar library in the cache; no compiler is started."""
        return self._get("scalar", build=False)

    def build(self) -> FusedLibrary:
        """Build the scalar library, unless it is in the cache.

        Raises SceneError if such a scene cannot have fused code, EnvironmentFailure if there is no
        compiler or it fails.
        """
        self._is_required = True
        library = self._get("scalar", build=True)
        if library is None and self._is_always_looped:
            raise SceneError(
                f'scene: no fused code: {self.obstacle}; use engine = "auto" or "looped"'
            )
        if library is None:
            raise EnvironmentFailure(f"this scene cannot be fused: {self.obstacle}")
        return library

    def follow(self, other: Fusion) -> None:
        """Use the libraries of the same scene with other numbers.

        If a structural zero has changed, another library is needed: it is compiled if `other` has
        one.  Without a compiler the scene falls back to the looped engine, with a note.
        """
        if self.obstacle or other.obstacle:
            return
        if self.structure == other.structure:
            self.libraries, self.note = other.libraries, other.note
        elif other.library is not None:
            try:
                self.build()
            except EnvironmentFailure as error:
                self.obstacle = str(error)

    def for_system(self, system: System) -> Self:
        """Fusion of a system that differs from this one only in its inputs."""
        fusion = copy(self)
        if not self.obstacle:
            start = system.inputs_at(0.0)
            fusion.numbers = np.array(self.numbers)
            for entry, index in self.inputs:
                fusion.numbers[index] = start[entry]
        return fusion

    def ready(self, evaluations: float) -> FusedLibrary | None:
        """Scalar library if available, or if so many evaluations justify a compilation."""
        return self._ready("scalar", evaluations)

    def ready_lanes(self, evaluations: float) -> FusedLibrary | None:
        """Library that evaluates several states at once in lanes, under the same condition.

        After `build` it is compiled whatever the number of evaluations; raises EnvironmentFailure
        if that fails.
        """
        if self._is_required:
            return self._get("lanes", build=True)
        return self._ready("lanes", evaluations)

    def ready_implicit(self, evaluations: float) -> FusedLibrary | None:
        """Library of residual and tangent matrix for implicit methods, if the evaluations pay off.

        An unknown number of evaluations (inf) pays off only after `build`.  None where the looped
        engine is used instead: for large scenes, closed loops, and if it cannot be compiled.
        """
        is_worthwhile = self._break_even() < evaluations < math.inf
        return self._small_scene_library("implicit", is_worthwhile)

    def ready_linear(self, pays: bool) -> FusedLibrary | None:
        """Library of derivatives about a state for linear models; the caller decides if it pays."""
        if not self.obstacle and self.structure.nu > _MAX_UNKNOWNS:
            has_few_pairs = _speed_pair_count(self.structure) <= _MAX_SPEED_PAIRS
            return self._tree_library("linear", pays) if has_few_pairs else None
        return self._small_scene_library("linear", pays)

    def ready_inverse(self, calls: float) -> FusedLibrary | None:
        """Library of inverse dynamics and mass matrix, for trees without prescribed motion."""
        if self.obstacle or not self.structure.nu or self.structure.drives is not None:
            return None
        return self._tree_library("inverse", calls > self._break_even())

    def ready_points(self, body: int, calls: float) -> FusedLibrary | None:
        """Library of the kinematics of points of a body; closed loops do not matter."""
        if self.obstacle or body < 0 or not self.structure.nu:
            return None
        min_calls = _MIN_POINT_CALLS if self._is_required else self._break_even()
        return self._find_or_build(f"points {body}", build=calls >= min_calls)

    def _small_scene_library(self, part: str, pays: bool) -> FusedLibrary | None:
        if self.obstacle or not 0 < self.structure.nu <= _MAX_UNKNOWNS:
            return None
        return self._tree_library(part, pays)

    def _tree_library(self, part: str, pays: bool) -> FusedLibrary | None:
        return (
            None if self.structure.closes else self._find_or_build(part, self._is_required or pays)
        )

    def _find_or_build(self, part: str, build: bool) -> FusedLibrary | None:
        try:
            return self._get(part, build)
        except EnvironmentFailure:
            return None

    def _ready(self, part: str, evaluations: float) -> FusedLibrary | None:
        library = self._get(part, build=False)
        if library is None and not self.obstacle and evaluations > self._break_even():
            try:
                library = self._get(part, build=True)
            except EnvironmentFailure as error:
                self.obstacle = self.note = str(error)
        return library

    def _break_even(self) -> float:
        modes = mode_counts(self.structure)
        n = sum(1 + count**2 / _MODES_PER_BODY for count in modes)
        seconds = _COMPILE_SECONDS + n * _COMPILE_SECONDS_PER_BODY
        return seconds / (_SECONDS_SAVED_PER_BODY * max(1, sum(1 + 2 * count for count in modes)))

    def _get(self, part: str, build: bool) -> FusedLibrary | None:
        library = self.libraries.get(part)
        if library is not None or self.obstacle:
            return library
        recipe = self._recipe(part)
        try:
            cached_path = None if build else find(recipe)
            if build or cached_path is not None:
                library, built = open_cached_library(recipe, open_library, known=cached_path)
                self.note = _cache_note(built)
        except EnvironmentFailure:
            if build:
                raise
        if library is not None:
            self.libraries[part] = library
        return library

    def _recipe(self, part: str) -> Recipe:
        identity = {
            "structure": self.structure.identity(), "part": part, "abi": str(ABI_VERSION),
            "printers": _printers_hash(), "kernels": _manifest_hash(),
        }  # fmt: skip
        sources = partial(self._sources, part)
        return Recipe("fused", identity, sources, COMPILER_FLAGS, optional=OPTIONAL_FLAGS)

    def _sources(self, part: str, key: str) -> dict[str, str]:
        from ..derive.codegen.scene_text import fused_sources

        purpose, _, body = part.partition(" ")
        if purpose == "points":
            fused_ir = self.fused_points(self.structure, int(body))
        else:
            fuse_structure = {
                "implicit": self.fused_implicit, "linear": self.fused_linear,
                "inverse": self.fused_inverse,
            }.get(purpose, self.structure_ir)  # fmt: skip
            fused_ir = fuse_structure(self.structure)
        return fused_sources(fused_ir, key, part)

    def columns(
        self,
        structure: Structure,
        kernels: Callable[[], Sequence[KernelIR]],
        what: str,
        build: bool,
    ) -> DerivativeLibrary | None:
        """Library of derivative kernels (named by `what`) of a structure; None if there is none.

        Without `build` it is only searched in the cache.  Raises EnvironmentFailure if it cannot be
        built.
        """
        if self.obstacle:
            return None

        def sources(key: str) -> dict[str, str]:
            from ..derive.codegen.derivative_lanes import derivative_sources

            return derivative_sources(kernels(), key)

        identity = {
            "structure": structure.identity(),
            "part": f"columns {what}",
            "abi": str(columns_abi.ABI_VERSION),
            "printers": _printers_hash(),
            "kernels": _manifest_hash(),
        }
        recipe = Recipe(
            "columns", identity, sources, COMPILER_FLAGS, (columns_abi.SYMBOL,), OPTIONAL_FLAGS
        )
        cached_path = None if build else find(recipe)
        if not build and cached_path is None:
            return None
        return open_cached_library(recipe, open_derivative_library, known=cached_path)[0]

    def solution(self, build: bool) -> DerivativeLibrary | None:
        """Library that solves with the mass matrix of a tree; errors as for `columns`."""
        if self.obstacle or self.structure.closes or self.structure.refines:
            return None

        def kernels() -> Sequence[KernelIR]:
            from ..derive.fuse.scene_kernels import fuse_solution

            return [fuse_solution(self.structure, kernel_lookup(self._definitions))]

        return self.columns(self.structure, kernels, "solution", build)

    def structure_ir(self, structure: Structure) -> FusedSceneIR:
        """IR of a structure with the elements of this scene; no compiler, no cache."""
        from ..derive.fuse.scene_kernels import fuse

        return fuse(structure, kernel_lookup(self._definitions))

    def fused_implicit(self, structure: Structure) -> FusedSceneIR:
        """IR of residual and tangent matrix for implicit methods."""
        from ..derive.fuse.implicit_residual import fuse_implicit

        return fuse_implicit(structure, kernel_lookup(self._definitions))

    def fused_linear(self, structure: Structure) -> FusedSceneIR:
        """IR of derivatives about a state."""
        from ..derive.fuse.linearisation import fuse_slopes

        return fuse_slopes(structure, kernel_lookup(self._definitions))

    def fused_inverse(self, structure: Structure) -> FusedSceneIR:
        """IR of inverse dynamics and the mass matrix."""
        from ..derive.fuse.scene_kernels import fuse_inverse

        return fuse_inverse(structure, kernel_lookup(self._definitions))

    def fused_points(self, structure: Structure, body: int) -> FusedSceneIR:
        """IR of the kinematics of points of one body."""
        from ..derive.fuse.point_kinematics import fuse_points

        return fuse_points(structure, kernel_lookup(self._definitions), body)

    def symbolic(self, linear: LinearEquations, keep: Sequence[str]) -> SymbolicLinearModel:
        """Linear model in SymPy, without a compiler; see `LinearEquations.symbolic`."""
        from .symbolic_linear_model import symbolic_linear_model

        return symbolic_linear_model(linear, keep, kernel_lookup(self._definitions))


@dataclass(frozen=True)
class FusionFactory:
    """Factory of `Fusion`: picklable settings of fused code, stored with a model."""

    definitions: Mapping[Key, ElementSpec]
    obstacle: str
    bake: bool
    max_bodies: int

    def __call__(self, packed: PackedScene, known: Known) -> Fusion:
        return Fusion(packed, known, self.definitions, self.obstacle, self.bake, self.max_bodies)


def mode_counts(structure: Structure) -> list[int]:
    """Number of modes in the equations or the connection of each body."""

    def count(body: BodyStructure) -> int:
        frame = body if body.section is None else structure.bodies[body.section.frame]
        return 0 if frame.modal is None or body.idle else frame.modal.n

    return [count(body) for body in structure.bodies]


def _cache_note(built: BuiltLibrary) -> str:
    suffix = f"; {built.note}" if built.note else ""
    if built.how == "cached":
        return f"its code was in the cache{suffix}"
    return f"its code was compiled in {built.seconds:.2f} s and stored in the cache{suffix}"


def _speed_pair_count(structure: Structure) -> int:
    """Number of pairs of speeds of which one moves the hinge of the other.

    All pairs count where bodies are flexible.
    """
    if any(body.modal for body in structure.bodies):
        return structure.nu**2
    inboard_speed_counts: list[int] = []
    for body in structure.bodies:
        inboard_speed_counts.append(
            body.nu + (inboard_speed_counts[body.parent] if body.parent >= 0 else 0)
        )
    return sum(
        body.nu * inboard_speeds
        for body, inboard_speeds in zip(structure.bodies, inboard_speed_counts, strict=True)
    )


def _obstacle(packed: PackedScene, most: int) -> str:
    """Reason why a scene cannot be fused, or ""."""
    count = packed.system.count
    if packed.releases:
        names = ", ".join(f'"{name}"' for name in packed.releases)
        return f"hinge {names} is released during the run, which changes the structure"
    if count > most:
        hint = f' ({MAX_BODIES} with engine = "fused")' if most < MAX_BODIES else ""
        return f"it has {count} bodies; the limit of fused code is {most}{hint}"
    if packed.product is not None:
        return "the product of classical matrices exists only in the looped engine"
    if packed.qr:
        return "the least-squares sweep exists only in the looped engine"
    if packed.model.refines and packed.system.has_loops:
        return (
            "heavy bodies outboard of light ones need refinement, which exists for closed loops "
            "only in the looped engine"
        )
    hinges = (packed.elements[body.hinge] for body in packed.system.distinct)
    if any(hinge.tape is not None and hinge.spec is None for hinge in hinges):
        return "a hinge is interpreted because it was generated without a compiler"
    return ""


def _loop_obstacle(structure: Structure, most: int) -> str:
    """Reason why code of closed loops would be too long, or ""."""
    rows = sum(len(body.pending) ** 2 + len(body.bent) ** 2 for body in structure.bodies)
    size = len(structure.bodies) + rows // _ROWS_PER_BODY
    if size <= most:
        return ""
    return f"its closed loops make it like {size} bodies; the limit of fused code is {most}"


def printer_files() -> list[Path]:
    """Python files in the folders of PRINTERS, sorted by name."""
    folders = [
        Path(str(files(room).joinpath(name)))
        for room in PRINTER_FOLDERS
        for name in PRINTER_FOLDERS[room]
    ]
    return [path for folder in folders for path in sorted(folder.rglob("*.py"))]


@cache
def _printers_hash() -> str:
    digest = hashlib.sha256()
    for path in printer_files():
        digest.update(path.read_bytes())
    for path in sorted(Path(str(files("mstmm.templates"))).glob("fused_*.c")):
        digest.update(path.read_bytes())
    return digest.hexdigest()


@cache
def _manifest_hash() -> str:
    return hashlib.sha256(
        files("mstmm.generated").joinpath("manifest.json").read_bytes()
    ).hexdigest()


def kernel_lookup(definitions: Mapping[Key, ElementSpec]) -> Callable[[Key, str], KernelIR]:
    """Function that returns a kernel by element and name.

    It searches user-defined elements, then the prebuilt ones, and raises ElementError if there is
    no such kernel.
    """

    def kernel(key: Key, name: str) -> KernelIR:
        with suppress(KeyError):
            if key not in definitions:
                return builtin_kernel("_".join(key), name)
            return {k.name: k for k in definitions[key].kernels}[name]
        raise ElementError(f"{key[0]} {key[1]} has no kernel {name!r}")

    return kernel
