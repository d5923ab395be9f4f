"""Table [[beam]]: Euler-Bernoulli beam along its x axis, with ends "root" (x = 0) and "tip"."""

from __future__ import annotations

from pydantic import model_validator

from ..validators.scalars_and_vectors import ValidationProblems
from . import beam_rules as checks
from .beam_keys import GIVEN, ROOT, TIP, BeamKeys
from .body import End
from .flexible_keys import AUTO


class Beam(BeamKeys):
    """Euler-Bernoulli beam.

    `modes` and `quadrature` are None for "auto".  `ends` also contains "root" and "tip".  Keys that
    are left out in an entry of `section` have the value of the beam; `sections` are the completed
    entries.
    """

    @model_validator(mode="after")
    def _resolve_ends_and_basis(self) -> Beam:
        object.__setattr__(self, "ends", self._all_ends())
        if self.shapes is not None and self.basis == AUTO:
            object.__setattr__(self, "basis", GIVEN)
        if self.shapes is not None and self.modes is None:
            object.__setattr__(self, "modes", self.shapes.modes)
        problems = list(checks.problems(self))
        if problems:
            raise ValidationProblems(*problems)
        object.__setattr__(self, "section", checks.joined_sections(self))
        return self

    def _all_ends(self) -> dict[str, End]:
        default_positions = {ROOT: (0.0, 0.0, 0.0), TIP: (self.length, 0.0, 0.0)}
        default_ends = {
            name: End.model_construct(position=end_position)
            for name, end_position in default_positions.items()
        }
        return default_ends | self.ends
