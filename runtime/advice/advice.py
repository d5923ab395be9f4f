"""What an advice says: the choice for each body, method and tolerance, errors, savings, reasons."""

from __future__ import annotations

import json
import textwrap
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from mstmm.argument_validation import require_path
from mstmm.errors import SceneError
from mstmm.scene import Scene

from ..chart.chart_points import Setting
from ..platform_support.safe_files import write_text
from .body_model_levels import BodyModel
from .error_predictors import ErrorPrediction
from .measure_renaming import rename_reference

#: Columns of comments in a scene that is written.
_WIDTH = 96


@dataclass(frozen=True)
class BodyAdvice:
    """What one flexible body may be.

    Attributes:
        name: of the body.
        given: what it is in the scene.
        choice: the least that suffices.
        error: of this choice alone, all other bodies at their richest; None where it was not found.
        saving: processor time of the richest model over that with this choice alone.
        reason: in words, with figures.
        evidence: what a one-way run tells of it; None where there is none.
        split: how far one floating frame may err where that is more than is asked (or was feared to
            be) and the beam stays whole; None elsewhere.
    """

    name: str
    given: BodyModel
    choice: BodyModel
    error: float | None
    saving: float | None
    reason: str
    evidence: ErrorPrediction | None = None
    split: float | None = None

    def to_dict(self) -> dict[str, Any]:
        """Plain values."""
        return {
            "name": self.name, "given": _plain(self.given), "advised": _plain(self.choice),
            "error": self.error, "saving": self.saving, "reason": self.reason,
            "evidence": None if self.evidence is None else self.evidence.to_dict(),
            "split": self.split,
        }  # fmt: skip


@dataclass(frozen=True)
class TriedModel:
    """A model that was tried: its error against the richest one (None where it gave none), its
    processor time in s at the tolerance of comparisons, and why there is no error."""

    name: str
    error: float | None
    cpu_s: float
    why: str


@dataclass(frozen=True)
class Advice:
    """The smallest model that was found to suffice.  Made by `mstmm.advise`.

    Attributes:
        asked: the error asked for, of `measure`, in `unit` ("1" for parts, see `scaling`).
        t_end: s, end of the run that the advice is for.
        compared: over what models were compared, in words; `whole` where that was all of the run.
        reference_error: how far two runs of the richest model were apart.
        bodies: the choice for each flexible body.
        changes: what became of hinges, springs and welded bodies, a sentence each.
        setting: method and tolerance.
        error: of the advised model at this setting, against the richest model.
        cpu_s: processor time of that run over what was compared, s.
        model_saving: time of the scene as it was given over that of the advised one, the same
            method and tolerance; setting_saving: time of the default method and tolerance over the
            advised ones, on the advised model.  None where one of the runs failed or took too long.
        scene: the reduced scene.
        names: places that have other names in it, such as "arm.tip", and these names.
        parts: beams of it that are parts of a beam of the given scene, and which.
        notes: what else there is to know, a sentence each.
        tried: every model that was tried.
    """

    asked: float
    measure: str
    unit: str
    scaling: str
    t_end: float
    compared: str
    whole: bool
    reference_error: float
    bodies: tuple[BodyAdvice, ...]
    changes: tuple[str, ...]
    setting: Setting
    error: float
    cpu_s: float
    model_saving: float | None
    setting_saving: float | None
    scene: Scene
    names: Mapping[str, str]
    parts: Mapping[str, str]
    notes: tuple[str, ...]
    tried: tuple[TriedModel, ...]

    @property
    def method(self) -> str:
        """Name of the method."""
        return self.setting.method

    @property
    def options(self) -> dict[str, Any]:
        """Arguments of `simulate`: method, and rtol and atol or step."""
        return self.setting.options

    @property
    def in_words(self) -> str:
        """What errors without a unit are parts of, in brackets; "" for others."""
        return f" ({self.scaling})" if self.unit == "1" and self.scaling else ""

    @property
    def reduced(self) -> bool:
        """Whether the advised scene is less than the given one."""
        return bool(self.changes) or any(one.choice != one.given for one in self.bodies)

    def renamed(self, quantity: str) -> str:
        """The name of a place or a quantity in the reduced scene."""
        return rename_reference(quantity, self.names)

    def to_dict(self) -> dict[str, Any]:
        """Everything as plain values."""
        return {
            "error_asked": self.asked, "of": self.measure, "unit": self.unit,
            "scaling": self.scaling, "t_end": self.t_end, "compared": self.compared,
            "whole": self.whole, "reference_error": self.reference_error,
            "bodies": [body.to_dict() for body in self.bodies], "changes": list(self.changes),
            "method": self.method, "setting": self.setting.numbers, "error": self.error,
            "cpu_s": self.cpu_s, "model_saving": self.model_saving,
            "setting_saving": self.setting_saving, "reduced": self.reduced,
            "scene": self.scene.to_toml(), "names": dict(self.names), "parts": dict(self.parts),
            "notes": list(self.notes),
            "tried": [asdict(one) for one in self.tried],
        }  # fmt: skip

    def to_json(self) -> str:
        """The same as text."""
        return json.dumps(self.to_dict(), indent=2, allow_nan=False)

    def to_toml(self) -> str:
        """The reduced scene, with what was decided in comments."""
        unit = "" if self.unit == "1" else f" {self.unit}"
        options = " ".join(f"--{key} {value:g}" for key, value in self.setting.numbers.items())
        lines = [
            f"Reduced for an error of {self.asked:g}{unit} of {self.measure}{self.in_words}; it "
            f"errs by {self.error:.1e} over {self.compared}.",
            f"Run it by: mstmm simulate FILE --t-end {self.t_end:g} --method {self.method} "
            f"{options}",
            *(f"{one.name}: {one.choice} (was {one.given}). {one.reason}" for one in self.bodies),
            *self.changes, *self.notes,
        ]  # fmt: skip
        head = [part for line in lines for part in textwrap.wrap(line, _WIDTH)]
        return "\n".join(f"# {line}" for line in head) + "\n\n" + self.scene.to_toml()

    def write(self, path: str | Path) -> Path:
        """Write the reduced scene.  SceneError for a name that does not end in .toml."""
        place = require_path("scene", path)
        if place.suffix != ".toml":
            raise SceneError(f"{place}: expected a name that ends in .toml")
        write_text(place, self.to_toml())
        return place


def _plain(choice: BodyModel) -> dict[str, Any]:
    return {"level": choice.level, "shapes": dict(choice.shapes) if choice.level != "rigid" else {}}
