"""Springs over a run: length, rate of length, effort and power."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import SceneError

from ...engine.quantity_registry import XYZ, QuantityKind
from ...kernels import numpy_kernels
from ..quantity_names import Table, Values
from .applied_loads import AppliedLoads

if TYPE_CHECKING:
    from mstmm.scene import Spring

    from ..observations import Observations


class _Description(NamedTuple):
    """Unit and meaning of a quantity."""

    unit: str
    long_name: str


#: Quantities of a spring.
SPRING_QUANTITIES = {
    "length": _Description("m", "length"),
    "length_rate": _Description("m/s", "rate of the length"),
    "effort": _Description("N", "effort, which pushes the ends apart,"),
}

_FORCE = QuantityKind("N", "force on the end `to`", XYZ, ("fx", "fy", "fz"))


def length_and_rate(apart: Array) -> tuple[Array, Array]:
    """Lengths (n,) and rates (n,) from relative positions and velocities (n, 6) of the ends.

    nan where the ends coincide.
    """
    length = np.linalg.norm(apart[:, :3], axis=1)
    product = np.einsum("ni,ni->n", apart[:, :3], apart[:, 3:6])
    return length, np.divide(product, length, out=np.full_like(length, np.nan), where=length > 0)


def spring_motion(observed: Observations, spring: Spring) -> tuple[Array, Array]:
    """Lengths (n,) in m and their rates (n,) in m/s."""
    from_state, to_state = (_end_state(observed, spring, end) for end in (spring.from_, spring.to))
    return length_and_rate(to_state - from_state)


def spring_effort(acting: AppliedLoads, spring: Spring) -> Array:
    """Effort (n,) in N. SceneError for a user-defined element, whose law is unknown here."""
    if spring.type != "spring":
        raise SceneError(
            f'"{spring.name}.effort": the law of a force element "{spring.type}" is not '
            f"available; use {spring.name}.length and {spring.name}.length_rate"
        )
    law = spring.law
    length, rate = spring_motion(acting.observations, spring)
    return motor_effort(acting, spring) - law.stiffness * (length - law.rest) - law.damping * rate


def motor_effort(acting: AppliedLoads, spring: Spring) -> Array:
    """Effort (n,) in N of `law.effort`."""
    scene = acting.observations.engine.packed.scene
    number = next(
        k for k, spring_of_scene in enumerate(scene.spring) if spring_of_scene.name == spring.name
    )
    kernel = acting.system.forces[number].effort
    if kernel is None:
        return np.zeros(len(acting.observations.run.t))
    length = np.stack(spring_motion(acting.observations, spring), axis=1)
    outputs = numpy_kernels.evaluate(kernel, acting.expression_inputs | {"length": length})
    return np.asarray(outputs["values"][:, 0])


def _spring_direction(observed: Observations, spring: Spring) -> Array:
    """Vector (n, 3) from one end to the other; nan where they coincide."""
    from_state, to_state = (_end_state(observed, spring, end) for end in (spring.from_, spring.to))
    difference = (to_state - from_state)[:, :3]
    length = np.linalg.norm(difference, axis=1)[:, None]
    return np.divide(difference, length, out=np.full_like(difference, np.nan), where=length > 0)


def add_spring(table: Table, acting: AppliedLoads, spring: Spring) -> None:
    """Add the quantities of a spring: strut.length, strut.effort, strut.force, strut.power."""
    observed, owner, built_in = (
        acting.observations,
        f"spring {spring.name}",
        spring.type == "spring",
    )
    cached_motion = cache(lambda: spring_motion(observed, spring))
    get: dict[str, Values] = {
        "length": lambda: cached_motion()[0],
        "length_rate": lambda: cached_motion()[1],
        "effort": cache(lambda: spring_effort(acting, spring)),
    }
    for kind, description in SPRING_QUANTITIES.items():
        rates = get["length_rate"] if kind == "length" else None
        name, is_listed = f"{spring.name}.{kind}", built_in or kind != "effort"
        table.scalar(
            name,
            description.unit,
            description.long_name,
            get[kind],
            rates=rates,
            listed=is_listed,
            owner=owner,
        )
    if not built_in:
        return

    def power_getter(of: Values) -> Values:
        return lambda: np.asarray(of() * get["length_rate"]())

    def force() -> Array:
        return np.asarray(get["effort"]()[:, None] * _spring_direction(observed, spring))

    power = power_getter(get["effort"])
    table.vector(f"{spring.name}.force", owner, _FORCE, force, base=spring.name)
    table.scalar(f"{spring.name}.power", "W", "power of the effort", power, owner=owner)
    if not spring.law.effort.is_zero:
        motor_values: Values = lambda: motor_effort(acting, spring)  # noqa: E731
        name = f"{spring.name}.motor"
        table.scalar(name, "N", "motor effort", motor_values, owner=owner)
        table.scalar(
            f"{name}_power", "W", "power of the motor", power_getter(motor_values), owner=owner
        )


def _end_state(observed: Observations, spring: Spring, end: str) -> Array:
    """Position and velocity (n, 6) of an end; on the ground, the position in the spring."""
    if end == "ground":
        return np.tile([*spring.position, 0.0, 0.0, 0.0], (len(observed.run.t), 1))
    return observed.points(end)[:, :6]
