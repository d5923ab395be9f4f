"""The reason of a choice in words, with the figures that speak for it."""

from __future__ import annotations

from .body_model_levels import LINEAR, ONE_WAY, RIGID, STIFFENED, BodyModel
from .error_predictors import ErrorPrediction


def reason(
    choice: BodyModel,
    richest: BodyModel,
    known: ErrorPrediction | None,
    in_measure: float,
    asked: float,
) -> str:
    """Why a body may be this, and why it may not be less; `in_measure` turns m into the unit of
    errors."""
    if known is None:
        return "found by trying, for nothing was known of it beforehand"
    deflects = f"it deflects by {known.deflection * in_measure:.1e}"
    if not known.deflection > 0:
        deflects = "its ends do not leave its frame, whatever it does between them"
    if choice.level == RIGID:
        left_out = ", about what a rigid body leaves out" if known.deflection > 0 else ""
        return f"{deflects}{left_out}"
    if choice.level == ONE_WAY:
        return (
            f"{deflects}; its reaction on the motion is little (chi {known.coupling:.2g}, "
            f"gamma {known.load_ratio:.1e})"
        )
    parts = [deflects, _kinematics(choice, known, in_measure, asked)]
    left = sorted(name for name in known.by_shape if not choice.keeps(name))
    if left:
        size = sum(known.by_shape[name] for name in left) * in_measure
        parts.append(f"the shapes left out ({', '.join(left)}) deflect it by {size:.1e}")
    elif choice.shapes != richest.shapes:
        parts.append("fewer shapes were seen to suffice")
    return "; ".join(parts)


def _kinematics(choice: BodyModel, known: ErrorPrediction, in_measure: float, asked: float) -> str:
    """What loads change of its stiffness, and whether that was needed."""
    size = known.deflection * known.load_ratio * in_measure
    told = f"its loads change its stiffness by gamma {known.load_ratio:.1e}, about {size:.1e}"
    if choice.level == LINEAR:
        return f"{told}, which linear kinematics leave out"
    needed = choice.level == STIFFENED and (size > asked or known.stiffens)
    return f"{told}, which stiffening takes in" + ("" if needed else " at no cost")
