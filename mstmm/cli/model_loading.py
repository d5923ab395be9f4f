"""Compilation of a scene file, with the user elements and the method that it needs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from mstmm.errors import LoopClosureError, NumericalFailure, SceneError

from .options import require_python_file
from .progress import elapsed_time_display

if TYPE_CHECKING:
    from mstmm.runtime.model.model import Model
    from mstmm.scene import Scene

#: Prefixes of the names of methods of SciPy and SUNDIALS.
EXTERNAL_PREFIXES = ("scipy-", "sundials-")


def generate_elements(paths: list[str]) -> None:
    """Generate the elements of Python files, so that scenes can use them; executes the files."""
    if paths:
        import mstmm

        for path in paths:
            mstmm.generate_file(require_python_file(path))


def compile_file(
    path: str,
    scene: Scene,
    sweep: str = "auto",
    engine: str = "auto",
    flexibility: str | None = None,
    simplify: bool | Mapping[str, bool | float] = True,
) -> Model:
    """Compile a scene file.

    SceneError, with the name of the file, also if the accelerations at the start cannot be
    computed, because that is an error of the scene.
    """
    import numpy as np

    import mstmm

    try:
        with elapsed_time_display("preparing the scene"):
            model = mstmm.compile(
                scene, engine=engine, sweep=sweep, flexibility=flexibility, simplify=simplify
            )
            udot = model.accelerations(*model.initial_state())
    except (SceneError, NumericalFailure) as error:
        lines = str(error).splitlines()
        prefixed = (f"{path}: " + line.removeprefix("scene: ") for line in lines)
        message = "\n".join(prefixed)
        if isinstance(error, LoopClosureError):
            raise LoopClosureError(message, error.gap, error.pose) from None
        raise SceneError(message) from None
    if not np.isfinite(udot).all():
        raise SceneError(f"{path}: the accelerations at the start are not finite")
    return model


def load_method(name: str) -> None:
    """Load the coefficients of a method, so that they do not count in the time of a run.

    SceneError for an unknown method, EnvironmentFailure if its package is not installed.
    """
    from mstmm.runtime.run import classical_run, sundials

    if name in classical_run.METHODS:
        return
    if name in sundials.METHODS:
        sundials.require_package(name)
    elif not name.startswith(EXTERNAL_PREFIXES):
        from mstmm.runtime.integrate.steppers import AUTO, AUTO_EXPLICIT, get

        get(AUTO_EXPLICIT if name == AUTO else name)
