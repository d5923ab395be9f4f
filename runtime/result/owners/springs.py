"""Springs over a run: length, rate of length, effort and power."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from mstmm.arrays import Array
from mstmm.errors import SceneError

from ...engine.shown import XYZ, Kind
from ...kernels import vectorized
from ..names import Table, Values
from .acting import Acting

if TYPE_CHECKING:
    from mstmm.scene import Spring

    from ..observed import Observed


class _About(NamedTuple):
    """Unit and meaning of a quantity."""

    unit: str
    long_name: str


#: Quantities of a spring.
SPRING = {
    "length": _About("m", "length"),
    "length_rate": _About("m/s", "rate of the length"),
    "effort": _About("N", "effort, which pushes the ends apart,"),
}

_FORCE = Kind("N", "force on the end `to`", XYZ, ("fx", "fy", "fz"))


def motion_of(apart: Array) -> tuple[Array, Array]:
    """Lengths (n,) and their rates (n,) of positions and velocities (n, 6) of one end beside the
    other; nan where the ends meet."""
    length = np.linalg.norm(apart[:, :3], axis=1)
    along = np.einsum("ni,ni->n", apart[:, :3], apart[:, 3:6])
    return length, np.divide(along, length, out=np.full_like(length, np.nan), where=length > 0)


def motion(observed: Observed, spring: Spring) -> tuple[Array, Array]:
    """Lengths (n,) in m and their rates (n,) in m/s."""
    near, far = (_end(observed, spring, end) for end in (spring.from_, spring.to))
    return motion_of(far - near)


def effort(acting: Acting, spring: Spring) -> Array:
    """(n,) in N.  SceneError for an element of a user's own type, whose law is not known here."""
    if spring.type != "spring":
        raise SceneError(
            f'"{spring.name}.effort": the law of a force element "{spring.type}" is not known to '
            f"results; there are {spring.name}.length and {spring.name}.length_rate"
        )
    law = spring.law
    length, rate = motion(acting.observed, spring)
    return motor(acting, spring) - law.stiffness * (length - law.rest) - law.damping * rate


def motor(acting: Acting, spring: Spring) -> Array:
    """(n,) in N: what its `law.effort` puts in."""
    scene = acting.observed.engine.packed.scene
    number = next(k for k, one in enumerate(scene.spring) if one.name == spring.name)
    kernel = acting.system.forces[number].effort
    if kernel is None:
        return np.zeros(len(acting.observed.run.t))
    length = np.stack(motion(acting.observed, spring), axis=1)
    found = vectorized.evaluate(kernel, acting.given | {"length": length})
    return np.asarray(found["values"][:, 0])


def _direction(observed: Observed, spring: Spring) -> Array:
    """(n, 3): from one end to the other; nan where they meet."""
    near, far = (_end(observed, spring, end) for end in (spring.from_, spring.to))
    apart = (far - near)[:, :3]
    length = np.linalg.norm(apart, axis=1)[:, None]
    return np.divide(apart, length, out=np.full_like(apart, np.nan), where=length > 0)


def add_spring(table: Table, acting: Acting, spring: Spring) -> None:
    """Its quantities under their names: strut.length, strut.effort, strut.force, strut.power."""
    observed, owner, built_in = acting.observed, f"spring {spring.name}", spring.type == "spring"
    moving = cache(lambda: motion(observed, spring))
    get: dict[str, Values] = {
        "length": lambda: moving()[0],
        "length_rate": lambda: moving()[1],
        "effort": cache(lambda: effort(acting, spring)),
    }
    for kind, about in SPRING.items():
        rates = get["length_rate"] if kind == "length" else None
        name, listed = f"{spring.name}.{kind}", built_in or kind != "effort"
        table.scalar(
            name, about.unit, about.long_name, get[kind], rates=rates, listed=listed, owner=owner
        )
    if not built_in:
        return

    def powered(of: Values) -> Values:
        return lambda: np.asarray(of() * get["length_rate"]())

    def force() -> Array:
        return np.asarray(get["effort"]()[:, None] * _direction(observed, spring))

    power = powered(get["effort"])
    table.vector(f"{spring.name}.force", owner, _FORCE, force, base=spring.name)
    table.scalar(f"{spring.name}.power", "W", "power of the effort", power, owner=owner)
    if not spring.law.effort.is_zero:
        given: Values = lambda: motor(acting, spring)  # noqa: E731
        name = f"{spring.name}.motor"
        table.scalar(name, "N", "motor effort", given, owner=owner)
        table.scalar(f"{name}_power", "W", "power of the motor", powered(given), owner=owner)


def _end(observed: Observed, spring: Spring, end: str) -> Array:
    """(n, 6): position and velocity; a spring says itself where it is on the ground."""
    if end == "ground":
        return np.tile([*spring.position, 0.0, 0.0, 0.0], (len(observed.run.t), 1))
    return observed.points(end)[:, :6]
