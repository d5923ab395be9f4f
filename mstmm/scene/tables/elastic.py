"""Table [[elastic]]: elastic body from mass and stiffness matrices or from a mesh."""

from __future__ import annotations

from pydantic import model_validator

from ..validators.scalars_and_vectors import ValidationProblems
from . import elastic_rules as checks
from .elastic_keys import ElasticKeys


class Elastic(ElasticKeys):
    """General elastic body; its axes are those of its mesh.

    Exactly one of `matrices` (a .npz file), `arrays`, `mesh` (a file) and `box` gives its finite
    elements.  `modes` is the number of vibration modes, None for "auto".
    """

    @model_validator(mode="after")
    def _check(self) -> Elastic:
        problems = list(checks.problems(self))
        if problems:
            raise ValidationProblems(*problems)
        return self
