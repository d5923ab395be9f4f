"""Checks of a definition before anything is generated from it; each refusal names the equation.

Numbers are drawn from a fixed sequence within the declared bounds and evaluated at 40 digits.
"""

from __future__ import annotations

import difflib
import math
import random
from collections.abc import Iterable

import mpmath
import sympy as sp

from mstmm.errors import ElementError
from mstmm.ir.facts import FRAMES
from mstmm.ir.spec import Param

from ..catalogue.registry import Element, builtin_elements, kind_of
from ..equations.hinge import HingeMotion, motion_of, speeds_of
from ..language import returned as stated
from ..language.element import Body, ForceElement, Hinge, Symbols, rotation_about
from ..language.switches import slope
from .evaluate_equations import Undefined, evaluate_matrix
from .smoothness import refuse_jumps
from .units import Dimension, Misfit, dimension, dimension_of, text

_DIGITS = 40
_POINTS = 5
_TOLERANCE = mpmath.mpf(10) ** -25
Numbers = dict[sp.Basic, float]


def check(element: Element) -> None:
    """Run all checks of an element.  Raises ElementError that names element and equation."""
    _check_names(element)
    if isinstance(element, Hinge):
        check_hinge(element)
    elif isinstance(element, Body):
        check_body(element)
    else:
        check_force(element)


def _check_methods(where: str, element: Element) -> None:
    """Reject a method whose name nearly matches one of the base class: it would never be called."""
    base = next(kind for kind in (Hinge, Body, ForceElement) if isinstance(element, kind))
    known = [name for name in dir(base) if not name.startswith("_")]
    for name, value in vars(type(element)).items():
        if name.startswith("_") or name in known or not callable(value):
            continue
        near = difflib.get_close_matches(name, known, 1, 0.75)
        if near:
            raise ElementError(
                f"{where}: {name} is not a method of a {kind_of(element)}; did you mean {near[0]}? "
                "(begin the names of your own methods with _)"
            )


#: Maximum length of an element name, which becomes part of file names.
_LONGEST = 60


def _check_names(element: Element) -> None:
    name = element.name
    if not name.isidentifier() or not name.isascii() or len(name) > _LONGEST:
        raise ElementError(
            f"{name!r:.80} is not a name: at most {_LONGEST} letters, digits and underscores, "
            "starting with a letter"
        )
    where = f"{kind_of(element)} {name}"
    for other in builtin_elements():
        taken = (kind_of(other), other.name) == (kind_of(element), name)
        if taken and type(other) is not type(element):
            raise ElementError(f"{where}: this name is built in; choose another name")
    _check_methods(where, element)
    groups = {"parameters": element.parameters}
    if isinstance(element, Hinge):
        groups["coordinates"] = element.coordinates
        if element.speeds is not None:
            groups["speeds"] = element.speeds
    for what, group in groups.items():
        _check_declared(f"{where}: {what}", group)


def _check_declared(where: str, group: object) -> None:
    """Check that a group is a tuple of Param with names, known units and ordered bounds."""
    if not isinstance(group, (tuple, list)) or not all(isinstance(p, Param) for p in group):
        raise ElementError(
            f'{where}: expected a tuple such as (Param("radius", "m"),), found {group!r:.80}'
        )
    seen: set[str] = set()
    for p in group:
        if not isinstance(p.name, str) or not p.name.isidentifier() or not p.name.isascii():
            raise ElementError(
                f"{where}: {p.name!r:.80} is not a name: letters, digits and underscores"
            )
        if p.name in seen:
            raise ElementError(f"{where}: {p.name!r} is declared twice")
        seen.add(p.name)
        if not isinstance(p.unit, str):
            raise ElementError(f'{where}: unit of {p.name}: expected text such as "m", "N*m/rad"')
        try:
            dimension(p.unit)
        except ElementError as error:
            raise ElementError(f"{where}: {p.name}: {error}") from None
        _check_bounds(f"{where}: {p.name}", p)


def _check_bounds(where: str, p: Param) -> None:
    for what in ("default", "minimum", "maximum"):
        value = getattr(p, what)
        number = isinstance(value, (int, float)) and not isinstance(value, bool)
        if value is not None and not (number and math.isfinite(value)):
            raise ElementError(f"{where}: {what}: expected a number, found {value!r:.40}")
    ordered = [v for v in (p.minimum, p.default, p.maximum) if v is not None]
    if ordered != sorted(ordered):
        raise ElementError(f"{where}: expected minimum <= default <= maximum, found {ordered}")


