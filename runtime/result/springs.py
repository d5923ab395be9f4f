"""Springs between ends over a run: how long they are, how fast that changes, and their efforts."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from mstmm.arrays import Array
from mstmm.errors import SceneError
from mstmm.expression.inputs import INPUTS

from ..kernels import vectorized
from .names import Table, Values

if TYPE_CHECKING:
    from mstmm.scene import Spring

    from .observed import Observed


class _About(NamedTuple):
    """Unit and meaning of a quantity."""

    unit: str
    long_name: str


#: Quantities of a spring.
SPRING = {
    "length": _About("m", "length"),
    "length_rate": _About("m/s", "rate of the length"),
    "effort": _About("N", "effort, which pushes the ends apart"),
}


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


def effort(observed: Observed, spring: Spring) -> Array:
    """(n,) in N.  SceneError for an element of a user's own type, whose law is not known here."""
    if spring.type != "spring":
        raise SceneError(
            f'"{spring.name}.effort": the law of a force element "{spring.type}" is not known to '
            f"results; there are {spring.name}.length and {spring.name}.length_rate"
        )
    law, run, system = spring.law, observed.run, observed.engine.packed.system
    length, rate = motion(observed, spring)
    found = -law.stiffness * (length - law.rest) - law.damping * rate
    number = next(k for k, one in enumerate(observed.engine.packed.scene.spring)
                  if one.name == spring.name)  # fmt: skip
    kernel = system.forces[number].effort
    if kernel is None:
        return np.asarray(found)
    inputs = [system.inputs_at(t) for t in run.t.tolist()]
    given = {
        "t": run.t[:, None], "q": run.q, "u": run.u, "length": np.stack([length, rate], axis=1),
        INPUTS: np.array(inputs).reshape(len(run.t), -1),
    }  # fmt: skip
    return np.asarray(found + vectorized.evaluate(kernel, given)["values"][:, 0])


def add_spring(table: Table, observed: Observed, spring: Spring) -> None:
    """Its quantities under their names: strut.length."""
    get: dict[str, Values] = {
        "length": lambda: motion(observed, spring)[0],
        "length_rate": lambda: motion(observed, spring)[1],
        "effort": lambda: effort(observed, spring),
    }
    for kind, about in SPRING.items():
        rates = get["length_rate"] if kind == "length" else None
        text = f"{about.long_name} of spring {spring.name}"
        name = f"{spring.name}.{kind}"
        table.scalar(name, about.unit, text, get[kind], rates=rates, listed=False)


def _end(observed: Observed, spring: Spring, end: str) -> Array:
    """(n, 6): position and velocity; a spring says itself where it is on the ground."""
    if end == "ground":
        return np.tile([*spring.position, 0.0, 0.0, 0.0], (len(observed.run.t), 1))
    return observed.points(end)[:, :6]
