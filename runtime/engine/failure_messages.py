"""Messages for engine failures: element or expression, time, cause, remedy."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Protocol

import numpy as np

from mstmm.abi.failure_codes import FailureCode
from mstmm.array_validation import Array
from mstmm.expression.derivatives import expression_derivatives, motion_at
from mstmm.expression.expression import Expression, Name
from mstmm.ir.statements import NEGATIVE_DETERMINANT
from mstmm.scene import Bushing
from mstmm.scene.checks.connectivity import resolve_coordinate

from ..packing.coordinate_layout import OF_CONSTRAINT
from ..packing.packed_scene import PackedScene

if TYPE_CHECKING:
    from mstmm.scene import Constraint, Hinge, Scene
    from mstmm.scene.tables.loads import Spring


class FailingEngine(Protocol):
    """Engine whose failures are described: it names elements and observes ends of springs."""

    packed: PackedScene

    @property
    def inertia_only(self) -> FailingEngine: ...
    def hinge_name(self, position: int, /) -> str: ...
    def body_name(self, position: int, /) -> str: ...
    def is_flexible(self, position: int, /) -> bool: ...
    def closing_label(self, position: int, /) -> str: ...
    def start_memory(self) -> Array: ...
    def spring_motion(
        self, spring: Spring, t: Array, q: Array, u: Array, memory: Array, /
    ) -> tuple[Array, Array]: ...


# --- elements -------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Failure:
    """Failure of an element, with the names that its message contains."""

    engine: FailingEngine
    element: int
    code: int
    at: str

    @property
    def hinge(self) -> str:
        return self.engine.hinge_name(self.element)

    @property
    def section(self) -> str:
        return self.hinge.replace("/", ".")

    @property
    def is_segment(self) -> bool:
        """Whether the element is reached by a segment of an exact beam."""
        section = self.engine.packed.system.body(self.element).section
        return section is not None and section.is_segment

    @property
    def curve(self) -> str:
        return self.hinge.removesuffix(OF_CONSTRAINT)

    @property
    def node(self) -> str:
        return self.engine.body_name(self.element)

    @property
    def body(self) -> str:
        return self.node.split("/")[0]

    @property
    def closing(self) -> str:
        return self.engine.closing_label(self.element)

    @property
    def force(self) -> str:
        return self.engine.packed.scene.forces[self.element].name

    @property
    def controller(self) -> str:
        return self.engine.packed.user_scene.controller[self.element].name

    @property
    def coupling(self) -> str:
        return self.engine.packed.system.couplings[self.element].name

    @property
    def event(self) -> str:
        return self.engine.packed.user_scene.event_label(self.element)

    @property
    def tangent(self) -> str:
        return f'hinge "{self.hinge}"' if self.element >= 0 else "force elements between bodies"

    @property
    def loop_remedy(self) -> str:
        return self.engine.packed.find_loop_cause() or (
            "start from model.assemble(q, u), or check whether links are stretched out in line "
            "(model.loops.singular), or a drive requires a motion that the mechanism cannot make"
        )


#: Message by reason, with attributes of a `_Failure`; a function chooses one of several.
_TEXTS: dict[int, str | Callable[[_Failure], str]] = {
    FailureCode.UNDETERMINED: lambda failure: (
        'hinge "{0.hinge}" {0.at}: no positive inertia remains along its motion: the shapes of '
        'flexible body "{0.body}" represent all of it, or its deflection is too large for the '
        'stiffened model; use fewer shapes, frame = "chord" or "mean", quadrature = true, or split '
        "it into welded beams"
        if failure.engine.is_flexible(failure.element)
        else 'hinge "{0.hinge}" {0.at}: its motion is undetermined, because the outboard bodies '
        "have no positive inertia along it (a thin rod on a ball hinge, a point mass, collinear "
        "axes, gimbal lock of three angles, a negative principal moment); give the body inertia, "
        "give the hinge rotor inertia (law.inertia), fix that motion, or use a ball hinge for "
        "three angles"
    ),
    FailureCode.FORCE: lambda failure: (
        'bushing "{0.force}" {0.at}: its ends are rotated by more than 170 degrees from rest, the '
        "limit of its law; make it stiffer, or replace it by a hinge with a law"
        if isinstance(failure.engine.packed.scene.forces[failure.element], Bushing)
        else 'spring "{0.force}" {0.at}: its direction is undefined because its ends coincide; '
        "move one of them, or replace it by an elastic hinge or a bushing"
    ),
    FailureCode.EXPRESSION: "an expression of the scene cannot be evaluated {0.at}",
    FailureCode.HINGE: lambda failure: (
        'constraint "{0.curve}" {0.at}: its curve or a derivative of it is not finite'
        if failure.hinge.endswith(OF_CONSTRAINT)
        else 'hinge "{0.hinge}" {0.at}: its definition cannot be evaluated at this state'
    ),
    FailureCode.PRODUCT_PIVOT: (
        'hinge "{0.hinge}" {0.at}: the pivot of its classical matrix vanishes, so that the product '
        'does not exist at this state; use sweep = "riccati"'
    ),
    FailureCode.PRODUCT_ERROR: (
        "the product of transfer matrices {0.at}: its deviation from the Riccati sweep exceeds the "
        'requested accuracy (errors grow geometrically along the chain); use sweep = "riccati"'
    ),
    FailureCode.SECTION: lambda failure: (
        '"{0.section}" {0.at}: the segment to it rotates by more than 1.5 rad; use more modes, '
        "which shortens the segments, or split the beam"
        if failure.is_segment
        else '"{0.section}" {0.at}: a section rotates by more than 1.5 rad relative to its '
        'floating frame, the limit of small deflections; use kinematics = "exact" for a beam, or '
        "split the body into several welded bodies"
    ),
    FailureCode.MODES: (
        'flexible body "{0.node}" {0.at}: its modal mass matrix is not positive definite; use '
        'fewer shapes, frame = "chord" or "mean", or quadrature = true'
    ),
    FailureCode.TANGENT: lambda failure: (
        "{0.tangent} {0.at}: an unstable motion grows faster than the step allows (a negative "
        "stiffness, a body that topples or buckles, inertia that vanishes); use a shorter step, or "
        "give the motion inertia (law.inertia) or a spring"
        if failure.code == NEGATIVE_DETERMINANT
        else "{0.tangent} {0.at}: a motion is undetermined in the equations of an implicit step: "
        "it has no inertia, stiffness or damping, or a negative stiffness cancels them; use a "
        "shorter step, or give the motion inertia (law.inertia) or a spring"
    ),
    FailureCode.CONTROLLER: (
        'controller "{0.controller}" {0.at}: its measurement or output is not finite; check '
        "whether the closed loop is stable, perhaps with a shorter sample_time"
    ),
    FailureCode.LOOP: (
        "{0.closing} {0.at}: its loop is open, and no nearby state closes it; {0.loop_remedy}"
    ),
    FailureCode.BOUNCE: (
        "{0.event} {0.at}: no motion can respond to its impact, because the bodies in contact are "
        "driven or fixed; move the bounce to another body, or release the hinge"
    ),
    FailureCode.COUPLING: (
        'coupling "{0.coupling}" {0.at}: it is not satisfied, and no nearby state satisfies it; '
        "check whether drives or other couplings contradict it"
    ),
    FailureCode.FLAT: (
        "{0.closing} {0.at}: the disc is flat on its plane and touches it in more than one point; "
        "end the run before that by an [[event]], or start it upright"
    ),
}


def failure_text(engine: FailingEngine, reason: int, element: int, code: int, t: float) -> str:
    """Message for the failure of `element` at t (s); `code` is the failure code of its kernel."""
    failure = _Failure(engine, element, code, f"at t = {t:.9g} s")
    text = _TEXTS.get(reason, _TEXTS[FailureCode.EXPRESSION])
    return (text if isinstance(text, str) else text(failure)).format(failure)


# --- expressions ----------------------------------------------------------------------------------


#: Distance from the end of a curve, relative to max(1, abs(s)), at which a motion has reached it.
_END_DISTANCE = 1e-6

#: Remedy at the end of messages that name an expression.
REMEDY = "keep it finite along the motion"


def find_nonfinite_expression(engine: FailingEngine, t: float, q: Array, u: Array) -> str:
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


def find_nonfinite_derivative(engine: FailingEngine, t: float, q: Array, u: Array) -> str:
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


def describe_curve_end(engine: FailingEngine, t: float, q: Array, u: Array, ahead: float) -> str:
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
    engine: FailingEngine, t: float, q: Array, u: Array
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

    def __init__(self, engine: FailingEngine, t: float, q: Array, u: Array) -> None:
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
        engine = self.engine.inertia_only
        state = np.array([self.t]), self.q[None], self.u[None], engine.start_memory()[None]
        length, rate = engine.spring_motion(spring, *state)
        return float(length[0]), float(rate[0])
