"""Result as an xarray Dataset: all quantities with dimensions, units and long names."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from mstmm.ir.hinge_properties import effort_unit
from mstmm.optional_packages import missing_package_error

from ...engine.quantity_registry import (
    BODY_QUANTITIES,
    HINGE_QUANTITIES,
    SUMS,
    acceleration_name,
    rate_unit,
)
from .. import mesh_files
from ..flexible import dataset as flexible
from ..sources.euler_angles import EULER_KIND
from . import provenance
from .text_table import flat_columns

if TYPE_CHECKING:
    from ..quantity_names import Quantity
    from ..result_record import Record


#: Largest number of speeds of a scene for which all bodies and hinges are written.
MAX_SPEEDS = 5000
_OPTIONAL_LABELS = ("body", "hinge", "flexible", "mode")


def to_dataset(result: Record) -> Any:
    """`xarray.Dataset` of a result.

    Dimensions are time, coordinate, speed, hinge, body, axis, component, angle, and, where they
    exist, spring, load and so on. `body` holds bodies and their ends ("rod1", "rod1.tip"),
    `coordinate` and `speed` the entries of q and u ("shoulder.angle", "shoulder.angle_rate"), with
    the unit of each as a variable. Above `MAX_SPEEDS` speeds, motions of bodies and loads of hinges
    are left out: they follow from the states, and a loaded result computes them on demand.
    """
    try:
        import xarray
    except ImportError as error:
        raise missing_package_error("io", "an xarray Dataset", error) from None
    data_variables, labels = dataset_variables(result)
    data_variables |= provenance.provenance_variables(result)
    files = mesh_files.variables(result.model.scene, result.meshes)
    return xarray.Dataset({**data_variables, **files}, labels, provenance.file_attributes(result))


Variable = tuple[tuple[str, ...], Any, dict[str, str]]


def dataset_variables(result: Record) -> tuple[dict[str, Variable], dict[str, Variable]]:
    """Variables of a run, and the labels of its dimensions; see `to_dataset`."""
    result_variables, labels = _state_variables(result), _dimension_labels(result)
    if result.model.nu <= MAX_SPEEDS:
        result_variables |= (
            _body_variables(result) | _hinge_variables(result) | flexible.variables(result)
        )
        result_variables |= _element_variables(result)
    else:
        labels = {key: label for key, label in labels.items() if key not in _OPTIONAL_LABELS}
    return result_variables | _sum_variables(result) | _input_and_output_variables(result), labels


def _text_array(values: list[str]) -> Any:
    return np.array(values, dtype=object) if values else np.array([], dtype="<U1")


def _attributes(unit: str, long_name: str) -> dict[str, str]:
    return {"units": unit or "1", "long_name": long_name}


def _common_unit(units: list[str]) -> str:
    """Unit of an array whose columns may have different units."""
    return (units[0] or "1") if len(set(units)) == 1 else "see the units of the labels"


def _dimension_labels(result: Record) -> dict[str, Variable]:
    layout = result.model.coordinate_layout
    owners = list(layout.owners)
    q_units = [unit or "1" for h in owners for unit in h.q_units]
    u_units = [unit or "1" for h in owners for unit in h.u_units]
    udot = [f"{h.name}.{acceleration_name(n)}" for h in owners for n in h.u_names]
    text_labels: dict[str, tuple[str, list[str], str]] = {
        "coordinate": ("coordinate", layout.q_names, "coordinate of a hinge or a mode"),
        "coordinate_units": ("coordinate", q_units, "unit of the coordinate"),
        "speed": ("speed", layout.u_names, "speed of a hinge or a mode"),
        "speed_units": ("speed", u_units, "unit of the speed"),
        "acceleration_name": ("speed", udot, "name of the speed's rate"),
        "effort_units": ("speed", [effort_unit(u) for u in u_units], "unit of the effort"),
        "hinge": ("hinge", list(layout.hinges), "hinge"),
        "body": ("body", list(result._observations.references), "body or end of a body"),
        "axis": ("axis", ["x", "y", "z"], "inertial axis"),
        "component": ("component", ["w", "x", "y", "z"], "component of a quaternion"),
        "angle": ("angle", list(EULER_KIND.labels), EULER_KIND.long_name),
        **flexible.labels(result),
    }
    labels: dict[str, Variable] = {"time": (("time",), result.t, _attributes("s", "time"))}
    for name, (dim, words, long_name) in text_labels.items():
        labels[name] = ((dim,), _text_array(words), {"long_name": long_name})
    return labels


def _state_variables(result: Record) -> dict[str, Variable]:
    owners = list(result.model.coordinate_layout.owners)
    q_units = [unit for h in owners for unit in h.q_units]
    u_units = [unit for h in owners for unit in h.u_units]
    by_speed, efforts = ("time", "speed"), [effort_unit(unit) for unit in u_units]
    rates = [rate_unit(unit) for unit in u_units]
    effort = result._observations.part("efforts")
    return {
        "q": (
            ("time", "coordinate"),
            result.q,
            _attributes(_common_unit(q_units), "hinge coordinates"),
        ),
        "u": (by_speed, result.u, _attributes(_common_unit(u_units), "hinge speeds")),
        "udot": (
            by_speed,
            result.udot,
            _attributes(_common_unit(rates), "rates of the hinge speeds"),
        ),
        "effort": (
            by_speed,
            effort,
            _attributes(_common_unit(efforts), "efforts of laws and drives"),
        ),
    }


def _body_variables(result: Record) -> dict[str, Variable]:
    names = result._observations.references
    result_variables: dict[str, Variable] = {}
    for kind, description in BODY_QUANTITIES.items():
        columns = [result._quantities.body_quantity(name, kind) for name in names]
        values = np.stack(columns, axis=1) if columns else np.zeros((len(result.t), 0, 3))
        last = "component" if kind == "orientation" else "axis"
        result_variables[kind] = (
            ("time", "body", last),
            values,
            _attributes(description.unit, description.long_name),
        )
    angles = [result.quantity(f"{name}.euler").values for name in names]
    values = np.stack(angles, axis=1) if angles else np.zeros((len(result.t), 0, 3))
    result_variables["euler"] = (
        ("time", "body", "angle"),
        values,
        _attributes("rad", EULER_KIND.long_name),
    )
    return result_variables


def _hinge_variables(result: Record) -> dict[str, Variable]:
    names = list(result.model.coordinate_layout.hinges)
    result_variables: dict[str, Variable] = {}
    for kind, description in HINGE_QUANTITIES.items():
        columns = [result._quantities.hinge_quantity(name, kind) for name in names]
        values = np.stack(columns, axis=1) if columns else np.zeros((len(result.t), 0, 3))
        long_name = f"{description.long_name}, inertial axes"
        result_variables[kind] = (
            ("time", "hinge", "axis"),
            values,
            _attributes(description.unit, long_name),
        )
    return result_variables


def _input_and_output_variables(result: Record) -> dict[str, Variable]:
    """Inputs, signals and outputs, as "input_motor", "signal_wind" and "output_height"."""
    scene, result_variables = result.model.scene, dict[str, Variable]()
    names = {
        "input": [channel.name for channel in scene.input],
        "signal": [channel.name for channel in scene.signal],
        "output": result._quantities.outputs(),
    }
    for word, channel_names in names.items():
        for name in channel_names:
            result_variables |= _quantity_variables(f"{word}_{name}", result.quantity(name))
    return result_variables


def _element_variables(result: Record) -> dict[str, Variable]:
    """Variables of springs, loads, bushings and loop constraints: "spring_length" by spring.

    nan for quantities that one of them lacks.
    """
    owners_by_word: dict[str, list[str]] = {}
    quantities_by_kind: dict[tuple[str, str], dict[str, Quantity]] = {}
    for quantity in result._quantities.load_vectors():
        word, _, owner = quantity.owner.partition(" ")
        if owner not in owners_by_word.setdefault(word, []):
            owners_by_word[word].append(owner)
        quantities_by_kind.setdefault((word, quantity.name.rpartition(".")[2]), {})[owner] = (
            quantity
        )
    result_variables: dict[str, Variable] = {
        word: ((word,), _text_array(owners), {"long_name": word})
        for word, owners in owners_by_word.items()
    }
    for (word, kind), quantities in quantities_by_kind.items():
        first = next(iter(quantities.values()))
        missing_values = np.full(first.values.shape, np.nan)
        columns = [
            quantities[name].values if name in quantities else missing_values
            for name in owners_by_word[word]
        ]
        dims = ("time", word, *(_DIMENSIONS[first.labels] if first.labels else ()))
        description = _attributes(
            _common_unit([x.unit for x in quantities.values()]), first.description
        )
        result_variables[f"{word}_{kind}"] = (dims, np.stack(columns, axis=1), description)
    return result_variables


def _quantity_variables(key: str, known: Quantity) -> dict[str, Variable]:
    """One variable, or one for each column if the columns are not axes."""
    description = _attributes(known.unit, known.long_name)
    if known.labels in _DIMENSIONS:
        return {key: (("time", *_DIMENSIONS[known.labels]), known.values, description)}
    ends = [f"_{label}" for label in known.labels] or [""]
    return {
        f"{key}{end}": (("time",), values, description)
        for end, (_, _, values) in zip(ends, flat_columns([known]), strict=True)
    }


#: Dimensions of vectors by the labels of their components.
_DIMENSIONS: dict[tuple[str, ...], tuple[str, ...]] = {
    tuple("xyz"): ("axis",), tuple("wxyz"): ("component",), EULER_KIND.labels: ("angle",),
}  # fmt: skip


def _sum_variables(result: Record) -> dict[str, Variable]:
    result_variables: dict[str, Variable] = {}
    for name, (unit, long_name, _) in SUMS.items():
        values = result._quantities.sum(name)
        dims = ("time", "axis") if values.ndim == 2 else ("time",)
        result_variables[name.replace(".", "_")] = (dims, values, _attributes(unit, long_name))
    work = result.quantity("work")
    result_variables["work"] = (("time",), work.values, _attributes("J", work.long_name))
    return result_variables
