"""A result as one xarray Dataset: every quantity with its dimensions, unit and long name."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from mstmm.extras import missing
from mstmm.ir.facts import effort_unit

from ...engine.shown import BODY, HINGE, SUMS, acceleration_name, rate_unit
from .. import meshes
from ..flexible import dataset as flexible
from ..owners.angles import EULER
from . import provenance
from .table import flat

if TYPE_CHECKING:
    from ..names import Quantity
    from ..record import Record


#: Speeds of a scene up to which everything about every body and hinge is written out.
MOST_SPEEDS = 5000
_EVERYTHING = ("body", "hinge", "flexible", "mode")


def dataset(result: Record) -> Any:
    """`xarray.Dataset` with dimensions time, coordinate, speed, hinge, body, axis, component,
    angle, and spring, load and so on where there are some.

    `body` holds bodies and their ends ("rod1", "rod1.tip"), `coordinate` and `speed` the entries of
    q and u ("shoulder.angle", "shoulder.angle_rate"), whose units differ and stand beside them.
    Beyond MOST_SPEEDS speeds motions of bodies and loads of hinges are left out: they follow from
    the states, and a loaded result computes those that are asked for.
    """
    try:
        import xarray
    except ImportError as error:
        raise missing("io", "an xarray Dataset", error) from None
    found, labels = variables(result)
    found |= provenance.variables(result)
    files = meshes.variables(result.model.scene, result.meshes)
    return xarray.Dataset({**found, **files}, labels, provenance.attributes(result))


Variable = tuple[tuple[str, ...], Any, dict[str, str]]


def variables(result: Record) -> tuple[dict[str, Variable], dict[str, Variable]]:
    """What a run gave, and the labels of its dimensions; see `dataset`."""
    found, labels = _states(result), _labels(result)
    if result.model.nu <= MOST_SPEEDS:
        found |= _bodies(result) | _hinges(result) | flexible.variables(result)
        found |= _acting(result)
    else:
        labels = {key: label for key, label in labels.items() if key not in _EVERYTHING}
    return found | _sums(result) | _given(result), labels


def _words(values: list[str]) -> Any:
    return np.array(values, dtype=object) if values else np.array([], dtype="<U1")


def _about(unit: str, long_name: str) -> dict[str, str]:
    return {"units": unit or "1", "long_name": long_name}


def _common(units: list[str]) -> str:
    """The unit of an array whose columns may have different ones."""
    return (units[0] or "1") if len(set(units)) == 1 else "see the units beside the labels"


def _labels(result: Record) -> dict[str, Variable]:
    layout = result.model.layout
    owners = list(layout.owners)
    q_units = [unit or "1" for h in owners for unit in h.q_units]
    u_units = [unit or "1" for h in owners for unit in h.u_units]
    udot = [f"{h.name}.{acceleration_name(n)}" for h in owners for n in h.u_names]
    plain: dict[str, tuple[str, list[str], str]] = {
        "coordinate": ("coordinate", layout.q_names, "coordinate of a hinge or a mode"),
        "coordinate_units": ("coordinate", q_units, "unit of the coordinate"),
        "speed": ("speed", layout.u_names, "speed of a hinge or a mode"),
        "speed_units": ("speed", u_units, "unit of the speed"),
        "acceleration_name": ("speed", udot, "name of the speed's rate"),
        "effort_units": ("speed", [effort_unit(u) for u in u_units], "unit of the effort"),
        "hinge": ("hinge", list(layout.hinges), "hinge"),
        "body": ("body", list(result._observed.references), "body or end of a body"),
        "axis": ("axis", ["x", "y", "z"], "inertial axis"),
        "component": ("component", ["w", "x", "y", "z"], "component of a quaternion"),
        "angle": ("angle", list(EULER.labels), EULER.long_name),
        **flexible.labels(result),
    }
    found: dict[str, Variable] = {"time": (("time",), result.t, _about("s", "time"))}
    for name, (dim, words, long_name) in plain.items():
        found[name] = ((dim,), _words(words), {"long_name": long_name})
    return found


def _states(result: Record) -> dict[str, Variable]:
    owners = list(result.model.layout.owners)
    q_units = [unit for h in owners for unit in h.q_units]
    u_units = [unit for h in owners for unit in h.u_units]
    by_speed, efforts = ("time", "speed"), [effort_unit(unit) for unit in u_units]
    rates = [rate_unit(unit) for unit in u_units]
    effort = result._observed.part("efforts")
    return {
        "q": (("time", "coordinate"), result.q, _about(_common(q_units), "hinge coordinates")),
        "u": (by_speed, result.u, _about(_common(u_units), "hinge speeds")),
        "udot": (by_speed, result.udot, _about(_common(rates), "rates of the hinge speeds")),
        "effort": (by_speed, effort, _about(_common(efforts), "efforts of laws and drives")),
    }


def _bodies(result: Record) -> dict[str, Variable]:
    names = result._observed.references
    found: dict[str, Variable] = {}
    for kind, about in BODY.items():
        columns = [result._quantities.of_body(name, kind) for name in names]
        values = np.stack(columns, axis=1) if columns else np.zeros((len(result.t), 0, 3))
        last = "component" if kind == "orientation" else "axis"
        found[kind] = (("time", "body", last), values, _about(about.unit, about.long_name))
    angles = [result.quantity(f"{name}.euler").values for name in names]
    values = np.stack(angles, axis=1) if angles else np.zeros((len(result.t), 0, 3))
    found["euler"] = (("time", "body", "angle"), values, _about("rad", EULER.long_name))
    return found


def _hinges(result: Record) -> dict[str, Variable]:
    names = list(result.model.layout.hinges)
    found: dict[str, Variable] = {}
    for kind, about in HINGE.items():
        columns = [result._quantities.of_hinge(name, kind) for name in names]
        values = np.stack(columns, axis=1) if columns else np.zeros((len(result.t), 0, 3))
        long_name = f"{about.long_name}, inertial axes"
        found[kind] = (("time", "hinge", "axis"), values, _about(about.unit, long_name))
    return found


def _given(result: Record) -> dict[str, Variable]:
    """Inputs, signals and outputs by their names, as "input_motor", "signal_wind" and
    "output_height"."""
    scene, found = result.model.scene, dict[str, Variable]()
    names = {
        "input": [one.name for one in scene.input], "signal": [one.name for one in scene.signal],
        "output": result._quantities.outputs(),
    }  # fmt: skip
    for word, given in names.items():
        for name in given:
            found |= _variable(f"{word}_{name}", result.quantity(name))
    return found


def _acting(result: Record) -> dict[str, Variable]:
    """What springs, loads, bushings and what closes loops do: "spring_length" by spring; nan for
    what one of them has not."""
    named: dict[str, list[str]] = {}
    kinds: dict[tuple[str, str], dict[str, Quantity]] = {}
    for quantity in result._quantities.acting_wholes():
        word, _, owner = quantity.owner.partition(" ")
        if owner not in named.setdefault(word, []):
            named[word].append(owner)
        kinds.setdefault((word, quantity.name.rpartition(".")[2]), {})[owner] = quantity
    found: dict[str, Variable] = {
        word: ((word,), _words(owners), {"long_name": word}) for word, owners in named.items()
    }
    for (word, kind), some in kinds.items():
        one = next(iter(some.values()))
        unknown = np.full(one.values.shape, np.nan)
        columns = [some[name].values if name in some else unknown for name in named[word]]
        dims = ("time", word, *(_DIMENSIONS[one.labels] if one.labels else ()))
        about = _about(_common([x.unit for x in some.values()]), one.what)
        found[f"{word}_{kind}"] = (dims, np.stack(columns, axis=1), about)
    return found


def _variable(key: str, known: Quantity) -> dict[str, Variable]:
    """One variable, or one for each column where these are no axes."""
    about = _about(known.unit, known.long_name)
    if known.labels in _DIMENSIONS:
        return {key: (("time", *_DIMENSIONS[known.labels]), known.values, about)}
    ends = [f"_{label}" for label in known.labels] or [""]
    return {
        f"{key}{end}": (("time",), values, about)
        for end, (_, _, values) in zip(ends, flat([known]), strict=True)
    }


#: Dimensions of vectors by the labels of their components.
_DIMENSIONS: dict[tuple[str, ...], tuple[str, ...]] = {
    tuple("xyz"): ("axis",), tuple("wxyz"): ("component",), EULER.labels: ("angle",),
}  # fmt: skip


def _sums(result: Record) -> dict[str, Variable]:
    found: dict[str, Variable] = {}
    for name, (unit, long_name, _) in SUMS.items():
        values = result._quantities.sum(name)
        dims = ("time", "axis") if values.ndim == 2 else ("time",)
        found[name.replace(".", "_")] = (dims, values, _about(unit, long_name))
    work = result.quantity("work")
    found["work"] = (("time",), work.values, _about("J", work.long_name))
    return found
