"""What inputs are in each trajectory of a batch: a number, or a signal with values of its own."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from mstmm.array_validation import Array, finite_array, mapping_by_name
from mstmm.errors import SceneError
from mstmm.numerics.piecewise_polynomial import PiecewisePolynomial, constant, interpolate

from ...discontinuities.active_expressions import active_expressions
from ...discontinuities.expression_functions import ExpressionFunctions
from ...engine.input_update import with_input_pieces
from ...engine.input_values import InputValue

if TYPE_CHECKING:
    from ...engine.compiled_scene import CompiledScene

#: As in `simulate`, or a number for each trajectory, or values (n, m) over times (m,).
BatchInput = InputValue | ArrayLike


@dataclass(frozen=True)
class BatchInputs:
    """Inputs over time by their names, one row of them for each trajectory."""

    rows: list[dict[str, PiecewisePolynomial]]

    def model(self, model: CompiledScene, k: int) -> CompiledScene:
        """The model under the inputs of a trajectory."""
        return (
            model.renewed(with_input_pieces(model.packed, self.rows[k])) if self.rows[k] else model
        )

    def timed(self, model: CompiledScene) -> CompiledScene:
        """The model with the times of those that go by time, and its own numbers for the others:
        where steps end, they end in all trajectories."""
        varying = {name: one for name, one in self.rows[0].items() if one.varies}
        return model.renewed(with_input_pieces(model.packed, varying)) if varying else model

    def moves_breaks(self, model: CompiledScene) -> bool:
        """Whether numbers that differ decide when an expression of time switches or is fast."""
        names = {name for name, one in self.rows[0].items() if not one.varies}
        for one in active_expressions(model.scene):
            if names & set(one.inputs):
                known = dict(one.constants)
                unknown = {name: x for name, x in known.items() if name not in names}
                if _looked_at(one, known) != _looked_at(one, unknown):
                    return True
        return False


def _looked_at(one: Any, constants: dict[str, float]) -> int:
    view = ExpressionFunctions(one.expression, constants, one.drive)
    return len(view.margins()) + len(view.watched())


def batch_inputs(
    model: CompiledScene, inputs: Mapping[str, BatchInput] | None, n: int
) -> BatchInputs:
    """The inputs of n trajectories.

    Raises SceneError for names of no input, for values that no input can have or that are not as
    many, and for inputs that drive.
    """
    given = {} if inputs is None else mapping_by_name("inputs", inputs)
    _refuse_drives(model, given)
    columns = [(name, *_columns(name, value, n)) for name, value in given.items()]
    checked = model.with_inputs({name: first for name, first, _ in columns}) if n else model
    rows: list[dict[str, PiecewisePolynomial]] = [{} for _ in range(n)]
    for name, first, each in columns:
        one = checked.scene.channels[name]
        for k, row in enumerate(rows):
            if each is None:
                row[name] = one
            elif isinstance(first, Mapping):
                kind = first.get("interpolation", "line")
                row[name] = interpolate(first["times"], each[k].tolist(), kind)
            else:
                row[name] = constant(float(each[k]))
    return BatchInputs(rows)


def rows_of(name: str, value: Any) -> int:
    """For how many trajectories a number or an input is given; 1 where it serves all."""
    if isinstance(value, str):
        return 1
    over_time, of_each = isinstance(value, Mapping) or _is_pair(value), value
    if over_time:
        of_each = value.get("values", 0.0) if isinstance(value, Mapping) else value[1]
    found = finite_array(name, of_each)
    return len(found) if found.ndim == 1 + over_time else 1


def _refuse_drives(model: CompiledScene, given: Mapping[str, Any]) -> None:
    for one in active_expressions(model.scene):
        driving = [name for name in one.inputs if one.drive and name in given]
        if driving:
            raise SceneError(
                f'inputs["{driving[0]}"]: the {one.what} follows this input, which a batch takes '
                f'as a parameter: parameters={{"{driving[0]}.value": ...}}'
            )


def _columns(name: str, value: Any, n: int) -> tuple[InputValue, Array | None]:
    """What the first trajectory is given, and the values (n,) or (n, m) of each; None where one
    serves all."""
    at = f'inputs["{name}"]'
    if isinstance(value, str):
        return value, None
    if isinstance(value, Mapping):
        return _over_time(at, dict(value), n) if "values" in value else (value, None)
    if _is_pair(value):
        return _over_time(at, {"times": value[0], "values": value[1]}, n)
    column = finite_array(at, value)
    if column.shape not in ((), (n,)):
        raise SceneError(f"{at} has shape {column.shape}, expected ({n},)")
    return float(column.flat[0]) if column.size else 0.0, np.broadcast_to(column, (n,))


def _is_pair(value: Any) -> bool:
    return hasattr(value, "__len__") and len(value) == 2 and all(
        hasattr(row, "__len__") for row in value
    )  # fmt: skip


def _over_time(at: str, keys: dict[str, Any], n: int) -> tuple[InputValue, Array | None]:
    values = finite_array(f"{at} values", keys["values"])
    if values.ndim < 2:
        return keys | {"values": values}, None
    if values.ndim > 2 or len(values) != n:
        raise SceneError(
            f"{at} values have shape {values.shape}, expected (m,), or ({n}, m) with a row for each"
        )
    times = finite_array(f"{at} times", keys.get("times", ())).tolist()
    return keys | {"times": times, "values": values[0]}, values
