"""Inputs of the trajectories of a batch: constants or signals, common or per trajectory."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from mstmm.array_validation import Array, finite_array, mapping_by_name
from mstmm.errors import SceneError
from mstmm.numerics.piecewise_polynomial import PiecewisePolynomial, constant, interpolate

from ..discontinuities.active_expressions import ExpressionFunctions, active_expressions
from ..engine.inputs import InputValue, with_input_pieces

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene

#: As in `simulate`, or numbers (n,), one per trajectory, or values (n, m) over times (m,).
BatchInput = InputValue | ArrayLike


@dataclass(frozen=True)
class BatchInputs:
    """Inputs over time: per trajectory, input name -> piecewise polynomial."""

    rows: list[dict[str, PiecewisePolynomial]]

    def model(self, model: CompiledScene, k: int) -> CompiledScene:
        """Model with the inputs of trajectory k."""
        return _with_pieces(model, self.rows[k])

    def with_times(self, model: CompiledScene) -> CompiledScene:
        """Model with the time-dependent inputs, whose breaks end steps in all trajectories."""
        varying = {name: signal for name, signal in self.rows[0].items() if signal.varies}
        return _with_pieces(model, varying)

    def moves_breaks(self, model: CompiledScene) -> bool:
        """True if constant inputs determine when an expression of time switches or is narrow."""
        names = {name for name, signal in self.rows[0].items() if not signal.varies}
        for active in active_expressions(model.scene):
            if names & set(active.inputs):
                constants = dict(active.constants)
                other_constants = {name: x for name, x in constants.items() if name not in names}
                if _feature_count(active, constants) != _feature_count(active, other_constants):
                    return True
        return False


def _with_pieces(model: CompiledScene, pieces: dict[str, PiecewisePolynomial]) -> CompiledScene:
    if not pieces:
        return model
    return model.with_packed_scene(with_input_pieces(model.packed_scene, pieces))


def _feature_count(active: Any, constants: dict[str, float]) -> int:
    """Number of switches and narrow features of an active expression of time."""
    functions = ExpressionFunctions(active.expression, constants, active.drive)
    return len(functions.margins()) + len(functions.narrow_candidates())


def batch_inputs(
    model: CompiledScene, inputs: Mapping[str, BatchInput] | None, n: int
) -> BatchInputs:
    """Inputs of n trajectories.

    Raises SceneError for unknown inputs, invalid values or array sizes, and for inputs that
    prescribe a motion.
    """
    given = {} if inputs is None else mapping_by_name("inputs", inputs)
    _reject_drives(model, given)
    columns = [(name, *_column(name, value, n)) for name, value in given.items()]
    checked = model.with_inputs({name: first for name, first, _ in columns}) if n else model
    rows: list[dict[str, PiecewisePolynomial]] = [{} for _ in range(n)]
    for name, first, values in columns:
        common = checked.scene.channels[name]
        for k, row in enumerate(rows):
            if values is None:
                row[name] = common
            elif isinstance(first, Mapping):
                kind = first.get("interpolation", "line")
                row[name] = interpolate(first["times"], values[k].tolist(), kind)
            else:
                row[name] = constant(float(values[k]))
    return BatchInputs(rows)


def row_count(name: str, value: Any) -> int:
    """Number of trajectories that a parameter or an input is given for; 1 for a common value."""
    if isinstance(value, str):
        return 1
    is_signal, values = isinstance(value, Mapping) or _is_pair(value), value
    if is_signal:
        values = value.get("values", 0.0) if isinstance(value, Mapping) else value[1]
    array = finite_array(name, values)
    return len(array) if array.ndim == 1 + is_signal else 1


def _reject_drives(model: CompiledScene, given: Mapping[str, Any]) -> None:
    for active in active_expressions(model.scene):
        names = [name for name in active.inputs if active.drive and name in given]
        if names:
            raise SceneError(
                f'inputs["{names[0]}"]: the {active.description} follows this input, expected an '
                f'input that prescribes no motion; use parameters={{"{names[0]}.value": ...}}'
            )


def _column(name: str, value: Any, n: int) -> tuple[InputValue, Array | None]:
    """Input of the first trajectory, and values (n,) or (n, m) of all; None for a common input."""
    where = f'inputs["{name}"]'
    if isinstance(value, str):
        return value, None
    if isinstance(value, Mapping):
        return _signal_column(where, dict(value), n) if "values" in value else (value, None)
    if _is_pair(value):
        return _signal_column(where, {"times": value[0], "values": value[1]}, n)
    column = finite_array(where, value)
    if column.shape not in ((), (n,)):
        raise SceneError(f"{where} has shape {column.shape}, expected ({n},)")
    return float(column.flat[0]) if column.size else 0.0, np.broadcast_to(column, (n,))


def _is_pair(value: Any) -> bool:
    return hasattr(value, "__len__") and len(value) == 2 and all(
        hasattr(row, "__len__") for row in value
    )  # fmt: skip


def _signal_column(where: str, keys: dict[str, Any], n: int) -> tuple[InputValue, Array | None]:
    values = finite_array(f"{where} values", keys["values"])
    if values.ndim < 2:
        return keys | {"values": values}, None
    if values.ndim > 2 or len(values) != n:
        raise SceneError(
            f"{where} values have shape {values.shape}, expected (m,) for all trajectories or "
            f"({n}, m) with a row per trajectory"
        )
    times = finite_array(f"{where} times", keys.get("times", ())).tolist()
    return keys | {"times": times, "values": values[0]}, values
