"""Interface to the fused code of a scene; other packages generate and compile it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol, Self

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import EnvironmentFailure

from .inputs import IndexPairs

if TYPE_CHECKING:
    from ..kernels.scene_libraries import DerivativeLibrary, FusedLibrary
    from ..packing.system import System


class FusedCode(Protocol):
    """Fused libraries of a scene; None for those not available.

    `library` is for one state, `lanes` for several states in SIMD lanes, `implicit` for residuals
    and tangents of implicit methods, `inverse` for inverse dynamics and the mass matrix.

    `numbers` is the parameter vector p that they read, `inputs` the positions of inputs in it;
    `note` gives the origin of the library, `obstacle` the reason that none is possible.  `ready(n)`
    returns a library if it exists or if n evaluations justify a compiler run; `find()` never
    compiles; `build()` raises EnvironmentFailure if no library is possible.  `follow(other)` adopts
    the libraries of the same scene with other numbers; `for_system(system)` is the code for a
    system with other inputs.  `symbolic` is a linear model as formulas.
    """

    numbers: Array
    inputs: IndexPairs
    note: str
    obstacle: str

    @property
    def library(self) -> FusedLibrary | None: ...
    @property
    def lanes(self) -> FusedLibrary | None: ...
    @property
    def implicit(self) -> FusedLibrary | None: ...
    @property
    def inverse(self) -> FusedLibrary | None: ...
    def find(self) -> FusedLibrary | None: ...
    def build(self) -> FusedLibrary: ...
    def follow(self, other: Any) -> None: ...
    def for_system(self, system: System) -> Self: ...
    def ready(self, evaluations: float) -> FusedLibrary | None: ...
    def ready_lanes(self, evaluations: float) -> FusedLibrary | None: ...
    def ready_implicit(self, evaluations: float) -> FusedLibrary | None: ...
    def ready_linear(self, pays: bool) -> FusedLibrary | None: ...
    def ready_inverse(self, calls: float) -> FusedLibrary | None: ...
    def ready_points(self, body: int, calls: float) -> FusedLibrary | None: ...
    def structure_ir(self, structure: Any) -> Any: ...
    def columns(
        self, structure: Any, kernels: Callable[[], Any], what: str, build: bool
    ) -> DerivativeLibrary | None: ...
    def solution(self, build: bool) -> DerivativeLibrary | None: ...
    def symbolic(self, linear: Any, keep: Sequence[str]) -> Any: ...


@dataclass
class NoFusedCode:
    """Placeholder for scenes that only the looped engine evaluates."""

    obstacle: str = "this model was created without support for fused code"
    library: FusedLibrary | None = None
    lanes: FusedLibrary | None = None
    implicit: FusedLibrary | None = None
    inverse: FusedLibrary | None = None
    note: str = ""
    numbers: Array = field(default_factory=lambda: np.zeros(0))
    inputs: IndexPairs = ()

    def build(self) -> FusedLibrary:
        raise EnvironmentFailure(f'{self.obstacle}; use mstmm.compile(scene, engine="fused")')

    def follow(self, other: Any) -> None:
        pass

    def for_system(self, system: System) -> Self:
        return self

    def structure_ir(self, structure: Any) -> Any:
        return self.build()

    def symbolic(self, linear: Any, keep: Sequence[str]) -> Any:
        return self.build()

    def _find_nothing(self, *_: Any, **__: Any) -> None:
        return None

    find = ready = ready_lanes = ready_implicit = ready_linear = _find_nothing
    ready_inverse = ready_points = columns = solution = _find_nothing
