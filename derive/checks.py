"""Checks of a definition before anything is generated from it; each refusal names the equation.

Numbers are drawn from a fixed sequence within the declared bounds and evaluated at 40 digits.
"""

from __future__ import annotations

import random
from collections.abc import Iterable

import mpmath
import sympy as sp

from mstmm.errors import ElementError
from mstmm.spec import Param

from .element import Body, ForceElement, Hinge, Symbols
from .hinge import HingeMotion, motion_of, speeds_of
from .registry import Element
from .units import Dimension, Misfit, dimension, dimension_of, text

_DIGITS = 40
_POINTS = 5
_TOLERANCE = mpmath.mpf(10) ** -25
Numbers = dict[sp.Symbol, sp.Float]


def check(element: Element) -> None:
    """All checks of an element.  Raises ElementError naming element and equation."""
    _check_names(element)
    if isinstance(element, Hinge):
        check_hinge(element)
    elif isinstance(element, Body):
        check_body(element)
    else:
        check_force(element)


def _check_names(element: Element) -> None:
    if not element.name.isidentifier() or not element.name.isascii():
        raise ElementError(
            f"{element.name!r} is not a name: letters, digits, underscores, a letter first"
        )
    groups = [element.parameters]
    if isinstance(element, Hinge):
        groups += [element.coordinates, speeds_of(element)]
    for group in groups:
        names = [p.name for p in group]
        for name in names:
            if names.count(name) > 1:
                raise ElementError(f"{element.name}: {name!r} is declared twice")
    for parameter in (p for group in groups for p in group):
        dimension(parameter.unit)


# --- hinges -----------------------------------------------------------------------------------


def check_hinge(hinge: Hinge) -> HingeMotion:
    """Rotation, rank, stated H and bias, units; returns the derived motion."""
    where = f"hinge {hinge.name}"
    if len(speeds_of(hinge)) > 6:
        raise ElementError(f"{where}: {len(speeds_of(hinge))} speeds; a hinge has at most six")
    motion = motion_of(hinge)
    _only_known_symbols(where, motion)
    _units_fit(where, motion)
    for point in _points(motion):
        _is_rotation(where, motion, point)
        _has_full_rank(where, motion, point)
        _agrees(where, "subspace(q, p)", hinge.subspace(motion.q, motion.p), motion.subspace, point)
        _agrees(
            where, "bias(q, u, p)", hinge.bias(motion.q, motion.u, motion.p), motion.bias, point
        )
    return motion


def _points(motion: HingeMotion) -> Iterable[Numbers]:
    """Random values of q, u, p; quaternions need not be unit, since rotations are normalised."""
    numbers = random.Random(20260)
    for _ in range(_POINTS):
        point: Numbers = {}
        for symbols, declared in (
            (motion.q, motion.hinge.coordinates),
            (motion.u, speeds_of(motion.hinge)),
            (motion.p, motion.hinge.parameters),
        ):
            for symbol, parameter in zip(symbols, declared, strict=True):
                point[symbol] = sp.Float(_draw(parameter, numbers), _DIGITS)
        yield point


def _draw(parameter: Param, numbers: random.Random) -> float:
    low, high = parameter.minimum, parameter.maximum
    if low is None:
        low = -1.0 if high is None else high - 2.0
    if high is None:
        high = max(1.0, low + 2.0)
    return numbers.uniform(low, high)


def _numeric(matrix: sp.Matrix, point: Numbers) -> mpmath.matrix:
    with mpmath.workdps(_DIGITS):
        values = [
            [mpmath.mpf(sp.N(e.xreplace(point), _DIGITS)) for e in matrix.row(i)]
            for i in range(matrix.rows)
        ]
        return mpmath.matrix(values) if values and values[0] else mpmath.matrix(matrix.rows, 0)


def _only_known_symbols(where: str, motion: HingeMotion) -> None:
    known = {*motion.q, *motion.p}
    for what, matrix in (
        ("rotation(q, p)", motion.rotation),
        ("position(q, p)", motion.position),
    ):
        strange = sorted(map(str, matrix.free_symbols - known))
        if strange:
            raise ElementError(
                f"{where}: {what} contains {', '.join(strange)}; it may use q and p alone"
            )
        functions = {f.func for f in matrix.atoms(sp.core.function.AppliedUndef)}
        if functions:
            raise ElementError(
                f"{where}: {what} contains the unknown function {sorted(map(str, functions))[0]}"
            )
    for speed in motion.u:
        if motion.rates.diff(speed).free_symbols & set(motion.u):
            raise ElementError(f"{where}: rates(q, u, p) must be linear in u: qdot = N(q) u")


def _is_rotation(where: str, motion: HingeMotion, point: Numbers) -> None:
    with mpmath.workdps(_DIGITS):
        r = _numeric(motion.rotation, point)
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
        singular = mpmath.svd_r(_numeric(motion.subspace, point), compute_uv=False)
        rank = sum(1 for s in singular if s > singular[0] * mpmath.mpf(10) ** -12)
        if rank < motion.nu:
            raise ElementError(
                f"{where}: the {motion.nu} speeds give only "
                f"{rank} independent "
                "motions (the motion subspace H loses rank); remove a coordinate, or let rotation "
                "and position depend on every one of them"
            )


