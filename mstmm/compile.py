"""Scene -> Model: chooses the engine and says why.  With `crosscheck`, the bridge between rooms."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .errors import SceneError
from .scene import Scene

if TYPE_CHECKING:
    from .runtime.model import Model

ENGINES = ("auto", "looped")
SWEEPS = ("riccati", "product")


def compile_scene(scene: Scene, engine: str = "auto", sweep: str = "riccati") -> Model:
    """Model of a scene, ready to compute.

    Args:
        scene: validated scene (`load_scene`, or `Scene(...)`).
        engine: "auto" or "looped" (element kernels driven by a loop; any size, no compiler).
        sweep: "riccati" (any tree), or "product" (the plain product of classical transfer
            matrices, chains only, guarded).

    Raises SceneError for hinges that do not form a tree and types that nobody defines.
    """
    if engine not in ENGINES:
        raise SceneError(f"engine {engine!r} is not known; there are: {', '.join(ENGINES)}")
    if sweep not in SWEEPS:
        raise SceneError(f"sweep {sweep!r} is not known; there are: {', '.join(SWEEPS)}")
    from .runtime.model import Model

    why = "looped: the only engine of this release"
    return Model(scene, why=why)
