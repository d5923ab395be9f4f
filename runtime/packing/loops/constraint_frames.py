"""What holds the frames of constraints."""

from __future__ import annotations

from mstmm.numerics.rotations import IDENTITY, to_quaternion
from mstmm.scene import Constraint, Hinge
from mstmm.scene.tables.closures import CURVE
from mstmm.scene.tables.hinge_frames import axes_about
from mstmm.scene.validators.scalars_and_vectors import GROUND, split_reference

from ..coordinate_layout import OF_CONSTRAINT
from .curve_constraints import curve_hinge


def frame_hinge(constraint: Constraint) -> Hinge:
    """The hinge that holds the frame of a constraint where it begins: a weld, with z along the
    normal where there is one, or a way along the curve.  Their names are those of no scene."""
    name, normal = f"{constraint.name}{OF_CONSTRAINT}", constraint.unit_normal
    turned = IDENTITY if normal is None else axes_about(normal, None)
    weld = Hinge(name="frame", type="fixed", inboard=GROUND, outboard="frame",
                 orientation=to_quaternion(turned))  # fmt: skip
    on_ground = split_reference(constraint.from_)[0] == GROUND
    held = weld.model_copy(update={
        "name": name, "inboard": constraint.from_, "outboard": f"{name}/frame",
        "position": constraint.position if on_ground else (0.0, 0.0, 0.0),
    })  # fmt: skip
    return curve_hinge(constraint, held) if constraint.type == CURVE else held
