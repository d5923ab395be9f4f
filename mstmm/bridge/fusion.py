"""Fused code of one scene: found in the cache, built when that pays off, or impossible.

The structure and the numbers come from runtime, the source text from derive, the library from the
cache.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cache, partial
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from ..border import columns as columns_abi
from ..border.fused import ABI, FLAGS, TUNING
from ..errors import ElementError, EnvironmentFailure, SceneError
from ..ir import KernelIR, from_json
from ..ir.spec import ElementSpec
from ..ir.structure import BodyStructure, Key, Structure
from ..runtime.kernels.columns import ColumnsLibrary, open_columns
from ..runtime.kernels.fused import FusedLibrary, open_library
from ..runtime.libraries.cache import Built, Recipe, find, opened
from ..runtime.pack.structure import structure_of

if TYPE_CHECKING:
    from ..derive.fuse.scene import Fused
    from ..runtime.engine.live import Places
    from ..runtime.linear.equations import Equations
    from ..runtime.linear.symbolic import Symbolic
    from ..runtime.pack.elements import Known
    from ..runtime.pack.packed import Packed
    from ..runtime.pack.system import System

#: Largest number of bodies (including ends and sections of flexible bodies) that are fused unless
#: the user requires it.  Beyond it compilers take seconds (of CPU, on two busy cores: 7 for 64
#: pins, 9 for 100), and the gain is smaller (half of the evaluation time remains at 100 pins, four
#: fifths at 100 balls).
MOST_BODIES = 100
#: Largest number of bodies that can be fused at all: 400 pins take half a minute of CPU.
MOST_ASKED = 400
#: Seconds that a compiler takes for the scalar code, by bodies, and seconds that one evaluation
#: saves per body; measured, see benchmarks/startup.  Only their ratio matters, and
#: only for the choice of engine "auto"; fixed numbers, so that the choice is the same on every run.
_SECONDS, _SECONDS_PER_BODY = 0.1, 0.04
_SAVED_PER_BODY = 6e-8
#: Calls for points of a body that justify a library where fused code is required: every body needs
#: a separate library.
_OFTEN = 128
#: Largest number of unknowns with a fused tangent matrix, whose cost grows with their square; more
#: are eliminated body by body, by the looped engine.
_MOST_UNKNOWNS = 20
#: The same limit for matrices of a linear model, in pairs of speeds of which one moves the hinge of
#: the other: that of 28 pins in a row, or a humanoid of 38 speeds.  They compile in 10 to 20 s.
_MOST_PAIRS = 406
#: A frame or section of a flexible body with n shapes compiles like 1 + n^2 / this many bodies.
_MODES_PER_BODY = 24
#: A hinge passed by n constraint rows of loops compiles like n^2 / this many bodies.
_ROWS_PER_BODY = 32

#: Folders of the code that prints fused code; with structure and kernels they determine its text.
PRINTERS = {
    "mstmm": ("border", "ir"),
    "mstmm.derive": ("fuse", "print", "schedule"),
}


class Fusion:
    """Fused libraries of one packed scene.

    `numbers` is the vector p that they read, `inputs` the indices of inputs in it.
    """

    def __init__(
        self,
        packed: Packed,
        known: Known,
        definitions: Mapping[Key, ElementSpec],
        obstacle: str = "",
        bake: bool = False,
        most: int = MOST_BODIES,
    ) -> None:
        made = {key: one.spec for key, one in known.items() if one.spec is not None}
        self._definitions = {**definitions, **made}
        self.obstacle = obstacle or _obstacle(packed, most)
        self.made: dict[str, FusedLibrary] = {}
        self.note = ""
        self._insisted = False  # engine="fused": batches too
        self.inputs: Places = ()
        if not self.obstacle:
            self.structure, self.numbers = structure_of(packed.system, known, bake, packed.floors)
            self.structure = replace(self.structure, refines=int(packed.model.refines))
            self.inputs = self.structure.inputs
            self.obstacle = _too_wide(self.structure, most)
        self._looped_by_nature = bool(self.obstacle)

    @property
    def library(self) -> FusedLibrary | None:
        """Scalar library if it has been found or built, else None; the others likewise."""
        return self.made.get("scalar")

    @property
    def lanes(self) -> FusedLibrary | None:
        return self.made.get("lanes")

    @property
    def implicit(self) -> FusedLibrary | None:
        return self.made.get("implicit")

    @property
    def inverse(self) -> FusedLibrary | None:
        return self.made.get("inverse")

    def find(self) -> FusedLibrary | None:
        """Find the scalar library in the cache; no compiler is started."""
        return self._get("scalar", build=False)

    def build(self) -> FusedLibrary:
        """Build the scalar library, unless it is in the cache.

        Raises SceneError if such a scene cannot have fused code, EnvironmentFailure if there is no
        compiler or it fails.
        """
        self._insisted = True
        found = self._get("scalar", build=True)
        if found is None and self._looped_by_nature:
            raise SceneError(
                f'scene: no fused code: {self.obstacle}; use engine = "auto" or "looped"'
            )
        if found is None:
            raise EnvironmentFailure(f"this scene cannot be fused: {self.obstacle}")
        return found

    def follow(self, other: Fusion) -> None:
        """Use the libraries of the same scene with other numbers.

        If a structural zero has changed, another library is needed: it is compiled if `other` has
        one.  Without a compiler the scene falls back to the looped engine, with a note.
        """
        if self.obstacle or other.obstacle:
            return
        if self.structure == other.structure:
            self.made, self.note = other.made, other.note
        elif other.library is not None:
            try:
                self.build()
            except EnvironmentFailure as error:
                self.obstacle = str(error)

    def under(self, system: System) -> Self:
        """Fusion of a system that differs from this one only in its inputs."""
        found = copy(self)
        if not self.obstacle:
            start = system.inputs_at(0.0)
            found.numbers = np.array(self.numbers)
            for entry, place in self.inputs:
                found.numbers[place] = start[entry]
        return found

    def ready(self, evaluations: float) -> FusedLibrary | None:
        """Scalar library if available, or if so many evaluations justify a compilation."""
        return self._ready("scalar", evaluations)

    def ready_lanes(self, evaluations: float) -> FusedLibrary | None:
        """Library that evaluates several states at once in lanes, under the same condition.

        After `build` it is compiled whatever the number of evaluations; raises EnvironmentFailure
        if that fails.
        """
        if self._insisted:
            return self._get("lanes", build=True)
        return self._ready("lanes", evaluations)

    def ready_implicit(self, evaluations: float) -> FusedLibrary | None:
        """Library of residual and tangent matrix for implicit methods, if the evaluations pay off.

        An unknown number of evaluations (inf) pays off only after `build`.  None where the looped
        engine is used instead: for large scenes, closed loops, and if it cannot be compiled.
        """
        pays = self._break_even() < evaluations < math.inf
        return self._of_small("implicit", pays)

    def ready_linear(self, pays: bool) -> FusedLibrary | None:
        """Library of derivatives about a state for linear models; the caller decides if it pays."""
        if not self.obstacle and self.structure.nu > _MOST_UNKNOWNS:
            few = _pairs(self.structure) <= _MOST_PAIRS
            return self._of_trees("linear", pays) if few else None
        return self._of_small("linear", pays)

    def ready_inverse(self, calls: float) -> FusedLibrary | None:
        """Library of inverse dynamics and mass matrix, for trees without prescribed motion."""
        if self.obstacle or not self.structure.nu or self.structure.drives is not None:
            return None
        return self._of_trees("inverse", calls > self._break_even())

    def ready_points(self, body: int, calls: float) -> FusedLibrary | None:
        """Library of the kinematics of points of a body; closed loops do not matter."""
        if self.obstacle or body < 0 or not self.structure.nu:
            return None
        enough = _OFTEN if self._insisted else self._break_even()
        return self._sought(f"points {body}", build=calls >= enough)

    def _of_small(self, part: str, pays: bool) -> FusedLibrary | None:
        if self.obstacle or not 0 < self.structure.nu <= _MOST_UNKNOWNS:
            return None
        return self._of_trees(part, pays)

    def _of_trees(self, part: str, pays: bool) -> FusedLibrary | None:
        return None if self.structure.closes else self._sought(part, self._insisted or pays)

    def _sought(self, part: str, build: bool) -> FusedLibrary | None:
        try:
            return self._get(part, build)
        except EnvironmentFailure:
            return None

    def _ready(self, part: str, evaluations: float) -> FusedLibrary | None:
        found = self._get(part, build=False)
        if found is None and not self.obstacle and evaluations > self._break_even():
            try:
                found = self._get(part, build=True)
            except EnvironmentFailure as error:
                self.obstacle = self.note = str(error)
        return found

    def _break_even(self) -> float:
        modes = modes_at(self.structure)
        n = sum(1 + count**2 / _MODES_PER_BODY for count in modes)
        seconds = _SECONDS + n * _SECONDS_PER_BODY
        return seconds / (_SAVED_PER_BODY * max(1, sum(1 + 2 * count for count in modes)))

    def _get(self, part: str, build: bool) -> FusedLibrary | None:
        found = self.made.get(part)
        if found is not None or self.obstacle:
            return found
        recipe = self._recipe(part)
        try:
            known = None if build else find(recipe)
            if build or known is not None:
                found, built = opened(recipe, open_library, known=known)
                self.note = _note(built)
        except EnvironmentFailure:
            if build:
                raise
        if found is not None:
            self.made[part] = found
        return found

    def _recipe(self, part: str) -> Recipe:
        identity = {
            "structure": self.structure.identity(), "part": part, "abi": str(ABI),
            "printers": _printers_hash(), "kernels": _manifest_hash(),
        }  # fmt: skip
        sources = partial(self._sources, part)
        return Recipe("fused", identity, sources, FLAGS, optional=TUNING)

    def _sources(self, part: str, key: str) -> dict[str, str]:
        from ..derive.print.scene import fused_sources

        what, _, body = part.partition(" ")
        if what == "points":
            found = self.fused_points(self.structure, int(body))
        else:
            make = {
                "implicit": self.fused_implicit, "linear": self.fused_linear,
                "inverse": self.fused_inverse,
            }.get(what, self.fused)  # fmt: skip
            found = make(self.structure)
        return fused_sources(found, key, part)

    def columns(
        self,
        structure: Structure,
        kernels: Callable[[], Sequence[KernelIR]],
        what: str,
        build: bool,
    ) -> ColumnsLibrary | None:
        """Library of derivative kernels (named by `what`) of a structure; None if there is none.

        Without `build` it is only searched in the cache.  Raises EnvironmentFailure if it cannot be
        built.
        """
        if self.obstacle:
            return None

        def sources(key: str) -> dict[str, str]:
            from ..derive.print.columns import columns_sources

            return columns_sources(kernels(), key)

        identity = {
            "structure": structure.identity(), "part": f"columns {what}",
            "abi": str(columns_abi.ABI), "printers": _printers_hash(), "kernels": _manifest_hash(),
        }  # fmt: skip
        recipe = Recipe("columns", identity, sources, FLAGS, (columns_abi.SYMBOL,), TUNING)
        known = None if build else find(recipe)
        if not build and known is None:
            return None
        return opened(recipe, open_columns, known=known)[0]

    def solution(self, build: bool) -> ColumnsLibrary | None:
        """Library that solves with the mass matrix of a tree; errors as for `columns`."""
        if self.obstacle or self.structure.closes or self.structure.refines:
            return None

        def kernels() -> Sequence[KernelIR]:
            from ..derive.fuse.scene import fuse_solution

            return [fuse_solution(self.structure, kernels_of(self._definitions))]

        return self.columns(self.structure, kernels, "solution", build)

    def fused(self, structure: Structure) -> Fused:
        """IR of a structure with the elements of this scene; no compiler, no cache."""
        from ..derive.fuse.scene import fuse

        return fuse(structure, kernels_of(self._definitions))

    def fused_implicit(self, structure: Structure) -> Fused:
        """IR of residual and tangent matrix for implicit methods."""
        from ..derive.fuse.implicit import fuse_implicit

        return fuse_implicit(structure, kernels_of(self._definitions))

    def fused_linear(self, structure: Structure) -> Fused:
        """IR of derivatives about a state."""
        from ..derive.fuse.linear import fuse_slopes

        return fuse_slopes(structure, kernels_of(self._definitions))

    def fused_inverse(self, structure: Structure) -> Fused:
        """IR of inverse dynamics and the mass matrix."""
        from ..derive.fuse.inverse import fuse_inverse

        return fuse_inverse(structure, kernels_of(self._definitions))

    def fused_points(self, structure: Structure, body: int) -> Fused:
        """IR of the kinematics of points of one body."""
        from ..derive.fuse.points import fuse_points

        return fuse_points(structure, kernels_of(self._definitions), body)

    def symbolic(self, linear: Equations, keep: Sequence[str]) -> Symbolic:
        """Linear model in SymPy, without a compiler; see `Equations.symbolic`."""
        from .symbolic import symbolic

        return symbolic(linear, keep, kernels_of(self._definitions))


@dataclass(frozen=True)
class Fuser:
    """Factory of `Fusion`: picklable settings of fused code, stored with a model."""

    definitions: Mapping[Key, ElementSpec]
    obstacle: str
    bake: bool
    most: int

    def __call__(self, packed: Packed, known: Known) -> Fusion:
        return Fusion(packed, known, self.definitions, self.obstacle, self.bake, self.most)


def modes_at(structure: Structure) -> list[int]:
    """Number of modes in the equations or the connection of each body."""

    def count(body: BodyStructure) -> int:
        frame = body if body.section is None else structure.bodies[body.section.frame]
        return 0 if frame.modal is None or body.idle else frame.modal.n

    return [count(body) for body in structure.bodies]


def _note(built: Built) -> str:
    more = f"; {built.note}" if built.note else ""
    if built.how == "cached":
        return f"its code was in the cache{more}"
    return f"its code was compiled in {built.seconds:.2f} s and stored in the cache{more}"


def _pairs(structure: Structure) -> int:
    """Number of pairs of speeds of which one moves the hinge of the other.

    All pairs count where bodies are flexible.
    """
    if any(body.modal for body in structure.bodies):
        return structure.nu**2
    inboard: list[int] = []
    for body in structure.bodies:
        inboard.append(body.nu + (inboard[body.parent] if body.parent >= 0 else 0))
    return sum(body.nu * above for body, above in zip(structure.bodies, inboard, strict=True))


def _obstacle(packed: Packed, most: int) -> str:
    """Reason why a scene cannot be fused, or ""."""
    count = packed.system.count
    if packed.releases:
        names = ", ".join(f'"{name}"' for name in packed.releases)
        return f"hinge {names} is released during the run, which changes the structure"
    if count > most:
        asked = f' ({MOST_ASKED} with engine = "fused")' if most < MOST_ASKED else ""
        return f"it has {count} bodies; the limit of fused code is {most}{asked}"
    if packed.product is not None:
        return "the product of classical matrices exists only in the looped engine"
    if packed.qr:
        return "the least-squares sweep exists only in the looped engine"
    if packed.model.refines and packed.system.closes:
        return (
            "heavy bodies outboard of light ones need refinement, which exists for closed loops "
            "only in the looped engine"
        )
    hinges = (packed.elements[body.hinge] for body in packed.system.distinct)
    if any(hinge.tape is not None and hinge.spec is None for hinge in hinges):
        return "a hinge is interpreted because it was generated without a compiler"
    return ""


def _too_wide(structure: Structure, most: int) -> str:
    """Reason why code of closed loops would be too long, or ""."""
    rows = sum(len(body.pending) ** 2 + len(body.bent) ** 2 for body in structure.bodies)
    size = len(structure.bodies) + rows // _ROWS_PER_BODY
    if size <= most:
        return ""
    return f"its closed loops make it like {size} bodies; the limit of fused code is {most}"


def printers() -> list[Path]:
    """Python files in the folders of PRINTERS, sorted by name."""
    folders = [
        Path(str(files(room).joinpath(name))) for room in PRINTERS for name in PRINTERS[room]
    ]
    return [path for folder in folders for path in sorted(folder.rglob("*.py"))]


@cache
def _printers_hash() -> str:
    found = hashlib.sha256()
    for path in printers():
        found.update(path.read_bytes())
    for path in sorted(Path(str(files("mstmm.templates"))).glob("fused_*.c")):
        found.update(path.read_bytes())
    return found.hexdigest()


@cache
def _manifest_hash() -> str:
    return hashlib.sha256(
        files("mstmm.generated").joinpath("manifest.json").read_bytes()
    ).hexdigest()


def kernels_of(definitions: Mapping[Key, ElementSpec]) -> Callable[[Key, str], KernelIR]:
    """Function that returns a kernel by element and name.

    It searches user-defined elements, then the prebuilt ones, and raises ElementError if there is
    no such kernel.
    """

    def kernel(key: Key, name: str) -> KernelIR:
        if key not in definitions:
            return _prebuilt(key, name)
        for found in definitions[key].kernels:
            if found.name == name:
                return found
        raise ElementError(f"{key[0]} {key[1]} has no kernel {name!r}")

    return kernel


@cache
def _stored(key: Key) -> dict[str, Any]:
    text = files("mstmm.generated").joinpath(f"{key[0]}_{key[1]}.json").read_text(encoding="utf-8")
    return {kernel["name"]: kernel for kernel in json.loads(text)["kernels"]}


@cache
def _prebuilt(key: Key, name: str) -> KernelIR:
    found = _stored(key).get(name)
    if found is None:
        raise ElementError(f"{key[0]} {key[1]} has no kernel {name!r}")
    return from_json(json.dumps(found))
