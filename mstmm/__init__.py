"""mstmm: transfer matrix method for multibody systems.

    import mstmm
    scene = mstmm.load_scene("arm.toml")
    model = mstmm.compile(scene)
    result = model.simulate(t_end=10.0)

Names are loaded when they are first used: importing mstmm loads neither numpy nor SymPy.
"""

from __future__ import annotations

from . import interrupts

if interrupts.is_the_program():  # before the imports below, which take time
    interrupts.end_at_once()

from importlib import import_module
from typing import TYPE_CHECKING, Any

from .errors import (
    ElementError,
    EnvironmentFailure,
    ExpressionError,
    MstmmError,
    NumericalFailure,
    RiskRefused,
    SceneError,
)
from .version import __version__ as __version__

if TYPE_CHECKING:
    from .atlas.atlas import Atlas, stability
    from .bridge.advising import advise
    from .bridge.charting import chart
    from .bridge.compilation import compile_scene as compile
    from .bridge.compilation import generate_file, register
    from .bridge.equations import equations
    from .bridge.reporting.report import report
    from .runtime.advice.record import Advice
    from .runtime.chart.chart import Chart
    from .runtime.model.loading import load_result
    from .runtime.model.model import Model
    from .runtime.result.result import Result
    from .scene import Scene
    from .scene.load import load_scene
    from .scene.robots.export import export_robot
    from .scene.robots.files import import_robot

#: Public name -> (module, name there).
_LAZY = {
    "Scene": (".scene", "Scene"),
    "load_scene": (".scene.load", "load_scene"),
    "import_robot": (".scene.robots.files", "import_robot"),
    "export_robot": (".scene.robots.export", "export_robot"),
    "advise": (".bridge.advising", "advise"),
    "chart": (".bridge.charting", "chart"),
    "compile": (".bridge.compilation", "compile_scene"),
    "register": (".bridge.compilation", "register"),
    "equations": (".bridge.equations", "equations"),
    "report": (".bridge.reporting.report", "report"),
    "generate_file": (".bridge.compilation", "generate_file"),
    "Advice": (".runtime.advice.record", "Advice"),
    "Chart": (".runtime.chart.chart", "Chart"),
    "Model": (".runtime.model.model", "Model"),
    "Result": (".runtime.result.result", "Result"),
    "load_result": (".runtime.model.loading", "load_result"),
    "stability": (".atlas.atlas", "stability"),
    "Atlas": (".atlas.atlas", "Atlas"),
}

__all__ = [
    "Advice", "Atlas", "Chart", "ElementError", "EnvironmentFailure", "ExpressionError", "Model",
    "MstmmError", "NumericalFailure", "Result", "RiskRefused", "Scene", "SceneError", "advise",
    "chart", "compile", "equations", "export_robot", "generate_file", "import_robot", "load_result",
    "load_scene", "register", "report", "stability",
]  # fmt: skip


if not TYPE_CHECKING:  # a type checker would accept any name

    def __getattr__(name: str) -> Any:
        if name not in _LAZY:
            raise AttributeError(f"module 'mstmm' has no attribute {name!r}")
        module, attribute = _LAZY[name]
        value = getattr(import_module(module, __name__), attribute)
        globals()[name] = value
        return value


def __dir__() -> list[str]:
    return sorted(__all__)