def _agrees(
    where: str, what: str, stated: sp.Matrix | None, derived: sp.Matrix, point: Numbers
) -> None:
    if stated is None:
        return
    stated = sp.Matrix(stated)
    if stated.shape != derived.shape:
        raise ElementError(
            f"{where}: {what} is {stated.rows} x {stated.cols}, "
            f"expected {derived.rows} x {derived.cols}"
        )
    with mpmath.workdps(_DIGITS):
        difference = _numeric(stated, point) - _numeric(derived, point)
        for i in range(difference.rows):
            for j in range(difference.cols):
                if abs(difference[i, j]) > _TOLERANCE:
                    raise ElementError(
                        f"{where}: {what} disagrees with rotation and position in entry "
                        f"({i + 1}, {j + 1}): stated {stated[i, j]}, derived {derived[i, j]}"
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
    """Residual linear in the accelerations, mass matrix symmetric and equal to that of the energy,
    gyroscopic forces without power, units."""
    where = f"body {body.name}"
    p = Symbols("p", tuple(x.name for x in body.parameters))
    a, alpha, w, v = (
        sp.Matrix(sp.symbols(f"{n}_x {n}_y {n}_z", real=True)) for n in ("a", "alpha", "w", "v")
    )
    residual = sp.Matrix(body.residual(a, alpha, w, p))
    if residual.shape != (6, 1):
        raise ElementError(
            f"{where}: residual(a, alpha, w, p) must be 6 x 1, found {residual.shape}"
        )
    mass = residual.jacobian(sp.Matrix.vstack(a, alpha))
    if mass.free_symbols & {*a, *alpha}:
        raise ElementError(f"{where}: residual(a, alpha, w, p) is not linear in a and alpha")
    energy = sp.sympify(body.kinetic_energy(v, w, p))
    speeds = sp.Matrix.vstack(v, w)
    if sp.simplify(sp.hessian(energy, list(speeds)) - mass) != sp.zeros(6, 6):
        raise ElementError(
            f"{where}: kinetic_energy(v, w, p) and residual(a, alpha, w, p) state different masses"
        )
    _energy_rate(where, residual, energy, (a, alpha, v, w))
    _body_units(where, body, residual, p, (a, alpha, w))


def _energy_rate(
    where: str, residual: sp.Matrix, energy: sp.Expr, names: tuple[sp.Matrix, ...]
) -> None:
    """dT/dt equals the power of the residual (classical acceleration a, velocity in body axes)."""
    a, alpha, v, w = names
    v_rate = a - w.cross(v)
    rate = sum(energy.diff(s) * r for s, r in zip((*v, *w), (*v_rate, *alpha), strict=True))
    power = residual[:3, :].dot(v) + residual[3:, :].dot(w)
    if sp.simplify(sp.expand(rate - power)) != 0:
        raise ElementError(
            f"{where}: the power of residual(a, alpha, w, p) is not the rate of "
            "kinetic_energy(v, w, p)"
        )


def _body_units(
    where: str, body: Body, residual: sp.Matrix, p: Symbols, names: tuple[sp.Matrix, ...]
) -> None:
    known = _dimensions(p, body.parameters)
    for symbols, unit in zip(names, ("m/s2", "rad/s2", "rad/s"), strict=True):
        known |= {s: dimension(unit) for s in symbols}
    _expect(where, "the force of residual", sp.expand(residual[:3, :]), "N", known)
    _expect(where, "the moment of residual", sp.expand(residual[3:, :]), "N*m", known)


def check_force(force: ForceElement) -> None:
    """Wrench in N and N*m, potential in J, nothing but its own arguments inside."""
    where = f"force {force.name}"
    p = Symbols("p", tuple(x.name for x in force.parameters))
    x, v, w = (sp.Matrix(sp.symbols(f"{n}_1 {n}_2 {n}_3", real=True)) for n in ("x", "v", "w"))
    rotation = sp.Matrix(3, 3, sp.symbols("R_1:10", real=True))
    effort, t = sp.Symbol("effort", real=True), sp.Symbol("t", real=True)
    push, turn = (sp.Matrix(m) for m in force.wrench(x, v, rotation, w, p, effort, t))
    if push.shape != (3, 1) or turn.shape != (3, 1):
        raise ElementError(f"{where}: wrench must return two 3 x 1 matrices")
    energy = sp.sympify(force.potential(x, p))
    known = _dimensions(p, force.parameters)
    for symbols, unit in ((x, "m"), (v, "m/s"), (w, "rad/s"), (rotation, "")):
        known |= {s: dimension(unit) for s in symbols}
    known |= {effort: dimension("N"), t: dimension("s")}
    strange = (push.free_symbols | turn.free_symbols | energy.free_symbols) - set(known)
    if strange:
        raise ElementError(f"{where}: wrench contains {', '.join(sorted(map(str, strange)))}")
    _expect(where, "the force of wrench", push, "N", known)
    _expect(where, "the moment of wrench", turn, "N*m", known)
    _expect(where, "potential", sp.Matrix([energy]), "J", known)


__all__ = ["check", "check_body", "check_force", "check_hinge"]
