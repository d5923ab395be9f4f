"""Bushings over a run: their loads, and how far they are deflected."""

from __future__ import annotations

from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING

import numpy as np

from mstmm.arrays import Array
from mstmm.ir import KernelIR
from mstmm.ir.stored import kernel_from_json
from mstmm.scene.rules.symmetric import triangle

from ...engine.calls import Probe
from ...engine.shown import COLUMNS, XYZ, Kind
from ...kernels import vectorized
from ..names import Table

if TYPE_CHECKING:
    from mstmm.scene import Bushing

    from ..observed import Observed

#: Quantities of a bushing: loads in inertial axes, deflections in its own.
BUSHING = {
    "force": Kind("N", "force on the end `to`", XYZ, ("fx", "fy", "fz")),
    "moment": Kind("N*m", "moment on the end `to`, at its place", XYZ, ("mx", "my", "mz")),
    "deflection": Kind("m", "motion of the end `to` from its place at rest, own axes", XYZ, ()),
    "turn": Kind("rad", "rotation vector of the end `to` from rest, own axes", XYZ, ()),
}  # fmt: skip

#: One that pulls as far as it is deflected: its load tells the deflection.
_OF_ONE = (*triangle((1.0,) * 6), *triangle((0.0,) * 6), *(0.0,) * 6)


@cache
def _wrench(element: str) -> KernelIR:
    text = files("mstmm.generated").joinpath(f"force_{element}.json").read_text(encoding="utf-8")
    return kernel_from_json(text, "wrench")


def load(observed: Observed, bushing: Bushing) -> Array:
    """(n, 6): force and moment on the end `to`, inertial axes."""
    return _load(_ends(observed, bushing), bushing.numbers, bushing.element)


def deflection(observed: Observed, bushing: Bushing) -> Array:
    """(n, 6): motion of the end `to` from its pose at rest, in the bushing's axes."""
    return deflection_of(_ends(observed, bushing))


def deflection_of(ends: tuple[Array, Array]) -> Array:
    """(n, 6) of the motion (n, 24) of the place of rest and of the end `to`."""
    own = ends[0][:, 15:24].reshape(-1, 3, 3)
    pulled = -_load(ends, _OF_ONE, "bushing6").reshape(-1, 2, 3)
    return np.einsum("nij,nki->nkj", own, pulled).reshape(-1, 6)


def add_bushing(table: Table, observed: Observed, bushing: Bushing) -> None:
    """Its quantities under their names: mount.force, mount.deflection.x."""
    loaded = cache(lambda: load(observed, bushing))
    moved = cache(lambda: deflection(observed, bushing))
    both = {"force": (loaded, 0), "moment": (loaded, 3), "deflection": (moved, 0),
            "turn": (moved, 3)}  # fmt: skip
    owner = f"bushing {bushing.name}"
    for kind, about in BUSHING.items():
        of, first = both[kind]

        def values(of=of, first=first) -> Array:  # type: ignore[no-untyped-def]
            found: Array = of()
            return found[:, first : first + 3]

        table.vector(f"{bushing.name}.{kind}", owner, about, values, base=bushing.name)


def _ends(observed: Observed, bushing: Bushing) -> tuple[Array, Array]:
    """(n, 24) each: motion of the place of rest that `from` carries, and of the end `to`."""
    packed, run = observed.engine.packed, observed.run
    names = [one.name if one in packed.scene.bushing else "" for one in packed.scene.forces]
    ends = packed.system.forces[names.index(bushing.name)].ends
    probes = [Probe(*end) for end in ends]
    points = observed.engine.observe(run.t, run.q, run.u, run.memory, probes, ("points",)).points
    return points[:, 0], points[:, 1]


def _load(ends: tuple[Array, Array], numbers: tuple[float, ...], element: str) -> Array:
    """(n, 6); nan where a state cannot be evaluated."""
    known = np.asarray(np.isfinite(np.hstack(ends)).all(axis=1))
    given: dict[str, Array] = {
        "p": np.array(numbers), "t": np.zeros(1), "effort": np.zeros(1),
    }  # fmt: skip
    columns = {"x": COLUMNS["position"], "v": COLUMNS["velocity"],
               "w": COLUMNS["angular_velocity"]}  # fmt: skip
    for letter, end in zip("FT", ends, strict=True):
        given[f"A_{letter}"] = end[known, 15:24].reshape(-1, 3, 3)
        given |= {f"{name}_{letter}": end[known, place] for name, place in columns.items()}
    found = vectorized.evaluate(_wrench(element), given)
    loads = np.full((len(known), 6), np.nan)
    loads[known] = np.hstack([found["F"], found["M"]])
    return loads
