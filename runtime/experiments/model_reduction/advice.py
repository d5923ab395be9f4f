"""Result of `mstmm.advise`: reduced scene, method and tolerance, errors, savings, reasons."""

from __future__ import annotations

import json
import textwrap
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from mstmm.argument_validation import require_path
from mstmm.errors import SceneError
from mstmm.plain_data import stored_as, to_plain
from mstmm.scene import Scene

from ...platform_support.safe_files import write_text
from ..trial import Setting
from .body_models import BodyModel, ErrorPrediction
from .scene_edits import rename_reference

#: Columns of the comments in a scene file.
_WIDTH = 96


@dataclass(frozen=True)
class BodyAdvice:
    """Advised model of one flexible body.

    Attributes:
        name: name of the body.
        given_model: model of the body in the given scene.
        model: smallest sufficient model.
        error: error of this choice alone, with the richest models of all other bodies; None if
            unknown.
        speedup: CPU time of the richest model over that with this choice alone.
        reason: reason of the choice, with numbers.
        evidence: error estimates from a run with one-way coupling; None if there are none.
        frame_error: error of one floating frame, where its estimate exceeds the target error and
            the beam is not split; else None.
    """

    name: str
    given_model: BodyModel
    model: BodyModel
    error: float | None
    speedup: float | None
    reason: str
    evidence: ErrorPrediction | None = None
    frame_error: float | None = None

    def to_dict(self) -> dict[str, Any]:
        """Plain values."""
        return {
            "name": self.name, "given": _plain_model(self.given_model),
            "advised": _plain_model(self.model),
            "error": self.error, "saving": self.speedup, "reason": self.reason,
            "evidence": None if self.evidence is None else self.evidence.to_dict(),
            "split": self.frame_error,
        }  # fmt: skip


@dataclass(frozen=True)
class TriedModel:
    """Model that was tried.

    Attributes:
        name: description of the model.
        error: error relative to the richest model; None if the run failed.
        cpu_s: CPU time at the tolerance of the comparison, s.
        reason: reason why there is no error, else "".
    """

    name: str
    error: float | None
    cpu_s: float
    reason: str = field(metadata=stored_as("why"))


@dataclass(frozen=True)
class Advice:
    """Smallest sufficient model found for a target error.  Made by `mstmm.advise`.

    Attributes:
        target_error: target error of `measure`, in `unit` ("1": relative, see `scaling`).
        measure, unit, scaling: compared quantity, its unit, and what it is divided by.
        t_end: end of the run that the advice is for, s.
        comparison_text: description of the time span of the comparison.
        covers_whole_run: whether this is the whole run.
        reference_error: difference of two runs of the richest model.
        bodies: advice for each flexible body.
        other_changes: changes of hinges, springs, beams and welded bodies, a sentence each.
        setting: method and tolerance or step.
        error: error of the advised model with this setting, relative to the richest model.
        cpu_s: CPU time of that run over the compared time span, s.
        model_saving: CPU time of the given scene over that of the reduced one, with the same method
            and tolerance; None if one of the runs failed or took too long.
        setting_saving: CPU time with the default method and tolerance over that with the advised
            ones, on the reduced scene; None as above.
        scene: reduced scene.
        renamed_references: former name of a body or end, such as "arm.tip" -> its name in the
            reduced scene.
        beam_parts: beam of the reduced scene -> beam of the given scene that it is a part of.
        notes: limits of the advice, a sentence each.
        tried_models: all models that were tried.
    """

    target_error: float
    measure: str
    unit: str
    scaling: str
    t_end: float
    comparison_text: str
    covers_whole_run: bool
    reference_error: float
    bodies: tuple[BodyAdvice, ...]
    other_changes: tuple[str, ...]
    setting: Setting
    error: float
    cpu_s: float
    model_saving: float | None
    setting_saving: float | None
    scene: Scene
    renamed_references: Mapping[str, str]
    beam_parts: Mapping[str, str]
    notes: tuple[str, ...]
    tried_models: tuple[TriedModel, ...]

    @property
    def method(self) -> str:
        """Name of the method."""
        return self.setting.method

    @property
    def options(self) -> dict[str, Any]:
        """Keyword arguments of `simulate`: method, and rtol and atol or step."""
        return self.setting.options

    @property
    def scaling_text(self) -> str:
        """Scaling of relative errors, in brackets; "" for errors with a unit."""
        return f" ({self.scaling})" if self.unit == "1" and self.scaling else ""

    @property
    def is_reduced(self) -> bool:
        """Whether the advised scene differs from the given one."""
        return bool(self.other_changes) or any(
            body.model != body.given_model for body in self.bodies
        )

    def reduced_name(self, quantity: str) -> str:
        """Name of a body, end or quantity in the reduced scene."""
        return rename_reference(quantity, self.renamed_references)

    def to_dict(self) -> dict[str, Any]:
        """All data as plain values."""
        return {
            "error_asked": self.target_error, "of": self.measure, "unit": self.unit,
            "scaling": self.scaling, "t_end": self.t_end, "compared": self.comparison_text,
            "whole": self.covers_whole_run, "reference_error": self.reference_error,
            "bodies": [body.to_dict() for body in self.bodies], "changes": list(self.other_changes),
            "method": self.method, "setting": self.setting.numbers, "error": self.error,
            "cpu_s": self.cpu_s, "model_saving": self.model_saving,
            "setting_saving": self.setting_saving, "reduced": self.is_reduced,
            "scene": self.scene.to_toml(), "names": dict(self.renamed_references),
            "parts": dict(self.beam_parts), "notes": list(self.notes),
            "tried": to_plain(self.tried_models),
        }  # fmt: skip

    def to_json(self) -> str:
        """All data as JSON text."""
        return json.dumps(self.to_dict(), indent=2, allow_nan=False)

    def to_toml(self) -> str:
        """Reduced scene as TOML, with the decisions as comments."""
        unit = "" if self.unit == "1" else f" {self.unit}"
        options = " ".join(f"--{key} {value:g}" for key, value in self.setting.numbers.items())
        lines = [
            f"Reduced for an error of {self.target_error:g}{unit} of "
            f"{self.measure}{self.scaling_text}; its "
            f"error is {self.error:.1e} over {self.comparison_text}.",
            f"Command: mstmm simulate FILE --t-end {self.t_end:g} --method {self.method} {options}",
            *(
                f"{body.name}: {body.model} (was {body.given_model}). {body.reason}"
                for body in self.bodies
            ),
            *self.other_changes, *self.notes,
        ]  # fmt: skip
        comment = [part for line in lines for part in textwrap.wrap(line, _WIDTH)]
        return "\n".join(f"# {line}" for line in comment) + "\n\n" + self.scene.to_toml()

    def save_scene(self, path: str | Path) -> Path:
        """Write the reduced scene to a .toml file; SceneError for another file name extension."""
        file = require_path("scene", path)
        if file.suffix != ".toml":
            raise SceneError(f"{file}: expected a name that ends in .toml")
        write_text(file, self.to_toml())
        return file


def _plain_model(model: BodyModel) -> dict[str, Any]:
    return {"level": model.level, "shapes": dict(model.shapes) if model.level != "rigid" else {}}
