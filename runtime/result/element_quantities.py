"""Quantities of the elements of a scene: springs, bushings, loads, constraints and couplings.

The values of an element have a method for each of its kinds in the registry, with the same name.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import SceneError
from mstmm.expression.derivatives import INPUTS
from mstmm.ir import KernelIR
from mstmm.ir.element_spec import builtin_kernel
from mstmm.numerics.piecewise_polynomial import NUMBERS_PER_PIECE
from mstmm.scene.tables.bushing import upper_triangle
from mstmm.scene.tables.closures import CURVE, DISTANCE, ROLLING
from mstmm.scene.validators.scalars_and_vectors import GROUND

from ..engine.looped_engine import Probe, length_and_rate
from ..engine.quantity_registry import ELEMENT_QUANTITIES, POINT_COLUMNS, QuantityKind
from ..kernels import numpy_kernels
from ..packing.coordinate_layout import OF_CONSTRAINT
from ..packing.system import System
from .quantity_names import Table

if TYPE_CHECKING:
    from mstmm.scene import Scene
    from mstmm.scene.tables.scene_tables import SceneTables

    from .observations import Observations

_IDENTITY_AXES = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)

#: Largest number of values of the motion of all loads together, about 130 MB.
MAX_MOTION_NUMBERS = 2**24


#: With unit stiffness, the load equals the deflection.
_UNIT_STIFFNESS = (*upper_triangle((1.0,) * 6), *upper_triangle((0.0,) * 6), *(0.0,) * 6)


class AppliedLoads:
    """Expression values at all samples, computed on first use and cached."""

    def __init__(self, observed: Observations) -> None:
        self.observations = observed
        self.system: System = observed.engine.packed.system

    @cached_property
    def expression_inputs(self) -> dict[str, Array]:
        """Values that expressions read: t, q, u and the inputs, held inputs from memory."""
        run, held = self.observations.run, self.system.held_inputs
        inputs = np.array([self.system.inputs_at(t) for t in run.t.tolist()])
        inputs = inputs.reshape(len(run.t), NUMBERS_PER_PIECE * len(self.system.inputs))
        for k, slot in enumerate(held.memory_indices):
            if slot >= 0:
                inputs[:, NUMBERS_PER_PIECE * k : NUMBERS_PER_PIECE * (k + 1)] = 0.0
                inputs[:, NUMBERS_PER_PIECE * k + 1] = run.memory[:, slot]
        return {"t": run.t[:, None], "q": run.q, "u": run.u, INPUTS: inputs}

    @cached_property
    def _values(self) -> Array:
        kernel = self.system.values
        assert kernel is not None
        return numpy_kernels.evaluate(kernel, self.expression_inputs)["values"]

    @cached_property
    def _loads(self) -> Array | None:
        """Motion (n, 2 loads, 24) of the point and of the axes of each load.

        None if the array would be too large.
        """
        probes = [probe for number in range(len(self.system.loads)) for probe in self._pair(number)]
        is_small = len(self.observations.run.t) * 24 * len(probes) <= MAX_MOTION_NUMBERS
        return self._observe(probes) if is_small else None

    def load(self, number: int) -> tuple[Array, Array]:
        """Motion (n, 24) of the point of a load and of its axes, see `Observation`."""
        motions, first = self._loads, 2 * number
        if motions is None:
            motions, first = self._observe(self._pair(number)), 0
        return motions[:, first], motions[:, first + 1]

    def _pair(self, number: int) -> tuple[Probe, Probe]:
        load = self.system.loads[number]
        axes = load.axes_own if load.axes >= 0 else _IDENTITY_AXES
        return Probe(load.body, _IDENTITY_AXES, load.offset), Probe(
            load.axes, axes, (0.0, 0.0, 0.0)
        )

    def _observe(self, probes: Sequence[Probe]) -> Array:
        run, engine = self.observations.run, self.observations.engine
        return engine.observe(run.t, run.q, run.u, run.memory, probes, ("points",)).points

    def values_at(self, indices: tuple[int, ...]) -> Array:
        """Values (n, places) at some indices, 0 at index -1."""
        result = np.zeros((len(self.observations.run.t), len(indices)))
        for k, slot in enumerate(indices):
            if slot >= 0:
                result[:, k] = self._values[:, slot]
        return result


class ElementValues:
    """Quantities of one element over a run."""

    word = ""

    def __init__(self, acting: AppliedLoads, element: Any) -> None:
        self.acting, self.observations = acting, acting.observations
        self.element, self.name = element, element.name

    def kinds(self) -> Iterator[QuantityKind]:
        """Kinds of quantities that the element has."""
        yield from ELEMENT_QUANTITIES[self.word].values()

    def add_to(self, table: Table) -> None:
        """Add all quantities under their names: strut.length, strut.force."""
        for kind in self.kinds():
            rates = getattr(self, kind.rates) if kind.rates else None
            values = getattr(self, kind.name)
            table.add(self.name, kind, values, rates, f"{self.word} {self.name}")


def element_values(
    acting: AppliedLoads, scene: SceneTables, loop_scene: Scene
) -> list[ElementValues]:
    """Values of all elements of a scene; constraints and couplings are those of `loop_scene`."""
    return [
        *(SpringValues(acting, spring) for spring in scene.spring),
        *(LoadValues(acting, load, k) for k, load in enumerate(scene.load)),
        *(BushingValues(acting, bushing) for bushing in scene.bushing),
        *(ConstraintValues(acting, constraint) for constraint in loop_scene.constraint),
        *(CouplingValues(acting, coupling) for coupling in loop_scene.coupling),
    ]


class SpringValues(ElementValues):
    """Quantities of a spring. Those of a user-defined element have no effort."""

    word = "spring"

    def kinds(self) -> Iterator[QuantityKind]:
        spring = self.element
        for kind in super().kinds():
            if spring.type == "spring":
                if not (kind.name.startswith("motor") and spring.law.effort.is_zero):
                    yield kind
            elif kind.name.startswith("length"):
                yield kind
            elif kind.name == "effort":  # a name with a message
                yield replace(kind, listed=False)

    def length(self) -> Array:
        return self._motion[0]

    def length_rate(self) -> Array:
        return self._motion[1]

    def effort(self) -> Array:
        return self._effort

    def force(self) -> Array:
        difference = self._apart()[:, :3]
        length = np.linalg.norm(difference, axis=1)[:, None]
        direction = np.divide(
            difference, length, out=np.full_like(difference, np.nan), where=length > 0
        )
        return np.asarray(self.effort()[:, None] * direction)

    def power(self) -> Array:
        return np.asarray(self.effort() * self.length_rate())

    def motor(self) -> Array:
        """Effort (n,) in N of `law.effort`."""
        springs = self.observations.engine.packed.scene.spring
        number = next(k for k, spring in enumerate(springs) if spring.name == self.name)
        kernel = self.acting.system.forces[number].effort
        if kernel is None:
            return np.zeros(len(self.observations.run.t))
        inputs = self.acting.expression_inputs | {"length": np.stack(self._motion, axis=1)}
        return np.asarray(numpy_kernels.evaluate(kernel, inputs)["values"][:, 0])

    def motor_power(self) -> Array:
        return np.asarray(self.motor() * self.length_rate())

    @cached_property
    def _motion(self) -> tuple[Array, Array]:
        return length_and_rate(self._apart())

    @cached_property
    def _effort(self) -> Array:
        if self.element.type != "spring":
            raise SceneError(
                f'"{self.name}.effort": the law of a force element "{self.element.type}" is not '
                f"available; use {self.name}.length and {self.name}.length_rate"
            )
        law, (length, rate) = self.element.law, self._motion
        return self.motor() - law.stiffness * (length - law.rest) - law.damping * rate

    def _apart(self) -> Array:
        """Relative position and velocity (n, 6) of the ends."""
        from_state, to_state = map(self._end_state, (self.element.from_, self.element.to))
        return np.asarray(to_state - from_state)

    def _end_state(self, end: str) -> Array:
        """Position and velocity (n, 6) of an end; on the ground, the position in the spring."""
        if end == GROUND:
            state = [*self.element.position, 0.0, 0.0, 0.0]
            return np.tile(state, (len(self.observations.run.t), 1))
        return self.observations.points(end)[:, :6]


class LoadValues(ElementValues):
    """Quantities of load `number` of the scene, in inertial axes."""

    word = "load"

    def __init__(self, acting: AppliedLoads, element: Any, number: int) -> None:
        super().__init__(acting, element)
        self._number = number
        parts = acting.observations.engine.packed.expanded.load_parts
        self._parts = (number, *parts.get(number, ()))

    def kinds(self) -> Iterator[QuantityKind]:
        has_moment = any(index >= 0 for index in self.acting.system.loads[self._number].moment)
        return (kind for kind in super().kinds() if kind.name != "moment" or has_moment)

    def force(self) -> Array:
        return np.sum([self._components("force", part) for part in self._parts], axis=0)

    def moment(self) -> Array:
        return np.sum([self._components("moment", part) for part in self._parts], axis=0)

    def power(self) -> Array:
        return np.sum([self._power(part) for part in self._parts], axis=0)

    def _components(self, name: str, part: int) -> Array:
        return inertial_components(self.acting, part, getattr(self.acting.system.loads[part], name))

    def _power(self, part: int) -> Array:
        points = self.acting.load(part)[0]
        velocity, spin = (points[:, POINT_COLUMNS[k]] for k in ("velocity", "angular_velocity"))
        force_power = np.einsum("ni,ni->n", self._components("force", part), velocity)
        moment_power = np.einsum("ni,ni->n", self._components("moment", part), spin)
        return np.asarray(force_power + moment_power)


def inertial_components(acting: AppliedLoads, number: int, indices: tuple[int, ...]) -> Array:
    """Inertial components (n, 3) of the three values of a load at `indices`."""
    axes = acting.load(number)[1][:, 15:24].reshape(-1, 3, 3)
    return np.einsum("nij,nj->ni", axes, acting.values_at(indices))


class BushingValues(ElementValues):
    """Quantities of a bushing: loads in inertial axes, deflections in its own."""

    word = "bushing"

    def force(self) -> Array:
        return self._load[:, :3]

    def moment(self) -> Array:
        return self._load[:, 3:]

    def deflection(self) -> Array:
        return self._deflection[:, :3]

    def turn(self) -> Array:
        return self._deflection[:, 3:]

    @cached_property
    def _load(self) -> Array:
        """Force and moment (n, 6) on the end `to`, inertial axes."""
        return _wrench_of_ends(self._end_motions(), self.element.numbers, self.element.element)

    @cached_property
    def _deflection(self) -> Array:
        return deflection_of(self._end_motions())

    def _end_motions(self) -> tuple[Array, Array]:
        """Motions (n, 24) of the undeformed pose fixed to `from`, and of the end `to`."""
        scene, run = self.observations.engine.packed.scene, self.observations.run
        names = [force.name if force in scene.bushing else "" for force in scene.forces]
        ends = self.acting.system.forces[names.index(self.name)].ends
        points = self.observations.engine.observe(
            run.t, run.q, run.u, run.memory, [Probe(*end) for end in ends], ("points",)
        ).points
        return points[:, 0], points[:, 1]


def deflection_of(ends: tuple[Array, Array]) -> Array:
    """Motion (n, 6) of the end `to` from its undeformed pose, in the bushing's axes.

    `ends` are the motions (n, 24) of the undeformed pose and of the end.
    """
    axes = ends[0][:, 15:24].reshape(-1, 3, 3)
    components = -_wrench_of_ends(ends, _UNIT_STIFFNESS, "bushing6").reshape(-1, 2, 3)
    return np.einsum("nij,nki->nkj", axes, components).reshape(-1, 6)


def _wrench_kernel(element: str) -> KernelIR:
    return builtin_kernel(f"force_{element}", "wrench")


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


class ConstraintValues(ElementValues):
    """Quantities of a constraint: rod.force, rod.load, road.friction, wire.s."""

    word = "constraint"

    def kinds(self) -> Iterator[QuantityKind]:
        kind_of_constraint = self.element.type
        names = {CURVE: ("force", "s"), ROLLING: ("force", "load", "friction")}
        for kind in super().kinds():
            if kind.name in names.get(kind_of_constraint, ("force", "load")):
                is_push = kind.name == "load" and kind_of_constraint == DISTANCE
                text = "load, which pushes the ends apart,"
                yield replace(kind, long_name=text) if is_push else kind

    def force(self) -> Array:
        return self.observations.columns("loads", (self._frame_index(), slice(0, 3)))

    def s(self) -> Array:
        first = self.acting.system.first_indices["q"]
        return self.observations.run.q[:, int(first[self._frame_index()])]

    def load(self) -> Array:
        return np.asarray(np.einsum("ni,ni->n", self.force(), self._direction()))

    def friction(self) -> Array:
        normal_force = self.load()[:, None] * self._direction()
        return np.asarray(np.linalg.norm(self.force() - normal_force, axis=1))

    def _frame_index(self) -> int:
        return self.observations.engine.packed.hinge_position[self.name + OF_CONSTRAINT]

    def _direction(self) -> Array:
        """Direction (n, 3) of the load, inertial axes: for a distance from `from` to `to`."""
        constraint, count = self.element, len(self.observations.run.t)
        if constraint.type == DISTANCE:
            from_position, to_position = map(self._end_position, (constraint.from_, constraint.to))
            difference = to_position - from_position
            return np.asarray(difference / np.linalg.norm(difference, axis=1)[:, None])
        normal = np.asarray(constraint.unit_normal)
        if constraint.from_ == GROUND:
            return np.tile(normal, (count, 1))
        points = self.observations.points(constraint.from_)
        return np.asarray(points[:, 15:24].reshape(-1, 3, 3) @ normal)

    def _end_position(self, end: str) -> Array:
        if end == GROUND:
            return np.tile(np.asarray(self.element.position), (len(self.observations.run.t), 1))
        return self.observations.points(end)[:, :3]


class CouplingValues(ElementValues):
    """Load of a coupling: the effort on a coordinate per slope of its expression."""

    word = "coupling"

    def load(self) -> Array:
        loops = self.observations.engine.packed.written.loops
        couplings = [] if loops is None else loops.couplings
        rows = [record.row for record in couplings if record.coupling.name == self.name]
        row_loads = self.observations.part("rows")
        return -row_loads[:, rows[0]] if rows else np.zeros(len(row_loads))