# --- hinges -----------------------------------------------------------------------------------


def check_hinge(hinge: Hinge) -> HingeMotion:
    """Check rotation, rank, stated H and bias, and units; return the derived motion."""
    where = f"hinge {hinge.name}"
    if len(speeds_of(hinge)) > 6:
        raise ElementError(f"{where}: {len(speeds_of(hinge))} speeds; a hinge has at most six")
    _check_frame(where, hinge)
    motion = motion_of(hinge)
    _only_known_symbols(where, motion)
    _units_fit(where, motion)
    q, u, p = motion.q, motion.u, motion.p
    given = (
        ("subspace(q, p)",
         stated.optional(where, "subspace(q, p)", hinge.subspace, q, p), motion.subspace),
        ("bias(q, u, p)",
         stated.optional(where, "bias(q, u, p)", hinge.bias, q, u, p), motion.bias),
    )  # fmt: skip
    points = list(_points(motion))
    refuse_jumps(
        where,
        {"position(q, p)": motion.position, "rotation(q, p)": motion.rotation,
         "the velocity that follows from position and rotation": motion.subspace},
        {s: _range(c) for s, c in zip(motion.q, hinge.coordinates, strict=True)},
        points[:2],
        "a jump of the velocity is an impulse; define branches with equal values and slopes there",
    )  # fmt: skip
    for point in points:
        _is_rotation(where, motion, point)
        _numeric(f"{where}: position(q, p)", motion.position, point)
        _has_full_rank(where, motion, point)
        for what, matrix, derived in given:
            _agrees(where, what, matrix, derived, point)
    return motion


#: Keys of a hinge table that a definition may read, and those that each frame requires.
_KEYS = ("axis", "axis2", "lead")
_NEEDED = {"crossing": ("axis", "axis2"), "plane": ("axis", "axis2")}


def _check_frame(where: str, hinge: Hinge) -> None:
    """Check `frame` and `keys`, which define how a scene places the hinge."""
    if hinge.frame not in FRAMES:
        words = ", ".join(f'"{frame}"' for frame in FRAMES)
        raise ElementError(f"{where}: frame: expected one of {words}, found {hinge.frame!r:.40}")
    if not isinstance(hinge.keys, tuple) or not set(hinge.keys) <= set(_KEYS):
        raise ElementError(
            f"{where}: keys: expected a tuple of {', '.join(_KEYS)}, found {hinge.keys!r:.60}"
        )
    missing = [key for key in _NEEDED.get(hinge.frame, ()) if key not in hinge.keys]
    if missing:
        raise ElementError(f'{where}: frame "{hinge.frame}" needs {missing[0]} among the keys')
    names = [parameter.name for parameter in hinge.parameters]
    if "lead" in hinge.keys and "lead" not in names:
        raise ElementError(f"{where}: keys: lead is not a declared parameter; declare it")
    if hinge.frame == "crossing" and not names:
        raise ElementError(
            f'{where}: frame "crossing": its first parameter is the angle between the axes in rad; '
            "declare it"
        )


def _points(motion: HingeMotion) -> Iterable[Numbers]:
    """Random values of q, u, p; quaternions need no unit norm, since rotations are normalised."""
    numbers = random.Random(20260)
    for _ in range(_POINTS):
        point: Numbers = {}
        for symbols, declared in (
            (motion.q, motion.hinge.coordinates),
            (motion.u, speeds_of(motion.hinge)),
            (motion.p, motion.hinge.parameters),
        ):
            for symbol, parameter in zip(symbols, declared, strict=True):
                point[symbol] = _draw(parameter, numbers)
        yield point


def _draw(parameter: Param, numbers: random.Random) -> float:
    low, high = parameter.minimum, parameter.maximum
    if low is None:
        low = -1.0 if high is None else high - 2.0
    if high is None:
        high = max(1.0, low + 2.0)
    return numbers.uniform(low, high)


def _range(parameter: Param) -> tuple[float, float]:
    """Sample interval of a coordinate: its bounds, or one turn about zero."""
    low = -3.5 if parameter.minimum is None else parameter.minimum
    return low, max(3.5, low + 7.0) if parameter.maximum is None else parameter.maximum


