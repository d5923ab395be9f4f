"""Options of `mstmm simulate`: one field each; those of methods are declared by the methods."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields, make_dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_args, get_type_hints

from mstmm.defaults import ATOL, METHOD, RTOL
from mstmm.errors import MstmmError
from mstmm.runtime.integrate import methods

from .model_loading import EXTERNAL_PREFIXES
from .options import (
    PLOT_ENDINGS,
    RESULT_ENDINGS,
    Elements,
    EndTime,
    Json,
    OutputTimes,
    Plot,
    SceneFile,
    flag,
    integer_parser,
    option,
    output_file,
    parse_not_negative,
    parse_positive,
    parse_times,
    result_ending,
)

if TYPE_CHECKING:
    from mstmm.runtime.experiments.run_request import ErrorRequest

#: Largest number of fixed steps of a run.
MAX_STEPS = 1e11

#: Prefix of the names of the classical discrete-time method.
_CLASSICAL_PREFIX = "dttmm-classical"

_METHOD_HELP = "Integration method, see `mstmm list methods`; auto chooses one."
_ERROR_HELP = (
    "Target error of the whole run, in place of tolerances: rad, or relative to the motion; "
    "several runs may be made."
)
_OF_HELP = "Quantity to which --error applies, in its unit, such as rod1.tip.position; repeatable."
_TIMES_HELP = "Output times: a count (201) or an interval in s (0.05, 1s); default: every step."
_OUTPUT_HELP = "Result file: .nc, .csv or .mat; default: scene name, current folder."
_QUANTITY_HELP = (
    "Quantity to plot and print, such as shoulder.angle, rod1.tip.position, energy; repeatable."
)
_INPUT_HELP = "Value of a scene input, or the name of a signal; repeatable."
_CERTIFY_HELP = "Estimate the error with a second, more accurate run; default: after short runs."
_SWEEP_HELP = (
    "Sweep: riccati; refined or qr for large mass ratios; product (plain product, chains only); "
    "auto: the first that is accurate enough at the start."
)
_ENGINE_HELP = "auto, looped (generic C loop) or fused (C compiled for this scene)."
_FLEXIBILITY_HELP = (
    "Model level of all flexible bodies: coupled, one-way or rigid; default: as in the scene."
)
_ACCURACY_HELP = (
    "Largest estimated error of a trusted result: rad, or relative to the motion (0.01)."
)
_ON_RISK_HELP = (
    "Action if the result is in doubt: warn; refuse (before the run, else exit code 4 after "
    "saving); ignore."
)
_SIMPLIFY_HELP = "Merge bodies on fixed hinges, and snap nearly right angles to exact ones."
_TURNS_HELP = "Tolerance for snapping to right angles, rad (1e-11; 0 switches it off)."


@dataclass(frozen=True)
class RunOptions:
    """Options of a run as given; `method_options` are those of its integration method."""

    scene: SceneFile
    t_end: EndTime = 10.0
    method: Annotated[
        str | None,
        option("--method", "NAME", _METHOD_HELP, show_default=f"auto, {METHOD} with --step"),
    ] = None
    step: Annotated[
        float | None,
        option(
            "--step", "S", "Fixed time step, s; required by fixed-step methods.", parse_positive
        ),
    ] = None
    rtol: Annotated[
        float | None,
        option("--rtol", "X", "Relative tolerance.", parse_positive, show_default=f"{RTOL:g}"),
    ] = None
    atol: Annotated[
        float | None,
        option("--atol", "X", "Absolute tolerance.", parse_not_negative, show_default=f"{ATOL:g}"),
    ] = None
    error: Annotated[float | None, option("--error", "X", _ERROR_HELP, parse_positive)] = None
    of: Annotated[list[str] | None, option("--of", "NAME", _OF_HELP)] = None
    times: Annotated[OutputTimes | None, option("--times", "N|DT", _TIMES_HELP, parse_times)] = None
    output: Annotated[str | None, option("--output/-o", "FILE", _OUTPUT_HELP)] = None
    plot: Plot = None
    quantity: Annotated[list[str] | None, option("--quantity/-q", "NAME", _QUANTITY_HELP)] = None
    inputs: Annotated[list[str] | None, option("--input", "NAME=VALUE", _INPUT_HELP)] = None
    hinge: Elements = None
    certify: Annotated[bool | None, flag("--certify/--no-certify", _CERTIFY_HELP)] = None
    resume: Annotated[
        bool, flag("--resume", "Continue an interrupted run, with the same options.")
    ] = False
    sweep: Annotated[str, option("--sweep", "NAME", _SWEEP_HELP)] = "auto"
    engine: Annotated[str, option("--engine", "NAME", _ENGINE_HELP)] = "auto"
    flexibility: Annotated[str | None, option("--flexibility", "LEVEL", _FLEXIBILITY_HELP)] = None
    accuracy: Annotated[float | None, option("--accuracy", "X", _ACCURACY_HELP, parse_positive)] = (
        None
    )
    on_risk: Annotated[str, option("--on-risk", "ACTION", _ON_RISK_HELP)] = "warn"
    simplify: Annotated[bool, flag("--simplify/--no-simplify", _SIMPLIFY_HELP)] = True
    turns: Annotated[float | None, option("--turns", "X", _TURNS_HELP, parse_not_negative)] = None
    json: Json = False
    method_options: Mapping[str, Any] = field(default_factory=dict)

    @cached_property
    def result_file(self) -> Path:
        """Checked path of the result."""
        default = (Path(self.scene).stem or "result") + result_ending()
        return output_file(default if self.output is None else self.output, RESULT_ENDINGS)

    @cached_property
    def plot_file(self) -> Path | None:
        """Checked path of the plot; None without one."""
        return None if self.plot is None else output_file(self.plot, PLOT_ENDINGS, "--plot")

    @property
    def checkpoint(self) -> Path:
        """File in which an interrupted run saves its state."""
        return self.result_file.with_name(self.result_file.name + ".checkpoint")

    @property
    def resumable(self) -> bool:
        """Whether the run writes checkpoints.

        External integrators, the classical method and runs for a target error do not.
        """
        is_external = (self.method or METHOD).startswith((*EXTERNAL_PREFIXES, _CLASSICAL_PREFIX))
        return self.error is None and not is_external

    @property
    def method_object(self) -> methods.Method:
        """Integration method with its options.  SceneError for one that it does not have."""
        return methods.method(self.method or "", **self.method_options)

    @property
    def target_error(self) -> ErrorRequest | None:
        """Target error with its quantities; None without one."""
        from mstmm.runtime.experiments.run_request import ErrorRequest

        return None if self.error is None else ErrorRequest(self.error, tuple(self.of or ()))

    def check(self) -> None:
        """Reject options that contradict each other, and steps with which the run never ends."""
        if self.step is not None and self.t_end / self.step > MAX_STEPS:
            raise MstmmError(
                f"--step {self.step:g}: {self.t_end / self.step:.1e} steps would never end; "
                f"use {self.t_end / MAX_STEPS:.1e} s or more"
            )
        if self.error is None and self.of:
            raise MstmmError(f"--of {self.of[0]}: expected a target error for it; give --error too")
        if self.error is not None and self.resume:
            raise MstmmError(
                "--resume: runs with --error write no checkpoint; run it again, or use the method "
                "and the tolerances found by such a run"
            )
        if self.error is not None and self.accuracy is not None:
            raise MstmmError(
                "--accuracy with --error: a result is trusted if it reaches --error; leave out "
                "--accuracy"
            )


_PARSERS = {float: parse_not_negative, int: integer_parser(0), str: None}


def _method_fields() -> Iterator[tuple[str, Any, Any]]:
    """One field for each option of integration methods; None where it is not given."""
    declared = {item.name: (family, item) for family in methods.FAMILIES for item in fields(family)}
    for name, (family, item) in declared.items():
        if name != "name":
            hint = get_type_hints(family)[name]
            kind: Any = (get_args(hint) or (hint,))[0]
            given = option(
                f"--{name.replace('_', '-')}", item.metadata["metavar"],
                item.metadata["description"], _PARSERS[kind],
            )  # fmt: skip
            yield name, Annotated[kind | None, given], field(default=None)


#: Options of all integration methods.
MethodOptions = make_dataclass("MethodOptions", _method_fields(), frozen=True)
