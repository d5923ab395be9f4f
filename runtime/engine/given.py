"""Input values set by the caller: numbers, or functions of time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from numpy.typing import ArrayLike

from mstmm.arrays import by_name, numbers, real
from mstmm.errors import SceneError
from mstmm.scene import Scene
from mstmm.scene.checks.inputs import users
from mstmm.scene.rules.messages import near

from ..breaks.acting import acting
from ..pack.parameters import data_of, made_of

#: A number, the name of a signal, (times, values), or the keys of a [[signal]].
GivenInput = float | str | tuple[ArrayLike, ArrayLike] | Mapping[str, Any]

_EXPECTED = "a number, the name of a signal, (times, values) or the keys of a [[signal]]"


def at_once(scene: Scene, inputs: Mapping[str, GivenInput]) -> dict[str, float | str] | None:
    """Check given inputs that change only values: numbers or names of signals, without drives.

    Returns them by name, or None if the scene must be validated again.  Raises SceneError for
    unknown inputs and invalid values.
    """
    known, signals = {one.name for one in scene.input}, {one.name for one in scene.signal}
    driving = {name for one in acting(scene) if one.drive for name in one.inputs}
    found: dict[str, float | str] = {}
    for name, given in by_name("inputs", inputs).items():
        if name not in known:
            raise _unknown(name, scene)
        _refuse_controlled(name, scene)
        unknown = isinstance(given, str) and given not in signals
        if name in driving or unknown or _over_time(given):
            return None
        found[name] = given if isinstance(given, str) else real(_at(name), given)
    return found


def with_inputs(scene: Scene, inputs: Mapping[str, GivenInput]) -> Scene:
    """Scene with other inputs, validated again; inputs over time become signals of it.

    Raises SceneError for unknown inputs and invalid values.
    """
    data = data_of(scene)
    tables = {table["name"]: table for table in data.get("input", [])}
    for name, given in by_name("inputs", inputs).items():
        if name not in tables:
            raise _unknown(name, scene)
        _refuse_controlled(name, scene)
        signal = _signal(name, given)
        if signal is None:
            tables[name]["value"] = given if isinstance(given, str) else real(_at(name), given)
            continue
        signals = data.setdefault("signal", [])
        signal["name"] = _free_name(scene, name)
        signals[:] = [other for other in signals if other["name"] != signal["name"]]
        signals.append(signal | {"unit": tables[name]["unit"]})
        tables[name]["value"] = signal["name"]
        tables[name].pop("rates", None)
    return made_of(data, scene, "scene with these inputs")


def _refuse_controlled(name: str, scene: Scene) -> None:
    if name in scene.controlled:
        raise SceneError(
            f'{_at(name)}: controller "{scene.controlled[name]}" sets this input; add another to '
            "the expression that reads it"
        )


def _unknown(name: str, scene: Scene) -> SceneError:
    if any(signal.name == name for signal in scene.signal):
        return SceneError(
            f"{_at(name)}: this is a signal of the scene and cannot be set; add an [[input]] with "
            f'value = "{name}" and set that'
        )
    hint = near(name, (one.name for one in scene.input))
    return SceneError(f"{_at(name)}: there is no such input in the scene{hint}")


def _at(name: str) -> str:
    return f'inputs["{name}"]'


def _signal(name: str, given: Any) -> dict[str, Any] | None:
    """Signal table of an input over time; None for a number or a name."""
    if isinstance(given, Mapping):
        return {key: _plain(name, key, value) for key, value in given.items()}
    if not _over_time(given):
        return None
    if len(given) != 2 or any(not hasattr(row, "__len__") for row in given):
        raise SceneError(f"{_at(name)}: expected {_EXPECTED}")
    return {
        key: _plain(name, key, row) for key, row in zip(("times", "values"), given, strict=True)
    }


def _over_time(given: Any) -> bool:
    alone = isinstance(given, str) or getattr(given, "ndim", 1) == 0  # arrays of one number
    return not alone and hasattr(given, "__len__")


def _plain(name: str, key: str, value: Any) -> Any:
    return numbers(f"{_at(name)} {key}", value).tolist() if key in ("times", "values") else value


def _free_name(scene: Scene, name: str) -> str:
    """Name of the signal that an input follows from now on.

    A signal of an earlier call that only this input uses is replaced.
    """
    taken = {*scene.channels, *scene.constants}
    alone = {signal for signal, user in users(scene) if user == name}
    alone -= {signal for signal, user in users(scene) if user != name}
    found = f"{name}_given"
    while found in taken - alone:
        found += "_"
    return found
