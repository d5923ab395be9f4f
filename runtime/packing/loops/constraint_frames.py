"""Hinges that carry the frames of constraints."""

from __future__ import annotations

from mstmm.numerics.rotations import IDENTITY, to_quaternion
from mstmm.scene import Constraint, Hinge
from mstmm.scene.tables.closures import CURVE
from mstmm.scene.tables.hinge_frames import axes_about
from mstmm.scene.validators.scalars_and_vectors import GROUND, split_reference

from ..coordinate_layout import OF_CONSTRAINT
from .curve_constraints import curve_hinge


def frame_hinge(constraint: Constraint) -> Hinge:
    """Hinge between the end `from` of a constraint and its frame, with a reserved name.

    It is a weld, with z along the normal if there is one; of a point on a curve it moves along it.
    """
    name, normal = f"{constraint.name}{OF_CONSTRAINT}", constraint.unit_normal
    axes = IDENTITY if normal is None else axes_about(normal, None)
    weld = Hinge(name="frame", type="fixed", inboard=GROUND, outboard="frame",
                 orientation=to_quaternion(axes))  # fmt: skip
    on_ground = split_reference(constraint.from_)[0] == GROUND
    weld = weld.model_copy(update={
        "name": name, "inboard": constraint.from_, "outboard": f"{name}/frame",
        "position": constraint.position if on_ground else (0.0, 0.0, 0.0),
    })  # fmt: skip
    return curve_hinge(constraint, weld) if constraint.type == CURVE else weld
