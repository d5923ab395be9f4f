"""Input values set by the caller: numbers or functions of time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from numpy.typing import ArrayLike

from mstmm.array_validation import finite_array, finite_float, mapping_by_name
from mstmm.errors import SceneError
from mstmm.scene import Scene
from mstmm.scene.checks.inputs import input_references
from mstmm.scene.validators.validation_messages import did_you_mean

from ..discontinuities.active_expressions import active_expressions
from ..packing.scene_parameters import scene_data, scene_from_data

#: A number, the name of a signal, (times, values), or the keys of a [[signal]].
InputValue = float | str | tuple[ArrayLike, ArrayLike] | Mapping[str, Any]

_EXPECTED_INPUT = "a number, the name of a signal, (times, values) or the keys of a [[signal]]"


def apply_without_recompile(
    scene: Scene, inputs: Mapping[str, InputValue]
) -> dict[str, float | str] | None:
    """Validate inputs that change only values: numbers or signal names, without drives.

    Returns them by name, or None if the scene must be validated again.  Raises SceneError for
    unknown inputs and invalid values.
    """
    input_names, signal_names = (
        {channel.name for channel in scene.input},
        {channel.name for channel in scene.signal},
    )
    driving_inputs = {
        name for channel in active_expressions(scene) if channel.drive for name in channel.inputs
    }
    values: dict[str, float | str] = {}
    for name, value in mapping_by_name("inputs", inputs).items():
        if name not in input_names:
            raise _unknown_input_error(name, scene)
        _check_not_controlled(name, scene)
        is_unknown_signal = isinstance(value, str) and value not in signal_names
        if name in driving_inputs or is_unknown_signal or _is_over_time(value):
            return None
        values[name] = value if isinstance(value, str) else finite_float(_input_label(name), value)
    return values


def scene_with_inputs(scene: Scene, inputs: Mapping[str, InputValue]) -> Scene:
    """Scene with other inputs, validated again; inputs over time become signals.

    Raises SceneError for unknown inputs and invalid values.
    """
    data = scene_data(scene)
    tables = {table["name"]: table for table in data.get("input", [])}
    for name, value in mapping_by_name("inputs", inputs).items():
        if name not in tables:
            raise _unknown_input_error(name, scene)
        _check_not_controlled(name, scene)
        signal = _signal_table(name, value)
        if signal is None:
            tables[name]["value"] = (
                value if isinstance(value, str) else finite_float(_input_label(name), value)
            )
            continue
        signals = data.setdefault("signal", [])
        signal["name"] = _unused_signal_name(scene, name)
        signals[:] = [
            other_table for other_table in signals if other_table["name"] != signal["name"]
        ]
        signals.append(signal | {"unit": tables[name]["unit"]})
        tables[name]["value"] = signal["name"]
        tables[name].pop("rates", None)
    return scene_from_data(data, scene, "scene with these inputs")


def _check_not_controlled(name: str, scene: Scene) -> None:
    if name in scene.controllers_by_input:
        raise SceneError(
            f'{_input_label(name)}: controller "{scene.controllers_by_input[name]}" sets this '
            "input; add another input to the expression that reads it"
        )


def _unknown_input_error(name: str, scene: Scene) -> SceneError:
    if any(signal.name == name for signal in scene.signal):
        return SceneError(
            f"{_input_label(name)}: this is a signal of the scene and cannot be set; add an "
            f"[[input]] with "
            f'value = "{name}" and set that'
        )
    suggestion = did_you_mean(name, (channel.name for channel in scene.input))
    return SceneError(f"{_input_label(name)}: there is no such input in the scene{suggestion}")


def _input_label(name: str) -> str:
    return f'inputs["{name}"]'


def _signal_table(name: str, given: Any) -> dict[str, Any] | None:
    """Signal table of an input over time; None for a number or a signal name."""
    if isinstance(given, Mapping):
        return {key: _plain_value(name, key, value) for key, value in given.items()}
    if not _is_over_time(given):
        return None
    if len(given) != 2 or any(not hasattr(row, "__len__") for row in given):
        raise SceneError(f"{_input_label(name)}: expected {_EXPECTED_INPUT}")
    return {
        key: _plain_value(name, key, row)
        for key, row in zip(("times", "values"), given, strict=True)
    }


def _is_over_time(given: Any) -> bool:
    is_single = isinstance(given, str) or getattr(given, "ndim", 1) == 0  # arrays of one number
    return not is_single and hasattr(given, "__len__")


def _plain_value(name: str, key: str, value: Any) -> Any:
    return (
        finite_array(f"{_input_label(name)} {key}", value).tolist()
        if key in ("times", "values")
        else value
    )


def _unused_signal_name(scene: Scene, name: str) -> str:
    """Name for the new signal of an input.

    It may be that of a signal of an earlier call that only this input uses, which is replaced.
    """
    used_names = {*scene.channels, *scene.constants}
    own_signals = {signal for signal, user_name in input_references(scene) if user_name == name}
    own_signals -= {signal for signal, user_name in input_references(scene) if user_name != name}
    signal_name = f"{name}_given"
    while signal_name in used_names - own_signals:
        signal_name += "_"
    return signal_name
