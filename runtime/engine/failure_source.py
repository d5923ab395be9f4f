"""Search for the expression or quaternion that causes a non-finite motion or tangent."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array
from mstmm.expression.derivatives import expression_derivatives, motion_at
from mstmm.expression.expression import Expression, Name
from mstmm.scene.checks.connectivity import resolve_coordinate

from .engine_calls import EngineCalls, Probe

if TYPE_CHECKING:
    from mstmm.scene import Constraint, Hinge, Scene
    from mstmm.scene.tables.loads import Spring

#: Distance from the end of a curve, relative to max(1, abs(s)), at which a motion has reached it.
_END_DISTANCE = 1e-6

#: Remedy at the end of messages that name an expression.
REMEDY = "keep it finite along the motion"


def find_nonfinite_expression(engine: EngineCalls, t: float, q: Array, u: Array) -> str:
    """Message that names a non-finite expression at a state q (nq,), u (nu,), or "".

    Example: 'load "wind": force[1] = "sqrt(1-t)" is nan at t = 1.1 s'.  Also reports a quaternion
    of zero length; ignores expressions that the engine does not evaluate.
    """
    model = engine.packed.model
    scene, layout = engine.packed.user_scene, engine.packed.layout
    for first in layout.quaternions:
        if not np.linalg.norm(q[first : first + 4]) > 0:
            return (
                f"the quaternion starting at {layout.q_name(int(first))} has zero length at "
                f"t = {t:.9g} s; the identity rotation is 1, 0, 0, 0"
            )
    for location, drive in _drive_expressions(scene) if model.n_drives else ():
        drive_values = motion_at(drive, t, scene.channels)
        for kind, value in zip(("", " speed", " acceleration"), drive_values, strict=True):
            if not math.isfinite(value):
                return _nonfinite_text(f"{location}{kind}", drive, value, t)
    for location, expression, values in _expressions_with_values(engine, t, q, u):
        value = expression.evaluate(values)
        if not math.isfinite(value):
            return _nonfinite_text(location, expression, value, t)
    return ""


def find_nonfinite_derivative(engine: EngineCalls, t: float, q: Array, u: Array) -> str:
    """Message that names an expression with a non-finite derivative at a state, or "".

    Example: 'hinge "pin": law.effort[0] = "sqrt(q)" has no finite derivative with respect to q at
    t = 0 s'.  Only
    derivatives that implicit methods need are tested.
    """
    for location, expression, values in _expressions_with_values(engine, t, q, u):
        for name, slope in expression_derivatives(expression, values).items():
            is_state_dependent = name.text == "t" or name.quantity in ("q", "u")
            if is_state_dependent and not math.isfinite(slope):
                return (
                    f"{_quote_expression(location, expression)} has no finite derivative "
                    f"with respect to {name.text} at t = {t:.9g} s, which implicit methods need; "
                    "make it smooth there, such as "
                    "sqrt(abs(u) + 1e-6) for sqrt(abs(u)), or use an explicit method such as dop853"
                )
    return ""


def describe_curve_end(engine: EngineCalls, t: float, q: Array, u: Array, ahead: float) -> str:
    """Message that names a curve that ends at a state or within `ahead` (s) of it, or "".

    Example: 'constraint "wire": curve[1] = "sqrt(1-s)" ends at s = 1, ...'.
    """
    expression_values = _ExpressionValues(engine, t, q, u)
    for constraint in engine.packed.user_scene.constraint if engine.packed.system.has_loops else ():
        for k, entry in enumerate(constraint.curve or ()):
            s, rate = (
                expression_values.curve_parameter(f"{constraint.name}.{name}")
                for name in ("s", "s_rate")
            )
            end_s = _curve_end(partial(_curve_value, entry), s, rate, ahead)
            if end_s is not None:
                location = _quote_expression(f'constraint "{constraint.name}": curve[{k}]', entry)
                return (
                    f"{location} ends at s = {end_s:.9g}, which the motion reaches near t = "
                    f"{t:.9g} s; {REMEDY}, or stop the run before that by an [[event]]"
                )
    return ""


def _curve_value(entry: Expression, s: float) -> float:
    return entry.evaluate(lambda _: s)


def _curve_end(
    value: Callable[[float], float], s: float, rate: float, ahead: float
) -> float | None:
    """Last s with a finite value if it is close to `s` or reached within `ahead` (s), else None."""
    if not math.isfinite(value(s)):
        return None
    rate = rate if math.isfinite(rate) else 0.0
    direction = math.copysign(1.0, rate)
    end_distance = _END_DISTANCE * max(1.0, abs(s))
    for sign, max_distance in (
        (direction, max(abs(rate) * ahead, end_distance)),
        (-direction, end_distance),
    ):
        distance = 4 * math.ulp(s)
        while distance < 2 * max_distance and math.isfinite(value(s + sign * distance)):
            distance *= 2
        if not distance < 2 * max_distance:
            continue
        inside, outside = s, s + sign * distance
        while (middle := (inside + outside) / 2) not in (inside, outside):
            if math.isfinite(value(middle)):
                inside = middle
            else:
                outside = middle
        return inside
    return None


def _quote_expression(where: str, expression: Expression) -> str:
    text = expression.text if len(expression.text) <= 80 else f"{expression.text[:77]}..."
    return f'{where} = "{text}"'


def _nonfinite_text(where: str, expression: Expression, number: float, t: float) -> str:
    equation_text = f"{_quote_expression(where, expression)} is {number} at t = {t:.9g} s"
    return f"{equation_text}; {REMEDY}"


# --- expressions of a scene -----------------------------------------------------------------------


def _drive_expressions(scene: Scene) -> Iterator[tuple[str, Expression]]:
    for hinge in scene.hinge:
        for k, drive in enumerate(hinge.drive or ()):
            if drive is not None and not drive.is_constant:
                yield f'hinge "{hinge.name}": drive[{k}]', drive


def _effort_expressions(scene: Scene) -> Iterator[tuple[str, Expression, Hinge | None]]:
    """Location, expression and hinge of every variable effort and load, except springs."""
    for hinge in scene.hinge:
        yield from _hinge_efforts(f'hinge "{hinge.name}"', hinge)
    for first, chain in zip(scene.hinges.starts, scene.chain, strict=False):
        has_efforts = [
            any(not effort.is_constant for effort in table.law.effort) for table in chain.hinge
        ]
        for k in range(chain.count) if any(has_efforts) else ():
            hinge_of_chain = scene.hinges[first + k]
            yield from _hinge_efforts(f'hinge "{hinge_of_chain.name}"', hinge_of_chain)
    for load in scene.load:
        for key in ("force", "moment", "force_per_length"):
            for k, expression in enumerate(getattr(load, key) or ()):
                if not expression.is_constant:
                    yield f'load "{load.name}": {key}[{k}]', expression, None


def _hinge_efforts(where: str, hinge: Hinge) -> Iterator[tuple[str, Expression, Hinge]]:
    for k, effort in enumerate(hinge.law.effort):
        if not effort.is_constant:
            yield f"{where}: law.effort[{k}]", effort, hinge


def _expressions_with_values(
    engine: EngineCalls, t: float, q: Array, u: Array
) -> Iterator[tuple[str, Expression, Callable[[Name], float]]]:
    """Variable efforts, loads, couplings and curves that the engine evaluates.

    Yields location, expression and a function from the names in it to their values at a state.
    """
    model, scene = engine.packed.model, engine.packed.user_scene
    expression_values = _ExpressionValues(engine, t, q, u)
    for location, expression, hinge in _effort_expressions(scene) if model.n_values else ():
        yield location, expression, partial(expression_values.value, own=hinge)
    for spring in scene.spring if model.n_forces else ():
        effort = spring.law.effort
        if not effort.is_constant:
            location = f'spring "{spring.name}": law.effort'
            yield location, effort, partial(expression_values.spring_value, own=spring)
    for coupling in scene.coupling if model.n_couplings else ():
        location = f'coupling "{coupling.name}": '
        yield f"{location}{coupling.key}", coupling.row, expression_values.coupling_value
        if coupling.equals is not None:
            yield f"{location}equals", coupling.equals, partial(expression_values.value, own=None)
    for constraint in scene.constraint:
        for k, entry in enumerate(constraint.curve or ()):
            if not entry.is_constant:
                location = f'constraint "{constraint.name}": curve[{k}]'
                yield location, entry, partial(expression_values.curve_value, own=constraint)


class _ExpressionValues:
    """Values of the names in expressions at one state."""

    def __init__(self, engine: EngineCalls, t: float, q: Array, u: Array) -> None:
        self.engine, self.t, self.q, self.u = engine, t, q, u

    def value(self, name: Name, own: Hinge | None) -> float:
        """Value of t, an input, q, u, s or s_rate, or a parameter of the hinge `own`."""
        if name.text == "t":
            return self.t
        inputs = self.engine.packed.channels
        if name.text in inputs:
            return inputs[name.text].value(self.t)
        if name.hinge and name.quantity in ("s", "s_rate"):
            return self.curve_parameter(name.text)
        if name.quantity not in ("q", "u") and own is not None:
            return own.parameters[name.quantity]
        slots = self.engine.packed.layout.hinges[name.hinge or (own.name if own else "")]
        index = name.index or 0
        state_vector, first = (self.q, slots.q) if name.quantity == "q" else (self.u, slots.u)
        return float(state_vector[first + index])

    def coupling_value(self, name: Name) -> float:
        """Value of the coordinate or speed to which a name in a coupling refers."""
        scene = self.engine.packed.user_scene
        number, quantity, entry = resolve_coordinate(scene, name)
        slots = self.engine.packed.layout.hinges[scene.hinges.name(number)]
        return float(self.q[slots.q + entry] if quantity == "q" else self.u[slots.u + entry])

    def curve_value(self, _: Name, own: Constraint) -> float:
        """Curve parameter s of a constraint, the only name in its expressions."""
        return self.curve_parameter(f"{own.name}.s")

    def curve_parameter(self, name: str) -> float:
        """Curve parameter s of a constraint, or its rate, by name."""
        layout = self.engine.packed.layout
        if name in (names := layout.q_names):
            return float(self.q[names.index(name)])
        return float(self.u[layout.u_names.index(name)])

    def spring_value(self, name: Name, own: Spring) -> float:
        """Value of a name in a spring law, in which q and u are the length and its rate."""
        if name.text not in ("q", "u"):
            return self.value(name, None)
        length, rate = self._length(own)
        return length if name.text == "q" else rate

    def _length(self, spring: Spring) -> tuple[float, float]:
        """Length of a spring, m, and its rate, m/s, which is nan if the ends coincide."""
        inertia_engine, probes = self.engine.inertia_only, []
        for reference in (spring.from_, spring.to):
            body, axes, offset = self.engine.packed.end(reference)
            probes.append(Probe(body, axes, spring.position if body < 0 else offset))
        observation = inertia_engine.observe(
            np.array([self.t]),
            self.q[None],
            self.u[None],
            inertia_engine.start_memory()[None],
            probes,
            parts=("points",),
        )
        points = observation.points[0]
        separation, relative_velocity = (
            points[1, 0:3] - points[0, 0:3],
            points[1, 3:6] - points[0, 3:6],
        )
        length = float(np.linalg.norm(separation))
        return length, float(separation @ relative_velocity) / length if length else math.nan
