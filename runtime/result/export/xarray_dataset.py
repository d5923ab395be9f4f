"""Result as an xarray Dataset with units and long names, and result files."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import EnvironmentFailure, SceneError
from mstmm.ir.hinge_properties import effort_unit
from mstmm.optional_packages import missing_package_error

from ...engine.quantity_registry import (
    BODY_QUANTITIES,
    EULER_KIND,
    FLEXIBLE_QUANTITIES,
    HINGE_QUANTITIES,
    MASS_QUANTITIES,
    SUMS,
    WXYZ,
    XYZ,
    QuantityKind,
    acceleration_name,
    rate_unit,
)
from ...platform_support.safe_files import replace_atomically, seal
from ..result_record import Record
from . import provenance
from .column_files import TABLES, flat_columns, write_table

if TYPE_CHECKING:
    from ...flexible.modal_body import ModalBody
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
    files = provenance.mesh_variables(result)
    return xarray.Dataset({**data_variables, **files}, labels, provenance.file_attributes(result))


Variable = tuple[tuple[str, ...], Any, dict[str, str]]


def dataset_variables(result: Record) -> tuple[dict[str, Variable], dict[str, Variable]]:
    """Variables of a run, and the labels of its dimensions; see `to_dataset`."""
    result_variables, labels = _state_variables(result), _dimension_labels(result)
    if result.model.nu <= MAX_SPEEDS:
        quantities, flexible = result._quantities, list(result.model.flexible_bodies)
        kinds = [kind for kind in HINGE_QUANTITIES.values() if kind.part]
        result_variables |= _by_owner(
            "body", list(result._observations.references), BODY_QUANTITIES.values(),
            lambda name, kind: quantities.body_quantity(name, kind.name),
        )  # fmt: skip
        result_variables |= _by_owner(
            "hinge", list(result.model.coordinate_layout.hinges), kinds,
            lambda name, kind: quantities.hinge_quantity(name, kind.name), "inertial axes",
        )  # fmt: skip
        if flexible:
            result_variables |= _flexible_variables(result, flexible)
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
        **_flexible_labels(result),
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


def _by_owner(
    dimension: str, names: Sequence[str], kinds: Iterable[QuantityKind],
    get: Callable[[str, QuantityKind], Array], axes: str = "", prefix: str = "",
) -> dict[str, Variable]:  # fmt: skip
    """Variables of some kinds, each stacked over its owners."""
    result_variables: dict[str, Variable] = {}
    for kind in kinds:
        values = np.stack([get(name, kind) for name in names], axis=1)
        long_name = f"{kind.long_name}, {axes}" if axes else kind.long_name
        dims = ("time", dimension, *_DIMENSIONS[kind.labels])
        result_variables[prefix + kind.name] = (dims, values, _attributes(kind.unit, long_name))
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
        dims = ("time", word, *_DIMENSIONS[first.labels])
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
    (): (), XYZ: ("axis",), WXYZ: ("component",), EULER_KIND.labels: ("angle",),
}  # fmt: skip


def _sum_variables(result: Record) -> dict[str, Variable]:
    result_variables: dict[str, Variable] = {}
    for name, kind in SUMS.items():
        dims, description = _DIMENSIONS[kind.labels], _attributes(kind.unit, kind.long_name)
        values = result._quantities.sum(name)
        result_variables[name.replace(".", "_")] = (("time", *dims), values, description)
    work = result.quantity("work")
    result_variables["work"] = (("time",), work.values, _attributes("J", work.long_name))
    return result_variables


#: Stations along a beam at which its shape functions are written.
STATION_COUNT = 41

#: Largest number of flexible bodies whose shape functions are written; for more, use the scene in
#: the file.
_MAX_WRITTEN_BODIES = 40


def _flexible_labels(result: Record) -> dict[str, tuple[str, list[str], str]]:
    """Map from name to (dimension, labels, long name)."""
    bodies = result.model.flexible_bodies
    if not bodies:
        return {}
    modes = [f"{name}.{mode}" for name, body in bodies.items() for mode in body.modes]
    return {
        "flexible": ("flexible", list(bodies), "flexible body"),
        "mode": ("mode", modes, "modal coordinate, as in coordinate"),
    }


def _flexible_variables(result: Record, names: Sequence[str]) -> dict[str, Variable]:
    """Modal energies, equivalent motions of flexible bodies, and shape functions of beams.

    The shape functions give the deflection anywhere along a beam from the modal coordinates in q.
    """

    def get(name: str, kind: QuantityKind) -> Array:
        return np.asarray(getattr(result, kind.method or kind.name)(name))

    energy = np.concatenate([result.modal_energy(name) for name in names], axis=1)
    text = "strain energy of modes and kinetic energy relative to the frame"
    result_variables: dict[str, Variable] = {
        "modal_energy": (("time", "mode"), energy, _attributes("J", text)),
        **_by_owner("flexible", names, [FLEXIBLE_QUANTITIES["strain_energy"]], get),
        **_by_owner("flexible", names, MASS_QUANTITIES.values(), get, "inertial axes", "flexible_"),
    }
    if len(names) <= _MAX_WRITTEN_BODIES:
        for name, body in result.model.flexible_bodies.items():
            result_variables |= {} if body.shapes is None else _shape_variables(name, body)
    return result_variables


def _shape_variables(name: str, body: ModalBody) -> dict[str, Variable]:
    """Shape functions of a beam: deflection = phi eta - 1/2 eta^T second_order eta."""
    shapes = body.shapes
    assert shapes is not None
    x = np.linspace(0.0, shapes.length, STATION_COUNT)
    values, station, modes = shapes.values_at(x), f"{name}_x", f"{name}_mode"
    second_order = np.zeros((len(x), 3, body.n, body.n))
    if shapes.stiffening:
        second_order = shapes.second_order.field_at(x)[:, :3]
    words = np.array(body.modes, dtype=object)
    return {
        station: ((station,), x, _attributes("m", f"position along {name}")),
        modes: ((modes,), words, {"long_name": f"mode of {name}"}),
        f"{name}_phi": (
            (station, "axis", modes),
            values.phi,
            _attributes("1", f"displacement of the axis of {name} per mode, frame axes"),
        ),
        f"{name}_theta": (
            (station, "axis", modes),
            values.theta,
            _attributes("1/m", f"rotation vector of the sections of {name} per mode, frame axes"),
        ),
        f"{name}_second_order": (
            (station, "axis", modes, f"{modes}_2"),
            second_order,
            _attributes(
                "1/m", f"displacement of second order of {name}, frame axes: -1/2 eta^T g eta"
            ),
        ),
    }


def save_result(result: Record, path: Path) -> Path:
    """Write a result in the format given by the suffix."""
    if path.suffix.lower() == ".nc":
        return save_dataset(partial(to_dataset, result), path)
    if path.suffix.lower() not in TABLES:
        raise SceneError(f'result file "{path}": expected a name that ends in .nc, .csv or .mat')
    if result.model.nu > MAX_SPEEDS:
        raise SceneError(
            f'result file "{path}": a table of a scene with {result.model.nu} speeds has too many '
            "columns; write .nc, or the quantities you need (result.quantity)"
        )
    quantities = [result.quantity(name) for name in result._quantities.scalars()]
    return write_table(result.t, result.event, quantities, path, result.model.scene.to_toml())


def save_dataset(build_dataset: Callable[[], Any], path: Path) -> Path:
    """Write a Dataset as NetCDF, followed by its hash."""
    with replace_atomically(path) as temporary:
        _write_netcdf(build_dataset(), temporary)
    return path


def _write_netcdf(data: Any, path: Path) -> None:
    try:
        import h5netcdf  # noqa: F401
    except ImportError as error:
        raise missing_package_error("io", "a NetCDF file", error) from None
    _require_disk_space(int(data.nbytes) + _NETCDF_OVERHEAD, path)
    data.to_netcdf(path, engine="h5netcdf")
    seal(path)


#: Upper bound of the bytes of a NetCDF file in addition to its arrays.
_NETCDF_OVERHEAD = 2_000_000


def _require_disk_space(size: int, path: Path) -> None:
    """EnvironmentFailure if the disk is too full, because HDF5 crashes the process then."""
    free = shutil.disk_usage(path.parent).free
    if free < size:
        raise EnvironmentFailure(
            f'"{path.parent}" has {free / 1e6:.1f} MB left, a NetCDF file of this result needs '
            f"{size / 1e6:.1f} MB; make room, take fewer samples or another place"
        )