def _numeric(where: str, matrix: sp.Matrix, point: Numbers) -> mpmath.matrix:
    if 0 in matrix.shape:
        return mpmath.matrix(matrix.rows, 0)
    try:
        return mpmath.matrix(evaluate_matrix(matrix, point, _DIGITS))
    except Undefined as undefined:
        raise ElementError(f"{where}: {undefined}, at {_at(point)}") from None


def _at(point: Numbers) -> str:
    return ", ".join(f"{name} = {float(value):.3g}" for name, value in point.items())


def _only_known_symbols(where: str, motion: HingeMotion) -> None:
    known = {*motion.q, *motion.p}
    for what, matrix, names in (
        ("rotation(q, p)", motion.rotation, known),
        ("position(q, p)", motion.position, known),
        ("rates(q, u, p)", motion.rates, known | {*motion.u}),
    ):
        _refuse_strange(where, what, matrix, names)
    for speed in motion.u:
        if motion.rates.diff(speed).free_symbols & set(motion.u):
            raise ElementError(f"{where}: rates(q, u, p) must be linear in u: qdot = N(q) u")
    if any(motion.rates.xreplace(dict.fromkeys(motion.u, sp.Integer(0)))):
        raise ElementError(f"{where}: rates(q, u, p) must vanish with u: qdot = N(q) u")


def _refuse_strange(where: str, what: str, matrix: sp.Basic, known: set[sp.Symbol]) -> None:
    strange = sorted(map(str, matrix.free_symbols - known))
    if strange:
        allowed = what[what.find("(") + 1 : -1] if what.endswith(")") else "its arguments"
        raise ElementError(
            f"{where}: {what} contains {', '.join(strange)}; expected only {allowed}"
        )


def _is_rotation(where: str, motion: HingeMotion, point: Numbers) -> None:
    with mpmath.workdps(_DIGITS):
        r = _numeric(f"{where}: rotation(q, p)", motion.rotation, point)
        defect = mpmath.mnorm(r.T * r - mpmath.eye(3), "f")
        if defect > _TOLERANCE or mpmath.det(r) < 0:
            raise ElementError(
                f"{where}: rotation(q, p) is not a rotation: "
                f"|R^T R - I| = {mpmath.nstr(defect, 3)}, det R = {mpmath.nstr(mpmath.det(r), 5)} "
                "at " + ", ".join(f"{k} = {float(v):.3g}" for k, v in point.items())
            )


def _has_full_rank(where: str, motion: HingeMotion, point: Numbers) -> None:
    if motion.nu == 0:
        return
    with mpmath.workdps(_DIGITS):
        singular = mpmath.svd_r(
            _numeric(f"{where}: motion subspace H", motion.subspace, point), compute_uv=False
        )
        rank = sum(1 for s in singular if s > singular[0] * mpmath.mpf(10) ** -12)
        if rank < motion.nu:
            raise ElementError(
                f"{where}: the {motion.nu} speeds give only "
                f"{rank} independent "
                "motions (the motion subspace H loses rank); remove a coordinate, or let rotation "
                "and position depend on every one of them"
            )


def _agrees(
    where: str, what: str, given: sp.Matrix | None, derived: sp.Matrix, point: Numbers
) -> None:
    if given is None:
        return
    if given.shape != derived.shape:
        raise ElementError(
            f"{where}: {what} is {given.rows} x {given.cols}, "
            f"expected {derived.rows} x {derived.cols}"
        )
    with mpmath.workdps(_DIGITS):
        difference = _numeric(f"{where}: {what}", given, point) - _numeric(where, derived, point)
        for i in range(difference.rows):
            for j in range(difference.cols):
                if abs(difference[i, j]) > _TOLERANCE:
                    raise ElementError(
                        f"{where}: {what} disagrees with rotation and position in entry "
                        f"({i + 1}, {j + 1}): stated {given[i, j]}, derived {derived[i, j]}"
                    )


