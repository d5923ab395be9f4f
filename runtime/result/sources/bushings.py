"""Loads and deflections of bushings over a run."""

from __future__ import annotations

from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array
from mstmm.ir import KernelIR
from mstmm.ir.element_spec import kernel_from_json
from mstmm.scene.tables.bushing import upper_triangle

from ...engine.looped_engine import Probe
from ...engine.quantity_registry import POINT_COLUMNS, XYZ, QuantityKind
from ...kernels import numpy_kernels
from ..quantity_names import Table

if TYPE_CHECKING:
    from mstmm.scene import Bushing

    from ..observations import Observations

#: Quantities of a bushing: loads in inertial axes, deflections in its own.
BUSHING_QUANTITIES = {
    "force": QuantityKind("N", "force on the end `to`", XYZ, ("fx", "fy", "fz")),
    "moment": QuantityKind(
        "N*m", "moment on the end `to`, about its point", XYZ, ("mx", "my", "mz")
    ),
    "deflection": QuantityKind("m", "displacement of the end `to` from rest, own axes", XYZ, ()),
    "turn": QuantityKind("rad", "rotation vector of the end `to` from rest, own axes", XYZ, ()),
}

#: With unit stiffness, the load equals the deflection.
_UNIT_STIFFNESS = (*upper_triangle((1.0,) * 6), *upper_triangle((0.0,) * 6), *(0.0,) * 6)


@cache
def _wrench_kernel(element: str) -> KernelIR:
    text = files("mstmm.generated").joinpath(f"force_{element}.json").read_text(encoding="utf-8")
    return kernel_from_json(text, "wrench")


def bushing_load(observed: Observations, bushing: Bushing) -> Array:
    """Force and moment (n, 6) on the end `to`, inertial axes."""
    return _wrench_of_ends(_end_motions(observed, bushing), bushing.numbers, bushing.element)


def bushing_deflection(observed: Observations, bushing: Bushing) -> Array:
    """Motion (n, 6) of the end `to` from its undeformed pose, in the bushing's axes."""
    return deflection_of(_end_motions(observed, bushing))


def deflection_of(ends: tuple[Array, Array]) -> Array:
    """Deflection (n, 6) from the motions (n, 24) of the undeformed pose and of the end `to`."""
    axes = ends[0][:, 15:24].reshape(-1, 3, 3)
    components = -_wrench_of_ends(ends, _UNIT_STIFFNESS, "bushing6").reshape(-1, 2, 3)
    return np.einsum("nij,nki->nkj", axes, components).reshape(-1, 6)


def add_bushing(table: Table, observed: Observations, bushing: Bushing) -> None:
    """Add the quantities of a bushing under their names: mount.force, mount.deflection.x."""
    cached_load = cache(lambda: bushing_load(observed, bushing))
    cached_deflection = cache(lambda: bushing_deflection(observed, bushing))
    sources = {
        "force": (cached_load, 0),
        "moment": (cached_load, 3),
        "deflection": (cached_deflection, 0),
        "turn": (cached_deflection, 3),
    }
    owner = f"bushing {bushing.name}"
    for kind, description in BUSHING_QUANTITIES.items():
        of, first = sources[kind]

        def values(of=of, first=first) -> Array:  # type: ignore[no-untyped-def]
            columns_of_kind: Array = of()
            return columns_of_kind[:, first : first + 3]

        table.vector(f"{bushing.name}.{kind}", owner, description, values, base=bushing.name)


def _end_motions(observed: Observations, bushing: Bushing) -> tuple[Array, Array]:
    """Motions (n, 24) of the undeformed pose fixed to `from`, and of the end `to`."""
    packed, run = observed.engine.packed, observed.run
    names = [
        element.name if element in packed.scene.bushing else "" for element in packed.scene.forces
    ]
    ends = packed.system.forces[names.index(bushing.name)].ends
    probes = [Probe(*end) for end in ends]
    points = observed.engine.observe(run.t, run.q, run.u, run.memory, probes, ("points",)).points
    return points[:, 0], points[:, 1]


def _wrench_of_ends(ends: tuple[Array, Array], numbers: tuple[float, ...], element: str) -> Array:
    """Force and moment (n, 6); nan where a state cannot be evaluated."""
    is_finite = np.asarray(np.isfinite(np.hstack(ends)).all(axis=1))
    inputs: dict[str, Array] = {
        "p": np.array(numbers), "t": np.zeros(1), "effort": np.zeros(1),
    }  # fmt: skip
    columns = {"x": POINT_COLUMNS["position"], "v": POINT_COLUMNS["velocity"],
               "w": POINT_COLUMNS["angular_velocity"]}  # fmt: skip
    for letter, end in zip("FT", ends, strict=True):
        inputs[f"A_{letter}"] = end[is_finite, 15:24].reshape(-1, 3, 3)
        inputs |= {f"{name}_{letter}": end[is_finite, column] for name, column in columns.items()}
    outputs = numpy_kernels.evaluate(_wrench_kernel(element), inputs)
    loads = np.full((len(is_finite), 6), np.nan)
    loads[is_finite] = np.hstack([outputs["F"], outputs["M"]])
    return loads
