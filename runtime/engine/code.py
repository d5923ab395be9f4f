"""What a model knows of the fused code of its scene; how it is made is not this room's affair."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol, Self

import numpy as np

from mstmm.arrays import Array

from .live import Places

if TYPE_CHECKING:
    from ..kernels.columns import ColumnsLibrary
    from ..kernels.fused import FusedLibrary
    from ..pack.system import System


class Fusing(Protocol):
    """Fused libraries of a scene: `library` for one state, `lanes` for several side by side,
    `implicit` for what implicit methods ask, `inverse` for inverse dynamics and the mass matrix, as
    far as they are there.

    `numbers` is the vector p they read, `inputs` where inputs stand in it; `note` says where the
    library came from, `obstacle` why there can be none.  `ready(n)` gives a library if it is there
    or if n evaluations are worth a compiler run; `find()` only looks; `build()` raises
    EnvironmentFailure where there can be none; `follow(other)` takes over the libraries of the same
    scene with other numbers, `under(system)` is the same of a system that differs in its inputs.
    `symbolic` is a linear model as formulas.
    """

    numbers: Array
    inputs: Places
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
    def under(self, system: System) -> Self: ...
    def ready(self, evaluations: float) -> FusedLibrary | None: ...
    def ready_lanes(self, evaluations: float) -> FusedLibrary | None: ...
    def ready_implicit(self, evaluations: float) -> FusedLibrary | None: ...
    def ready_linear(self, pays: bool) -> FusedLibrary | None: ...
    def ready_inverse(self, calls: float) -> FusedLibrary | None: ...
    def ready_points(self, body: int, calls: float) -> FusedLibrary | None: ...
    def fused(self, structure: Any) -> Any: ...
    def columns(
        self, structure: Any, kernels: Callable[[], Any], what: str, build: bool
    ) -> ColumnsLibrary | None: ...
    def solution(self, build: bool) -> ColumnsLibrary | None: ...
    def symbolic(self, linear: Any, keep: Sequence[str]) -> Any: ...


@dataclass
class NotFused:
    """A scene that runs on the looped engine alone."""

    obstacle: str = "this model was made without the means to compile fused code"
    library: FusedLibrary | None = None
    lanes: FusedLibrary | None = None
    implicit: FusedLibrary | None = None
    inverse: FusedLibrary | None = None
    note: str = ""
    numbers: Array = field(default_factory=lambda: np.zeros(0))
    inputs: Places = ()

    def find(self) -> None:
        return None

    def build(self) -> FusedLibrary:
        from mstmm.errors import EnvironmentFailure

        raise EnvironmentFailure(f'{self.obstacle}; use mstmm.compile(scene, engine="fused")')

    def follow(self, other: Any) -> None:
        pass

    def under(self, system: System) -> Self:
        return self

    def ready(self, evaluations: float) -> None:
        return None

    def ready_lanes(self, evaluations: float) -> None:
        return None

    def ready_implicit(self, evaluations: float) -> None:
        return None

    def ready_linear(self, pays: bool) -> None:
        return None

    def ready_inverse(self, calls: float) -> None:
        return None

    def ready_points(self, body: int, calls: float) -> None:
        return None

    def fused(self, structure: Any) -> Any:
        return self.build()

    def columns(self, structure: Any, kernels: Callable[[], Any], what: str, build: bool) -> None:
        return None

    def solution(self, build: bool) -> None:
        return None

    def symbolic(self, linear: Any, keep: Sequence[str]) -> Any:
        return self.build()