def _units_fit(where: str, motion: HingeMotion) -> None:
    known = _dimensions(motion.q, motion.hinge.coordinates)
    known |= _dimensions(motion.p, motion.hinge.parameters)
    _expect(where, "rotation(q, p)", motion.rotation, "", known)
    _expect(where, "position(q, p)", motion.position, "m", known)
    known |= _dimensions(motion.u, speeds_of(motion.hinge))
    for rate, coordinate in zip(motion.rates, motion.hinge.coordinates, strict=True):
        unit = f"{coordinate.unit or '1'}/s"
        _expect(where, f"rates(q, u, p), rate of {coordinate.name}", sp.Matrix([rate]), unit, known)


def _dimensions(symbols: Symbols, declared: tuple[Param, ...]) -> dict[sp.Basic, Dimension]:
    return {s: dimension(p.unit) for s, p in zip(symbols, declared, strict=True)}


def _expect(
    where: str, what: str, matrix: sp.Matrix, unit: str, known: dict[sp.Basic, Dimension]
) -> None:
    wanted = dimension(unit)
    for i in range(matrix.rows):
        for j in range(matrix.cols):
            entry = f"entry ({i + 1}, {j + 1}) of {what}" if matrix.shape != (1, 1) else what
            try:
                found = dimension_of(matrix[i, j], known)
            except Misfit as misfit:
                raise ElementError(f"{where}: {entry}: units do not fit: {misfit}") from None
            if found is not None and found != wanted:
                raise ElementError(
                    f"{where}: {entry} = {matrix[i, j]}: expected {unit or 'a pure number'}, "
                    f"found {text(found)}"
                )


# --- bodies and force elements ------------------------------------------------------------------


def check_body(body: Body) -> None:
    """Check that the residual is linear, agrees with the kinetic energy, and has correct units."""
    where = f"body {body.name}"
    p = Symbols("p", tuple(x.name for x in body.parameters))
    a, alpha, w, v = (
        sp.Matrix(sp.symbols(f"{n}_x {n}_y {n}_z", real=True)) for n in ("a", "alpha", "w", "v")
    )
    forces, energies = "residual(a, alpha, w, p)", "kinetic_energy(v, w, p)"
    residual = stated.matrix(where, forces, body.residual, (6, 1), a, alpha, w, p)
    _refuse_strange(where, forces, residual, {*a, *alpha, *w, *p})
    mass = _slopes(residual, sp.Matrix.vstack(a, alpha))
    if mass.applyfunc(sp.expand).free_symbols & {*a, *alpha}:
        raise ElementError(f"{where}: {forces} is not linear in a and alpha")
    energy = stated.scalar(where, energies, body.kinetic_energy, v, w, p)
    _refuse_strange(where, energies, energy, {*v, *w, *p})
    speeds = sp.Matrix.vstack(v, w)
    from_energy = _slopes(_slopes(sp.Matrix([energy]), speeds).T, speeds)
    rate = _energy_rate(residual, energy, (a, alpha, v, w))
    numbers = random.Random(20261)
    for _ in range(_POINTS):
        point: Numbers = {s: numbers.uniform(-1, 1) for s in (*a, *alpha, *w, *v)}
        point |= {s: _draw(x, numbers) for s, x in zip(p, body.parameters, strict=True)}
        masses = _numeric(f"{where}: {forces}", mass, point)
        if not _close(_numeric(f"{where}: {energies}", from_energy, point), masses):
            raise ElementError(f"{where}: {energies} and {forces} state different masses")
        power = _numeric(f"{where}: {forces}", rate, point)
        if not _close(power[:1, :], power[1:, :]):
            raise ElementError(f"{where}: the power of {forces} is not the rate of {energies}")
    _body_units(where, body, (residual, energy), p, (a, alpha, w, v))


def _slopes(matrix: sp.Matrix, symbols: sp.Matrix) -> sp.Matrix:
    """Jacobian of a column, one column per symbol."""
    return sp.Matrix.hstack(*(sp.Matrix(slope(matrix, s)) for s in symbols))


def _close(one: mpmath.matrix, two: mpmath.matrix) -> bool:
    with mpmath.workdps(_DIGITS):
        size = 1 + max(abs(x) for x in (*one, *two))
        return all(abs(x - y) <= _TOLERANCE * size for x, y in zip(one, two, strict=True))


