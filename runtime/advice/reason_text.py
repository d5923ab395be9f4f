"""Reason for the model of a body as text, with the numbers behind it."""

from __future__ import annotations

from .body_model_levels import LINEAR, ONE_WAY, RIGID, STIFFENED, BodyModel
from .error_predictors import ErrorPrediction


def choice_reason(
    choice: BodyModel,
    richest: BodyModel,
    prediction: ErrorPrediction | None,
    in_measure: float,
    target_error: float,
) -> str:
    """Reason why a model suffices and no smaller one does.

    `in_measure` is the factor from m to the unit of errors.
    """
    if prediction is None:
        return "found by trial runs, without error estimates"
    deflects = f"it deflects by {prediction.deflection * in_measure:.1e}"
    if not prediction.deflection > 0:
        deflects = "its ends do not move in its floating frame"
    if choice.level == RIGID:
        omitted = ", about the error of a rigid body" if prediction.deflection > 0 else ""
        return f"{deflects}{omitted}"
    if choice.level == ONE_WAY:
        return (
            f"{deflects}; its reaction on the motion is small (chi {prediction.coupling:.2g}, "
            f"gamma {prediction.load_ratio:.1e})"
        )
    parts = [deflects, _stiffening_text(choice, prediction, in_measure, target_error)]
    omitted_shapes = sorted(name for name in prediction.by_shape if not choice.keeps_shape(name))
    if omitted_shapes:
        deflection = sum(prediction.by_shape[name] for name in omitted_shapes) * in_measure
        parts.append(
            f"the shapes left out ({', '.join(omitted_shapes)}) deflect it by {deflection:.1e}"
        )
    elif choice.shapes != richest.shapes:
        parts.append("fewer shapes suffice in trial runs")
    return "; ".join(parts)


def _stiffening_text(
    choice: BodyModel, prediction: ErrorPrediction, in_measure: float, target_error: float
) -> str:
    """Change of the stiffness by loads, and whether the model includes it."""
    effect = prediction.deflection * prediction.load_ratio * in_measure
    text = (
        f"its loads change its stiffness by gamma {prediction.load_ratio:.1e}, an effect of "
        f"{effect:.1e}"
    )
    if choice.level == LINEAR:
        return f"{text}, which linear kinematics neglect"
    needed = choice.level == STIFFENED and (effect > target_error or prediction.stiffens)
    return f"{text}, which stiffening includes" + ("" if needed else " at no cost")
