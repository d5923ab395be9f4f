"""Find the expression or quaternion that makes a state's motion or tangent not finite."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from mstmm.arrays import Array
from mstmm.expression.drive import motion_at
from mstmm.expression.expression import Expression, Name
from mstmm.expression.slope import slopes
from mstmm.scene.checks.closures import coordinate

from .calls import Calls, Probe

if TYPE_CHECKING:
    from mstmm.scene import Constraint, Hinge, Scene
    from mstmm.scene.tables.loads import Spring

#: Distance from the end of a curve, relative to 1 or to s, at which a motion has reached it.
_BESIDE = 1e-6

#: End of the messages that name an expression.
REMEDY = "keep it finite where the motion goes"


def culprit(engine: Calls, t: float, q: Array, u: Array) -> str:
    """Message that names an expression that is not finite at one state q (nq,), u (nu,), or "".

    Example: 'load "wind": force[1] = "sqrt(1-t)" is nan at t = 1.1 s'.  A quaternion of zero length
    is named too; expressions that the engine does not evaluate are ignored.
    """
    evaluated = engine.packed.model
    scene, layout = engine.packed.described, engine.packed.layout
    for first in layout.quaternions:
        if not np.linalg.norm(q[first : first + 4]) > 0:
            return (
                f"the quaternion that begins with {layout.q_name(int(first))} has zero length at "
                f"t = {t:.9g} s; the identity rotation is 1, 0, 0, 0"
            )
    for where, drive in _drives(scene) if evaluated.n_drives else ():
        moves = motion_at(drive, t, scene.channels)
        for kind, number in zip(("", " speed", " acceleration"), moves, strict=True):
            if not math.isfinite(number):
                return _sentence(f"{where}{kind}", drive, number, t)
    for where, expression, values in _with_values(engine, t, q, u):
        number = expression.evaluate(values)
        if not math.isfinite(number):
            return _sentence(where, expression, number, t)
    return ""


def steep(engine: Calls, t: float, q: Array, u: Array) -> str:
    """Message that names an expression with a derivative that is not finite at a state, or "".

    Example: 'hinge "pin": law.effort[0] = "sqrt(q)" has no finite slope along q at t = 0 s'.  Only
    derivatives that implicit methods need are tested.
    """
    for where, expression, values in _with_values(engine, t, q, u):
        for name, slope in slopes(expression, values).items():
            moves = name.text == "t" or name.quantity in ("q", "u")
            if moves and not math.isfinite(slope):
                return (
                    f"{_equation(where, expression)} has no finite slope along {name.text} at "
                    f"t = {t:.9g} s, which implicit methods need; make it smooth there, such as "
                    "sqrt(abs(u) + 1e-6) for sqrt(abs(u)), or use an explicit method such as "
                    "dop853"
                )
    return ""


def ended(engine: Calls, t: float, q: Array, u: Array, ahead: float) -> str:
    """Message that names a curve that ends next to a state or within `ahead` (s) of it, or "".

    Example: 'constraint "wire": curve[1] = "sqrt(1-s)" ends at s = 1, ...'.
    """
    seen = _State(engine, t, q, u)
    for constraint in engine.packed.described.constraint if engine.packed.system.closes else ():
        for k, entry in enumerate(constraint.curve or ()):
            s, rate = (seen.along(f"{constraint.name}.{name}") for name in ("s", "s_rate"))
            end = _end(partial(_along, entry), s, rate, ahead)
            if end is not None:
                where = _equation(f'constraint "{constraint.name}": curve[{k}]', entry)
                return (
                    f"{where} ends at s = {end:.9g}, which the motion reaches near t = {t:.9g} s; "
                    f"{REMEDY}, or stop the run before that by an [[event]]"
                )
    return ""


def _along(entry: Expression, s: float) -> float:
    return entry.evaluate(lambda _: s)


def _end(value: Callable[[float], float], s: float, rate: float, ahead: float) -> float | None:
    """Last s next to `s`, or within `ahead` seconds at a rate, at which a value is finite."""
    if not math.isfinite(value(s)):
        return None
    rate = rate if math.isfinite(rate) else 0.0
    onward = math.copysign(1.0, rate)
    beside = _BESIDE * max(1.0, abs(s))
    for way, reach in ((onward, max(abs(rate) * ahead, beside)), (-onward, beside)):
        far = 4 * math.ulp(s)
        while far < 2 * reach and math.isfinite(value(s + way * far)):
            far *= 2
        if not far < 2 * reach:
            continue
        inside, outside = s, s + way * far
        while (middle := (inside + outside) / 2) not in (inside, outside):
            if math.isfinite(value(middle)):
                inside = middle
            else:
                outside = middle
        return inside
    return None


def _equation(where: str, expression: Expression) -> str:
    text = expression.text if len(expression.text) <= 80 else f"{expression.text[:77]}..."
    return f'{where} = "{text}"'


def _sentence(where: str, expression: Expression, number: float, t: float) -> str:
    found = f"{_equation(where, expression)} is {number} at t = {t:.9g} s"
    return f"{found}; {REMEDY}"


# --- the expressions of a scene -------------------------------------------------------------------


def _drives(scene: Scene) -> Iterator[tuple[str, Expression]]:
    for hinge in scene.hinge:
        for k, drive in enumerate(hinge.drive or ()):
            if drive is not None and not drive.is_constant:
                yield f'hinge "{hinge.name}": drive[{k}]', drive


def _efforts(scene: Scene) -> Iterator[tuple[str, Expression, Hinge | None]]:
    """Location, expression and hinge of every variable effort and load; without springs."""
    for hinge in scene.hinge:
        yield from _of_hinge(f'hinge "{hinge.name}"', hinge)
    for first, chain in zip(scene.hinges.starts, scene.chain, strict=False):
        tables = [any(not e.is_constant for e in table.law.effort) for table in chain.hinge]
        for k in range(chain.count) if any(tables) else ():
            own = scene.hinges[first + k]
            yield from _of_hinge(f'hinge "{own.name}"', own)
    for load in scene.load:
        for key in ("force", "moment", "force_per_length"):
            for k, expression in enumerate(getattr(load, key) or ()):
                if not expression.is_constant:
                    yield f'load "{load.name}": {key}[{k}]', expression, None


def _of_hinge(where: str, hinge: Hinge) -> Iterator[tuple[str, Expression, Hinge]]:
    for k, effort in enumerate(hinge.law.effort):
        if not effort.is_constant:
            yield f"{where}: law.effort[{k}]", effort, hinge


def _with_values(
    engine: Calls, t: float, q: Array, u: Array
) -> Iterator[tuple[str, Expression, Callable[[Name], float]]]:
    """Variable efforts, loads, couplings and curves that the engine evaluates.

    Yields location, expression and the function that gives the values of its names at a state.
    """
    evaluated, scene = engine.packed.model, engine.packed.described
    seen = _State(engine, t, q, u)
    for where, expression, own in _efforts(scene) if evaluated.n_values else ():
        yield where, expression, partial(seen.of, own=own)
    for spring in scene.spring if evaluated.n_forces else ():
        effort = spring.law.effort
        if not effort.is_constant:
            where = f'spring "{spring.name}": law.effort'
            yield where, effort, partial(seen.of_spring, own=spring)
    for coupling in scene.coupling if evaluated.n_couplings else ():
        where = f'coupling "{coupling.name}": '
        yield f"{where}{coupling.key}", coupling.row, seen.of_coupling
        if coupling.equals is not None:
            yield f"{where}equals", coupling.equals, partial(seen.of, own=None)
    for constraint in scene.constraint:
        for k, entry in enumerate(constraint.curve or ()):
            if not entry.is_constant:
                where = f'constraint "{constraint.name}": curve[{k}]'
                yield where, entry, partial(seen.of_curve, own=constraint)


class _State:
    """Values of the names in expressions at one state."""

    def __init__(self, engine: Calls, t: float, q: Array, u: Array) -> None:
        self.engine, self.t, self.q, self.u = engine, t, q, u

    def of(self, name: Name, own: Hinge | None) -> float:
        """Value of t, an input, q or u of a hinge, or a parameter of the hinge `own`."""
        if name.text == "t":
            return self.t
        inputs = self.engine.packed.channels
        if name.text in inputs:
            return inputs[name.text].value(self.t)
        if name.hinge and name.quantity in ("s", "s_rate"):
            return self.along(name.text)
        if name.quantity not in ("q", "u") and own is not None:
            return own.parameters[name.quantity]
        slots = self.engine.packed.layout.hinges[name.hinge or (own.name if own else "")]
        index = name.index or 0
        values, first = (self.q, slots.q) if name.quantity == "q" else (self.u, slots.u)
        return float(values[first + index])

    def of_coupling(self, name: Name) -> float:
        """Coordinate or speed to which a name in a coupling refers."""
        scene = self.engine.packed.described
        number, quantity, entry = coordinate(scene, name)
        slots = self.engine.packed.layout.hinges[scene.hinges.name(number)]
        return float(self.q[slots.q + entry] if quantity == "q" else self.u[slots.u + entry])

    def of_curve(self, _: Name, own: Constraint) -> float:
        """Curve parameter s of a constraint, the only name in its expressions."""
        return self.along(f"{own.name}.s")

    def along(self, name: str) -> float:
        """Curve parameter s of a constraint, or its rate, by name."""
        layout = self.engine.packed.layout
        if name in (names := layout.q_names):
            return float(self.q[names.index(name)])
        return float(self.u[layout.u_names.index(name)])

    def of_spring(self, name: Name, own: Spring) -> float:
        """Value of a name in a spring's law, where q and u are its length and its rate."""
        if name.text not in ("q", "u"):
            return self.of(name, None)
        length, rate = self._length(own)
        return length if name.text == "q" else rate

    def _length(self, spring: Spring) -> tuple[float, float]:
        """Length of a spring, m, and its rate, m/s, which is nan if the ends coincide."""
        bare, probes = self.engine.inertia_alone, []
        for reference in (spring.from_, spring.to):
            body, axes, offset = self.engine.packed.end(reference)
            probes.append(Probe(body, axes, spring.position if body < 0 else offset))
        seen = bare.observe(
            np.array([self.t]), self.q[None], self.u[None], bare.start_memory()[None], probes,
            parts=("points",),
        )  # fmt: skip
        points = seen.points[0]
        apart, moving = points[1, 0:3] - points[0, 0:3], points[1, 3:6] - points[0, 3:6]
        length = float(np.linalg.norm(apart))
        return length, float(apart @ moving) / length if length else math.nan
