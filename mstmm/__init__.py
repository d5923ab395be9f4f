"""mstmm: transfer matrix method for multibody systems.

    import mstmm
    scene = mstmm.load_scene("arm.toml")
    model = mstmm.compile(scene)
    result = model.simulate(t_end=10.0)

Names are loaded when they are first used: importing mstmm loads neither numpy nor SymPy.
"""

from __future__ import annotations

from . import signal_handling

if signal_handling.is_cli_process():  # before the imports below, which take time
    signal_handling.exit_on_signal()

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
    from .pipeline.compilation import compile_scene as compile
    from .pipeline.compilation import generate_file, register
    from .pipeline.equations import equations
    from .pipeline.experiments import advise, chart
    from .pipeline.report import write_report
    from .runtime.experiments.chart.chart import Chart
    from .runtime.experiments.model_reduction.advice import Advice
    from .runtime.experiments.run_request import ErrorRequest, Execution
    from .runtime.integrate import methods
    from .runtime.model.model import Model
    from .runtime.model.result_loading import load_result
    from .runtime.result.result import Result
    from .scene import Scene
    from .scene.load import import_robot, load_scene
    from .scene.robots.robot_from_scene import export_robot

#: Public name -> (module, name there; "" for the module itself).
_LAZY = {
    "Scene": (".scene", "Scene"),
    "load_scene": (".scene.load", "load_scene"),
    "import_robot": (".scene.load", "import_robot"),
    "export_robot": (".scene.robots.robot_from_scene", "export_robot"),
    "advise": (".pipeline.experiments", "advise"),
    "chart": (".pipeline.experiments", "chart"),
    "compile": (".pipeline.compilation", "compile_scene"),
    "register": (".pipeline.compilation", "register"),
    "equations": (".pipeline.equations", "equations"),
    "write_report": (".pipeline.report", "write_report"),
    "generate_file": (".pipeline.compilation", "generate_file"),
    "Advice": (".runtime.experiments.model_reduction.advice", "Advice"),
    "Chart": (".runtime.experiments.chart.chart", "Chart"),
    "methods": (".runtime.integrate.methods", ""),
    "Execution": (".runtime.experiments.run_request", "Execution"),
    "ErrorRequest": (".runtime.experiments.run_request", "ErrorRequest"),
    "Model": (".runtime.model.model", "Model"),
    "Result": (".runtime.result.result", "Result"),
    "load_result": (".runtime.model.result_loading", "load_result"),
    "stability": (".atlas.atlas", "stability"),
    "Atlas": (".atlas.atlas", "Atlas"),
}

__all__ = [
    "Advice",
    "Atlas",
    "Chart",
    "ElementError",
    "EnvironmentFailure",
    "ErrorRequest",
    "Execution",
    "ExpressionError",
    "Model",
    "MstmmError",
    "NumericalFailure",
    "Result",
    "RiskRefused",
    "Scene",
    "SceneError",
    "advise",
    "chart",
    "compile",
    "equations",
    "export_robot",
    "generate_file",
    "import_robot",
    "load_result",
    "load_scene",
    "methods",
    "register",
    "stability",
    "write_report",
]  # fmt: skip


if not TYPE_CHECKING:  # a type checker would accept any name

    def __getattr__(name: str) -> Any:
        if name not in _LAZY:
            raise AttributeError(f"module 'mstmm' has no attribute {name!r}")
        module, attribute = _LAZY[name]
        loaded = import_module(module, __name__)
        value = getattr(loaded, attribute) if attribute else loaded
        globals()[name] = value
        return value


def __dir__() -> list[str]:
    return sorted(__all__)
