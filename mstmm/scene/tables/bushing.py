"""Table [[bushing]]: spring and damper with three forces and three moments between two ends."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from ...numbers.rotations import Matrix, Vector, from_orientation
from ..rules import text as texts
from ..rules import turns
from ..rules import values as rules
from ..rules.symmetric import antisymmetric, full, refuse_nonconservative, six_by_six, triangle
from ..rules.values import GROUND, Numbers, Orientation, Shorthand, Table, refuse, split
from .body import End, as_end

_NOTHING = (0.0,) * 6
#: Positions of the translational entries in the upper triangle of a 6 x 6 matrix.
_ALONG = (0, 1, 2, 6, 7, 11)


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

    name: Annotated[str, texts.name("the bushing's name")] = ""
    from_: Annotated[str, texts.end()] = Field(alias="from")
    to: Annotated[str, texts.end()]
    position: Annotated[Vector, rules.vector("m")] = (0.0, 0.0, 0.0)
    orientation: Annotated[Orientation, turns.orientation()] = (0.0, 0.0, 0.0)
    rest: Annotated[
        End,
        Shorthand(
            "[x, y, z] in m, or a table with position and orientation", as_end, {"type": "array"}
        ),
    ] = End(position=(0.0, 0.0, 0.0))
    stiffness: Annotated[Numbers, six_by_six("N/m", "N m/rad")] = _NOTHING
    damping: Annotated[Numbers, six_by_six("N s/m", "N m s/rad")] = _NOTHING
    preload: Annotated[Numbers, rules.numbers("three forces in N and three moments in N m", 6)] = (
        _NOTHING
    )

    conservative: Annotated[bool, texts.flag()] = True

    @model_validator(mode="after")
    def _check(self) -> Bushing:
        bodies = (split(self.from_)[0], split(self.to)[0])
        if bodies[0] == bodies[1]:
            raise refuse(
                f'both ends are on "{bodies[0]}", so it has no effect; connect two bodies', "to"
            )
        if GROUND not in bodies and self.position != (0.0, 0.0, 0.0):
            raise refuse(
                "only a bushing on the ground has a position; define an end of the body there",
                "position",
            )
        if not any((*self.stiffness, *self.damping, *self.preload)):
            raise refuse("missing; a bushing needs stiffness, damping or a preload", "stiffness")
        if self.conservative:
            refuse_nonconservative(self.stiffness, "stiffness")
            refuse_nonconservative(self.damping, "damping")
        return self

    @property
    def rotation(self) -> Matrix:
        """Rotation matrix from bushing axes to axes of the end `from`."""
        return from_orientation(self.orientation)

    @property
    def numbers(self) -> Numbers:
        """Parameters of the force element: stiffness, damping and preload."""
        both, preload = (self.stiffness, self.damping), self.preload
        symmetric, skew = (
            tuple(x for one in both for x in part(one)) for part in (triangle, antisymmetric)
        )
        if self.element == "bearing3":
            symmetric = tuple(one[k] for one in map(triangle, both) for k in _ALONG)
            skew = tuple(one[k] for one in map(antisymmetric, both) for k in (0, 1, 5))
            preload = preload[:3]
        found = (*symmetric, *preload)
        return found if self.conservative else (*found, *skew)

    @property
    def element(self) -> str:
        """Name of the force element; one without moments, whose ends may spin, where possible."""
        if self.conservative:
            return "bushing6"
        moments = (matrix[i][j] for matrix in map(full, (self.stiffness, self.damping))
                   for i in range(6) for j in range(6) if max(i, j) > 2)  # fmt: skip
        return "bearing6" if any((*moments, *self.preload[3:])) else "bearing3"

    @property
    def stiffest(self) -> tuple[float, float]:
        """Largest stiffness along axes (N/m) and about them (N m/rad)."""
        return _largest(self.stiffness)

    @property
    def most_damped(self) -> tuple[float, float]:
        """Largest damping along axes (N s/m) and about them (N m s/rad)."""
        return _largest(self.damping)


def _largest(given: Numbers) -> tuple[float, float]:
    matrix = full(given)
    along, about = ([abs(matrix[i][j]) for i in part for j in part]
                    for part in (range(3), range(3, 6)))  # fmt: skip
    return max(along), max(about)