def _energy_rate(residual: sp.Matrix, energy: sp.Expr, names: tuple[sp.Matrix, ...]) -> sp.Matrix:
    """[dT/dt; power of the residual] (classical acceleration a, velocity in body axes)."""
    a, alpha, v, w = names
    v_rate = a - w.cross(v)
    rate = sum(slope(energy, s) * r for s, r in zip((*v, *w), (*v_rate, *alpha), strict=True))
    power = residual[:3, :].dot(v) + residual[3:, :].dot(w)
    return sp.Matrix([rate, power])


def _body_units(
    where: str,
    body: Body,
    said: tuple[sp.Matrix, sp.Expr],
    p: Symbols,
    names: tuple[sp.Matrix, ...],
) -> None:
    known = _dimensions(p, body.parameters)
    for symbols, unit in zip(names, ("m/s2", "rad/s2", "rad/s", "m/s"), strict=True):
        known |= {s: dimension(unit) for s in symbols}
    residual, energy = said
    _expect(where, "the force of residual", sp.expand(residual[:3, :]), "N", known)
    _expect(where, "the moment of residual", sp.expand(residual[3:, :]), "N*m", known)
    _expect(where, "kinetic_energy", sp.Matrix([energy]), "J", known)


def check_force(force: ForceElement) -> None:
    """Check units (wrench N and N*m, potential J), arguments and continuity of the potential."""
    where = f"force {force.name}"
    p = Symbols("p", tuple(x.name for x in force.parameters))
    x, v, w = (sp.Matrix(sp.symbols(f"{n}_1 {n}_2 {n}_3", real=True)) for n in ("x", "v", "w"))
    rotation = sp.Matrix(3, 3, sp.symbols("R_1:10", real=True))
    effort, t = sp.Symbol("effort", real=True), sp.Symbol("t", real=True)
    what = "wrench(x, v, rotation, w, p, effort, t)"
    push, turn = stated.pair(where, what, force.wrench, x, v, rotation, w, p, effort, t)
    energy = _energy(where, force, x, rotation, p)
    known = _dimensions(p, force.parameters)
    for symbols, unit in ((x, "m"), (v, "m/s"), (w, "rad/s"), (rotation, "")):
        known |= {s: dimension(unit) for s in symbols}
    known |= {effort: dimension("N"), t: dimension("s")}
    _refuse_strange(where, what, sp.Matrix.vstack(push, turn), set(known))
    numbers, angle = random.Random(20262), sp.Symbol("angle", real=True)
    drawn = [{s: numbers.uniform(-1, 1) for s in (*x, angle)} for _ in range(2)]
    for point in drawn:
        point |= {s: _draw(one, numbers) for s, one in zip(p, force.parameters, strict=True)}
    refuse_jumps(
        where, {"potential(x, p)": sp.Matrix([energy.xreplace(_turned(rotation, angle))])},
        dict.fromkeys((*x, angle), (-2.0, 2.0)), drawn,
        "a jump of the potential creates energy; define branches with equal values there",
    )  # fmt: skip
    _expect(where, "the force of wrench", push, "N", known)
    _expect(where, "the moment of wrench", turn, "N*m", known)
    _expect(where, "potential", sp.Matrix([energy]), "J", known)


def _energy(
    where: str, force: ForceElement, x: sp.Matrix, rotation: sp.Matrix, p: Symbols
) -> sp.Expr:
    """The potential as a function of x and, where a deflection is stated, of the rotation."""
    said = "deflection(x, rotation, p)"
    bent = stated.optional(where, said, force.deflection, x, rotation, p)
    if bent is None:
        energy = stated.scalar(where, "potential(x, p)", force.potential, x, p)
        _refuse_strange(where, "potential(x, p)", energy, {*x, *p})
        return energy
    if bent.cols != 1:
        raise ElementError(f"{where}: {said} must be n x 1, found {bent.rows} x {bent.cols}")
    energy = stated.scalar(where, "potential(deflection, p)", force.potential, bent, p)
    _refuse_strange(where, "potential(deflection, p)", energy, {*x, *rotation, *p})
    return energy


def _turned(rotation: sp.Matrix, angle: sp.Symbol) -> dict[sp.Symbol, sp.Expr]:
    """Entries of a rotation by `angle` about an axis that is no coordinate axis."""
    axis = (sp.Rational(3, 13), sp.Rational(4, 13), sp.Rational(12, 13))
    return dict(zip(rotation, rotation_about(axis, angle), strict=True))


__all__ = ["check", "check_body", "check_force", "check_hinge"]
