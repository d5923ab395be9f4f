"""Loads frozen at the operating point: variants of a tree whose loads ignore perturbations.

In these variants loads and tensions keep their values at one state, with fixed components in
inertial axes.  The difference to the whole scene is the contribution of laws and loads to the
matrices.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mstmm.array_validation import Array
from mstmm.expression.derivatives import INPUTS

from ..engine.looped_engine import LoopedEngine, Probe
from ..engine.state_evaluation.kinematics import point_motions
from ..kernels.tape_kernel import TapeKernel
from ..packing.expression_tapes import constant_kernel
from ..packing.scene_packing import packed_system
from ..packing.system import ForceNumbers, LoadNumbers, System
from ..result.element_quantities import deflection_of
from .mck_matrices import State

INERTIAL = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)


def without_laws(engine: LoopedEngine) -> LoopedEngine:
    """The same tree without hinge laws."""
    return LoopedEngine(packed_system(replace(engine.packed.system, laws=()), engine.packed))


def with_frozen_springs(engine: LoopedEngine, state: State) -> LoopedEngine:
    """The same tree with constant spring tensions and without hinge laws.

    Efforts of hinge laws act along the speeds of the hinges, so that constant ones would change
    nothing.  Bushings and user-defined force elements are omitted.
    """
    system = engine.packed.system
    springs = (force for force in system.forces if force.element == ("force", "spring"))
    held = tuple(_frozen_spring(engine, spring, state) for spring in springs)
    return LoopedEngine(packed_system(replace(system, laws=(), forces=held), engine.packed))


def with_frozen_loads(engine: LoopedEngine, state: State) -> LoopedEngine:
    """Variant as by `with_frozen_springs`, with loads also constant in inertial axes."""
    held = with_frozen_springs(engine, state)
    system = held.packed.system
    values = _values(system, state).tolist()
    loads = tuple(_frozen_load(engine, load, values, state) for load in system.loads)
    frozen_system = replace(system, loads=loads, values=constant_kernel("values", system, values))
    return LoopedEngine(packed_system(frozen_system, engine.packed))


def with_springs_grounded(engine: LoopedEngine, state: State) -> LoopedEngine:
    """The same tree with each spring between bodies replaced by two springs to the ground.

    Each connects one end to the position of the other end at the state.  These springs do not
    couple bodies, and their forces at the state are the same.
    """
    system = engine.packed.system
    first, second = list(system.forces), []
    for k, force in enumerate(system.forces):
        if min(body for body, _, _ in force.ends) < 0:
            continue
        seen = _observed_points(engine, [Probe(*end) for end in force.ends], state)
        still = [(-1, tuple(pose[15:24].tolist()), tuple(pose[0:3].tolist())) for pose in seen]
        first[k] = replace(force, ends=(force.ends[0], still[1]))
        second.append(replace(force, ends=(still[0], force.ends[1])))
    grounded_system = replace(system, forces=(*first, *second))
    return LoopedEngine(packed_system(grounded_system, engine.packed))


def _values(system: System, state: State) -> Array:
    """Values of the expressions of a scene at a state."""
    if system.values is None:
        return np.zeros(0)
    given = _expression_arguments(system, state)
    return TapeKernel(system.values).run(given)[1]["values"][: system.n_values].copy()


def _expression_arguments(system: System, state: State) -> dict[str, Array]:
    """Arguments of the expressions of a scene at a state."""
    inputs = system.inputs_at(state.t)
    return {"t": np.array([state.t]), "q": state.q, "u": state.u, INPUTS: inputs}


def _frozen_load(
    engine: LoopedEngine, load: LoadNumbers, values: list[float], state: State
) -> LoadNumbers:
    """Load with constant components in inertial axes, which are appended to `values`."""
    if load.axes < 0:
        return load
    turned = _observed_points(engine, [Probe(load.axes, load.axes_own, (0.0, 0.0, 0.0))], state)
    rotation = turned[0, 15:24].reshape(3, 3)
    entries_found = []
    for entries in (load.force, load.moment):
        components = [0.0 if index < 0 else values[index] for index in entries]
        entries_found.append(tuple(range(len(values), len(values) + 3)))
        values += (rotation @ components).tolist()
    return replace(
        load, axes=-1, axes_own=INERTIAL, force=entries_found[0], moment=entries_found[1]
    )


def _frozen_spring(engine: LoopedEngine, spring: ForceNumbers, state: State) -> ForceNumbers:
    """Spring with the constant tension of the state."""
    length, rate = spring_length(engine, spring, state)
    stiffness, rest, damping = spring.p
    effort = -stiffness * (length - rest) - damping * rate
    if spring.effort is not None:
        given = _expression_arguments(engine.packed.system, state)
        kernel = TapeKernel(spring.effort)
        effort += float(kernel.run({**given, "length": np.array([length, rate])})[1]["values"][0])
    constant = constant_kernel("effort", engine.packed.system, [effort])
    return replace(spring, p=(0.0, 0.0, 0.0), effort=constant)


def spring_length(engine: LoopedEngine, spring: ForceNumbers, state: State) -> tuple[float, float]:
    """Length (m) and rate (m/s) of a spring at a state."""
    seen = _observed_points(engine, [Probe(*end) for end in spring.ends], state)
    apart, moving = seen[1, 0:3] - seen[0, 0:3], seen[1, 3:6] - seen[0, 3:6]
    length = float(np.linalg.norm(apart))
    return length, float(apart @ moving) / length


def bushing_deflection(engine: LoopedEngine, bushing: ForceNumbers, state: State) -> Array:
    """Deflection (6,) of a bushing at a state, in its own axes."""
    rest, end = _observed_points(
        engine, [Probe(*bushing_end) for bushing_end in bushing.ends], state
    )
    return deflection_of((rest[None], end[None]))[0]


def _observed_points(engine: LoopedEngine, probes: list[Probe], state: State) -> Array:
    """Motion (probes, 24) of points at a state, in the form of `Observation.points`.

    The opened tree of a closed loop may have bodies without inertia, so that its accelerations
    are undetermined; kinematics alone need none.
    """
    return point_motions(engine, probes, state.q, state.u, state.udot)
