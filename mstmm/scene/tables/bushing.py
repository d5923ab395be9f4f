"""Table [[bushing]]: spring and damper with three forces and three moments between two ends."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from ...numerics.rotations import Matrix, Vector, from_orientation
from ..validators import names_and_text as texts
from ..validators import rotations_and_inertia
from ..validators import scalars_and_vectors as rules
from ..validators.scalars_and_vectors import (
    GROUND,
    Numbers,
    Orientation,
    Shorthand,
    Table,
    problem,
    split_reference,
)
from ..validators.symmetric_matrices import (
    antisymmetric_part,
    check_conservative,
    full_matrix,
    matrix_6x6,
    upper_triangle,
)
from .body import End, widen_end

_SIX_ZEROS = (0.0,) * 6
#: Positions of the translational entries in the upper triangle of a 6 x 6 matrix.
_TRANSLATION_POSITIONS = (0, 1, 2, 6, 7, 11)


class Bushing(Table):
    """Spring and damper in all six directions: load preload - K e - C e' on `to`.

    The reaction acts on `from`.  The bushing's axes are those of the end `from` (inertial axes for
    the ground), rotated by `orientation`.  The deflection e is the displacement of `to` from `rest`
    (x, y, z in m) with its rotation vector (rad), below 170 degrees.  `rest` is the undeformed pose
    of the end `to` in the bushing's axes; by default it is that of `from`.  `position` (m) is the
    position of an end on the ground.

    With `conservative` false any matrices are accepted, such as those of a journal bearing or a
    seal.  The load -N e of the antisymmetric part N of K then has no potential and counts as work.
    """

    name: Annotated[str, texts.name_rule("the bushing's name")] = ""
    from_: Annotated[str, texts.end_rule()] = Field(alias="from")
    to: Annotated[str, texts.end_rule()]
    position: Annotated[Vector, rules.vector_rule("m")] = (0.0, 0.0, 0.0)
    orientation: Annotated[Orientation, rotations_and_inertia.orientation_rule()] = (0.0, 0.0, 0.0)
    rest: Annotated[
        End,
        Shorthand(
            "[x, y, z] in m, or a table with position and orientation", widen_end, {"type": "array"}
        ),
    ] = End(position=(0.0, 0.0, 0.0))
    stiffness: Annotated[Numbers, matrix_6x6("N/m", "N m/rad")] = _SIX_ZEROS
    damping: Annotated[Numbers, matrix_6x6("N s/m", "N m s/rad")] = _SIX_ZEROS
    preload: Annotated[
        Numbers, rules.numbers_rule("three forces in N and three moments in N m", 6)
    ] = _SIX_ZEROS

    conservative: Annotated[bool, texts.flag_rule()] = True

    @model_validator(mode="after")
    def _check(self) -> Bushing:
        bodies = (split_reference(self.from_)[0], split_reference(self.to)[0])
        if bodies[0] == bodies[1]:
            raise problem(
                f'both ends are on "{bodies[0]}", so it has no effect; connect two bodies', "to"
            )
        if GROUND not in bodies and self.position != (0.0, 0.0, 0.0):
            raise problem(
                "only a bushing on the ground has a position; define an end of the body there",
                "position",
            )
        if not any((*self.stiffness, *self.damping, *self.preload)):
            raise problem("missing; a bushing needs stiffness, damping or a preload", "stiffness")
        if self.conservative:
            check_conservative(self.stiffness, "stiffness")
            check_conservative(self.damping, "damping")
        return self

    @property
    def rotation(self) -> Matrix:
        """Rotation matrix from bushing axes to axes of the end `from`."""
        return from_orientation(self.orientation)

    @property
    def numbers(self) -> Numbers:
        """Parameters of the force element: stiffness, damping and preload."""
        given_matrices, preload = (self.stiffness, self.damping), self.preload
        symmetric_entries, antisymmetric_entries = (
            tuple(x for given_matrix in given_matrices for x in part_of(given_matrix))
            for part_of in (upper_triangle, antisymmetric_part)
        )
        if self.element == "bearing3":
            symmetric_entries = tuple(
                given_matrix[k]
                for given_matrix in map(upper_triangle, given_matrices)
                for k in _TRANSLATION_POSITIONS
            )
            antisymmetric_entries = tuple(
                given_matrix[k]
                for given_matrix in map(antisymmetric_part, given_matrices)
                for k in (0, 1, 5)
            )
            preload = preload[:3]
        parameter_values = (*symmetric_entries, *preload)
        return (
            parameter_values if self.conservative else (*parameter_values, *antisymmetric_entries)
        )

    @property
    def element(self) -> str:
        """Name of the force element; one without moments, whose ends may spin, where possible."""
        if self.conservative:
            return "bushing6"
        moments = (matrix[i][j] for matrix in map(full_matrix, (self.stiffness, self.damping))
                   for i in range(6) for j in range(6) if max(i, j) > 2)  # fmt: skip
        return "bearing6" if any((*moments, *self.preload[3:])) else "bearing3"

    @property
    def stiffest(self) -> tuple[float, float]:
        """Largest stiffness along axes (N/m) and about them (N m/rad)."""
        return _largest_entries(self.stiffness)

    @property
    def most_damped(self) -> tuple[float, float]:
        """Largest damping along axes (N s/m) and about them (N m s/rad)."""
        return _largest_entries(self.damping)


def _largest_entries(given: Numbers) -> tuple[float, float]:
    matrix = full_matrix(given)
    translations, rotations = ([abs(matrix[i][j]) for i in indices for j in indices]
                    for indices in (range(3), range(3, 6)))  # fmt: skip
    return max(translations), max(rotations)
