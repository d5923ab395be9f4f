"""Checks of a definition before generation; each rejection names the equation.

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
from mstmm.ir.element_spec import Param
from mstmm.ir.hinge_properties import FRAMES

from ..catalogue.registry import Element, builtin_elements, kind_of
from ..definition import derivation as stated
from ..definition.element import Body, ForceElement, Hinge, Symbols, rotation_about
from ..definition.nonsmooth_functions import slope
from ..equations.hinge import HingeMotion, motion_of, speeds_of
from .branch_continuity import refuse_jumps
from .dimensional_analysis import Dimension, UnitMismatch, dimension, dimension_of, dimension_text
from .equation_evaluation import Undefined, evaluate_matrix

_DIGITS = 40
_POINT_COUNT = 5
_TOLERANCE = mpmath.mpf(10) ** -25
Numbers = dict[sp.Basic, float]


def check_element(element: Element) -> None:
    """Run all checks of an element.  Raises ElementError that names element and equation."""
    _check_names(element)
    if isinstance(element, Hinge):
        check_hinge(element)
    elif isinstance(element, Body):
        check_body(element)
    else:
        check_force(element)


def _check_methods(where: str, element: Element) -> None:
    """Reject a method that resembles a base class method, because it would never be called."""
    base = next(kind for kind in (Hinge, Body, ForceElement) if isinstance(element, kind))
    method_names = [name for name in dir(base) if not name.startswith("_")]
    for name, value in vars(type(element)).items():
        if name.startswith("_") or name in method_names or not callable(value):
            continue
        similar_names = difflib.get_close_matches(name, method_names, 1, 0.75)
        if similar_names:
            raise ElementError(
                f"{where}: {name} is not a method of a {kind_of(element)}; did you mean "
                f"{similar_names[0]}? (begin the names of your own methods with _)"
            )


#: Maximum length of an element name, which becomes part of file names.
_MAX_NAME_LENGTH = 60


def _check_names(element: Element) -> None:
    name = element.name
    if not name.isidentifier() or not name.isascii() or len(name) > _MAX_NAME_LENGTH:
        raise ElementError(
            f"{name!r:.80} is not a name: at most {_MAX_NAME_LENGTH} letters, digits and "
            "underscores, starting with a letter"
        )
    location = f"{kind_of(element)} {name}"
    for built_in in builtin_elements():
        is_same_name = (kind_of(built_in), built_in.name) == (kind_of(element), name)
        if is_same_name and type(built_in) is not type(element):
            raise ElementError(f"{location}: this name is built in; choose another name")
    _check_methods(location, element)
    groups = {"parameters": element.parameters}
    if isinstance(element, Hinge):
        groups["coordinates"] = element.coordinates
        if element.speeds is not None:
            groups["speeds"] = element.speeds
    for group_name, group in groups.items():
        _check_parameter_group(f"{location}: {group_name}", group)


def _check_parameter_group(where: str, group: object) -> None:
    """Check that a group is a tuple of Param with names, known units and ordered bounds."""
    if not isinstance(group, (tuple, list)) or not all(isinstance(p, Param) for p in group):
        raise ElementError(
            f'{where}: expected a tuple such as (Param("radius", "m"),), found {group!r:.80}'
        )
    names: set[str] = set()
    for p in group:
        if not isinstance(p.name, str) or not p.name.isidentifier() or not p.name.isascii():
            raise ElementError(
                f"{where}: {p.name!r:.80} is not a name: letters, digits and underscores"
            )
        if p.name in names:
            raise ElementError(f"{where}: {p.name!r} is declared twice")
        names.add(p.name)
        if not isinstance(p.unit, str):
            raise ElementError(f'{where}: unit of {p.name}: expected text such as "m", "N*m/rad"')
        try:
            dimension(p.unit)
        except ElementError as error:
            raise ElementError(f"{where}: {p.name}: {error}") from None
        _check_bounds(f"{where}: {p.name}", p)


def _check_bounds(where: str, p: Param) -> None:
    for bound_name in ("default", "minimum", "maximum"):
        value = getattr(p, bound_name)
        number = isinstance(value, (int, float)) and not isinstance(value, bool)
        if value is not None and not (number and math.isfinite(value)):
            raise ElementError(f"{where}: {bound_name}: expected a number, found {value!r:.40}")
    bounds = [v for v in (p.minimum, p.default, p.maximum) if v is not None]
    if bounds != sorted(bounds):
        raise ElementError(f"{where}: expected minimum <= default <= maximum, found {bounds}")


# --- hinges -----------------------------------------------------------------------------------


def check_hinge(hinge: Hinge) -> HingeMotion:
    """Check rotation, rank, stated H and bias, and units; return the derived motion."""
    location = f"hinge {hinge.name}"
    if len(speeds_of(hinge)) > 6:
        raise ElementError(f"{location}: {len(speeds_of(hinge))} speeds; a hinge has at most six")
    _check_frame(location, hinge)
    motion = motion_of(hinge)
    _check_symbols(location, motion)
    _check_units(location, motion)
    q, u, p = motion.q, motion.u, motion.p
    stated_matrices = (
        ("motion_subspace(q, p)",
         stated.optional(location, "motion_subspace(q, p)", hinge.motion_subspace, q, p),
         motion.subspace),
        ("bias_acceleration(q, u, p)",
         stated.optional(location, "bias_acceleration(q, u, p)", hinge.bias_acceleration, q, u, p),
         motion.bias),
    )  # fmt: skip
    points = list(_sample_points(motion))
    refuse_jumps(
        location,
        {"position(q, p)": motion.position, "rotation(q, p)": motion.rotation,
         "the velocity that follows from position and rotation": motion.subspace},
        {s: _sample_range(c) for s, c in zip(motion.q, hinge.coordinates, strict=True)},
        points[:2],
        "a jump of the velocity is an impulse; define branches with equal values and slopes there",
    )  # fmt: skip
    for point in points:
        _check_rotation(location, motion, point)
        _numeric_matrix(f"{location}: position(q, p)", motion.position, point)
        _check_rank(location, motion, point)
        for label, matrix, derived in stated_matrices:
            _check_agreement(location, label, matrix, derived, point)
    return motion


#: Keys of a hinge table that a definition may read, and those that each frame requires.
_ALLOWED_KEYS = ("axis", "axis2", "lead")
_REQUIRED_KEYS = {"crossing": ("axis", "axis2"), "plane": ("axis", "axis2")}


def _check_frame(where: str, hinge: Hinge) -> None:
    """Check `frame` and `scene_keys`, which define how a scene places the hinge."""
    if hinge.frame_rule not in FRAMES:
        frame_names = ", ".join(f'"{frame}"' for frame in FRAMES)
        raise ElementError(
            f"{where}: frame_rule: expected one of {frame_names}, found {hinge.frame_rule!r:.40}"
        )
    if not isinstance(hinge.scene_keys, tuple) or not set(hinge.scene_keys) <= set(_ALLOWED_KEYS):
        raise ElementError(
            f"{where}: scene_keys: expected a tuple of {', '.join(_ALLOWED_KEYS)}, found "
            f"{hinge.scene_keys!r:.60}"
        )
    missing_keys = [
        key for key in _REQUIRED_KEYS.get(hinge.frame_rule, ()) if key not in hinge.scene_keys
    ]
    if missing_keys:
        raise ElementError(
            f'{where}: frame_rule "{hinge.frame_rule}" needs {missing_keys[0]} among the scene_keys'
        )
    names = [parameter.name for parameter in hinge.parameters]
    if "lead" in hinge.scene_keys and "lead" not in names:
        raise ElementError(f"{where}: scene_keys: lead is not a declared parameter; declare it")
    if hinge.frame_rule == "crossing" and not names:
        raise ElementError(
            f'{where}: frame "crossing": its first parameter is the angle between the axes in rad; '
            "declare it"
        )


def _sample_points(motion: HingeMotion) -> Iterable[Numbers]:
    """Random values of q, u, p; quaternions need no unit norm, since rotations are normalised."""
    numbers = random.Random(20260)
    for _ in range(_POINT_COUNT):
        point: Numbers = {}
        for symbols, parameters in (
            (motion.q, motion.hinge.coordinates),
            (motion.u, speeds_of(motion.hinge)),
            (motion.p, motion.hinge.parameters),
        ):
            for symbol, parameter in zip(symbols, parameters, strict=True):
                point[symbol] = _draw_value(parameter, numbers)
        yield point


def _draw_value(parameter: Param, numbers: random.Random) -> float:
    low, high = parameter.minimum, parameter.maximum
    if low is None:
        low = -1.0 if high is None else high - 2.0
    if high is None:
        high = max(1.0, low + 2.0)
    return numbers.uniform(low, high)


def _sample_range(parameter: Param) -> tuple[float, float]:
    """Sample interval of a coordinate: its bounds, or one turn about zero."""
    low = -3.5 if parameter.minimum is None else parameter.minimum
    return low, max(3.5, low + 7.0) if parameter.maximum is None else parameter.maximum


def _numeric_matrix(where: str, matrix: sp.Matrix, point: Numbers) -> mpmath.matrix:
    if 0 in matrix.shape:
        return mpmath.matrix(matrix.rows, 0)
    try:
        return mpmath.matrix(evaluate_matrix(matrix, point, _DIGITS))
    except Undefined as undefined:
        raise ElementError(f"{where}: {undefined}, at {_point_text(point)}") from None


def _point_text(point: Numbers) -> str:
    return ", ".join(f"{name} = {float(value):.3g}" for name, value in point.items())


def _check_symbols(where: str, motion: HingeMotion) -> None:
    symbols = {*motion.q, *motion.p}
    for label, matrix, names in (
        ("rotation(q, p)", motion.rotation, symbols),
        ("position(q, p)", motion.position, symbols),
        ("coordinate_rates(q, u, p)", motion.rates, symbols | {*motion.u}),
    ):
        _reject_unknown_symbols(where, label, matrix, names)
    for speed in motion.u:
        if motion.rates.diff(speed).free_symbols & set(motion.u):
            raise ElementError(
                f"{where}: coordinate_rates(q, u, p) must be linear in u: qdot = N(q) u"
            )
    if any(motion.rates.xreplace(dict.fromkeys(motion.u, sp.Integer(0)))):
        raise ElementError(f"{where}: coordinate_rates(q, u, p) must vanish with u: qdot = N(q) u")


def _reject_unknown_symbols(
    where: str, label: str, matrix: sp.Basic, allowed: set[sp.Symbol]
) -> None:
    unknown_symbols = sorted(map(str, matrix.free_symbols - allowed))
    if unknown_symbols:
        arguments = label[label.find("(") + 1 : -1] if label.endswith(")") else "its arguments"
        raise ElementError(
            f"{where}: {label} contains {', '.join(unknown_symbols)}; expected only {arguments}"
        )


def _check_rotation(where: str, motion: HingeMotion, point: Numbers) -> None:
    with mpmath.workdps(_DIGITS):
        r = _numeric_matrix(f"{where}: rotation(q, p)", motion.rotation, point)
        defect = mpmath.mnorm(r.T * r - mpmath.eye(3), "f")
        if defect > _TOLERANCE or mpmath.det(r) < 0:
            raise ElementError(
                f"{where}: rotation(q, p) is not a rotation: "
                f"|R^T R - I| = {mpmath.nstr(defect, 3)}, det R = {mpmath.nstr(mpmath.det(r), 5)} "
                "at " + ", ".join(f"{k} = {float(v):.3g}" for k, v in point.items())
            )


def _check_rank(where: str, motion: HingeMotion, point: Numbers) -> None:
    if motion.nu == 0:
        return
    with mpmath.workdps(_DIGITS):
        singular = mpmath.svd_r(
            _numeric_matrix(f"{where}: motion subspace H", motion.subspace, point), compute_uv=False
        )
        rank = sum(1 for s in singular if s > singular[0] * mpmath.mpf(10) ** -12)
        if rank < motion.nu:
            raise ElementError(
                f"{where}: the {motion.nu} speeds give only {rank} independent "
                "motions (the motion subspace H loses rank); remove a coordinate, or let rotation "
                "and position depend on every one of them"
            )


def _check_agreement(
    where: str, label: str, stated_matrix: sp.Matrix | None, derived: sp.Matrix, point: Numbers
) -> None:
    if stated_matrix is None:
        return
    if stated_matrix.shape != derived.shape:
        raise ElementError(
            f"{where}: {label} is {stated_matrix.rows} x {stated_matrix.cols}, "
            f"expected {derived.rows} x {derived.cols}"
        )
    with mpmath.workdps(_DIGITS):
        difference = _numeric_matrix(f"{where}: {label}", stated_matrix, point) - _numeric_matrix(
            where, derived, point
        )
        for i in range(difference.rows):
            for j in range(difference.cols):
                if abs(difference[i, j]) > _TOLERANCE:
                    raise ElementError(
                        f"{where}: {label} disagrees with rotation and position in entry "
                        f"({i + 1}, {j + 1}): stated {stated_matrix[i, j]}, derived {derived[i, j]}"
                    )


def _check_units(where: str, motion: HingeMotion) -> None:
    dimensions = _dimensions(motion.q, motion.hinge.coordinates)
    dimensions |= _dimensions(motion.p, motion.hinge.parameters)
    _check_dimension(where, "rotation(q, p)", motion.rotation, "", dimensions)
    _check_dimension(where, "position(q, p)", motion.position, "m", dimensions)
    dimensions |= _dimensions(motion.u, speeds_of(motion.hinge))
    for rate, coordinate in zip(motion.rates, motion.hinge.coordinates, strict=True):
        unit = f"{coordinate.unit or '1'}/s"
        _check_dimension(
            where,
            f"coordinate_rates(q, u, p), rate of {coordinate.name}",
            sp.Matrix([rate]),
            unit,
            dimensions,
        )


def _dimensions(symbols: Symbols, declared: tuple[Param, ...]) -> dict[sp.Basic, Dimension]:
    return {s: dimension(p.unit) for s, p in zip(symbols, declared, strict=True)}


def _check_dimension(
    where: str, label: str, matrix: sp.Matrix, unit: str, dimensions: dict[sp.Basic, Dimension]
) -> None:
    expected_dimension = dimension(unit)
    for i in range(matrix.rows):
        for j in range(matrix.cols):
            entry = f"entry ({i + 1}, {j + 1}) of {label}" if matrix.shape != (1, 1) else label
            try:
                found_dimension = dimension_of(matrix[i, j], dimensions)
            except UnitMismatch as misfit:
                raise ElementError(f"{where}: {entry}: units do not fit: {misfit}") from None
            if found_dimension is not None and found_dimension != expected_dimension:
                raise ElementError(
                    f"{where}: {entry} = {matrix[i, j]}: expected {unit or 'a pure number'}, "
                    f"found {dimension_text(found_dimension)}"
                )


# --- bodies and force elements ------------------------------------------------------------------


def check_body(body: Body) -> None:
    """Check that the residual is linear, agrees with the kinetic energy, and has correct units."""
    location = f"body {body.name}"
    p = Symbols("p", tuple(x.name for x in body.parameters))
    a, alpha, w, v = (
        sp.Matrix(sp.symbols(f"{n}_x {n}_y {n}_z", real=True)) for n in ("a", "alpha", "w", "v")
    )
    forces, energies = "residual(a, alpha, w, p)", "kinetic_energy(v, w, p)"
    residual = stated.matrix(location, forces, body.residual, (6, 1), a, alpha, w, p)
    _reject_unknown_symbols(location, forces, residual, {*a, *alpha, *w, *p})
    mass = _jacobian(residual, sp.Matrix.vstack(a, alpha))
    if mass.applyfunc(sp.expand).free_symbols & {*a, *alpha}:
        raise ElementError(f"{location}: {forces} is not linear in a and alpha")
    energy = stated.scalar(location, energies, body.kinetic_energy, v, w, p)
    _reject_unknown_symbols(location, energies, energy, {*v, *w, *p})
    speeds = sp.Matrix.vstack(v, w)
    from_energy = _jacobian(_jacobian(sp.Matrix([energy]), speeds).T, speeds)
    rate = _energy_rate(residual, energy, (a, alpha, v, w))
    numbers = random.Random(20261)
    for _ in range(_POINT_COUNT):
        point: Numbers = {s: numbers.uniform(-1, 1) for s in (*a, *alpha, *w, *v)}
        point |= {s: _draw_value(x, numbers) for s, x in zip(p, body.parameters, strict=True)}
        masses = _numeric_matrix(f"{location}: {forces}", mass, point)
        if not _are_equal(_numeric_matrix(f"{location}: {energies}", from_energy, point), masses):
            raise ElementError(f"{location}: {energies} and {forces} state different masses")
        power = _numeric_matrix(f"{location}: {forces}", rate, point)
        if not _are_equal(power[:1, :], power[1:, :]):
            raise ElementError(f"{location}: the power of {forces} is not the rate of {energies}")
    _check_body_units(location, body, (residual, energy), p, (a, alpha, w, v))


def _jacobian(matrix: sp.Matrix, symbols: sp.Matrix) -> sp.Matrix:
    """Jacobian of a column, one column per symbol."""
    return sp.Matrix.hstack(*(sp.Matrix(slope(matrix, s)) for s in symbols))


def _are_equal(a: mpmath.matrix, b: mpmath.matrix) -> bool:
    with mpmath.workdps(_DIGITS):
        size = 1 + max(abs(x) for x in (*a, *b))
        return all(abs(x - y) <= _TOLERANCE * size for x, y in zip(a, b, strict=True))


def _energy_rate(residual: sp.Matrix, energy: sp.Expr, names: tuple[sp.Matrix, ...]) -> sp.Matrix:
    """[dT/dt; power of the residual] (classical acceleration a, velocity in body axes)."""
    a, alpha, v, w = names
    v_rate = a - w.cross(v)
    rate = sum(slope(energy, s) * r for s, r in zip((*v, *w), (*v_rate, *alpha), strict=True))
    power = residual[:3, :].dot(v) + residual[3:, :].dot(w)
    return sp.Matrix([rate, power])


def _check_body_units(
    where: str,
    body: Body,
    methods: tuple[sp.Matrix, sp.Expr],
    p: Symbols,
    names: tuple[sp.Matrix, ...],
) -> None:
    dimensions = _dimensions(p, body.parameters)
    for symbols, unit in zip(names, ("m/s2", "rad/s2", "rad/s", "m/s"), strict=True):
        dimensions |= {s: dimension(unit) for s in symbols}
    residual, energy = methods
    _check_dimension(where, "the force of residual", sp.expand(residual[:3, :]), "N", dimensions)
    _check_dimension(where, "the moment of residual", sp.expand(residual[3:, :]), "N*m", dimensions)
    _check_dimension(where, "kinetic_energy", sp.Matrix([energy]), "J", dimensions)


def check_force(force: ForceElement) -> None:
    """Check units (wrench N and N*m, potential J), arguments and continuity of the potential."""
    location = f"force {force.name}"
    p = Symbols("p", tuple(x.name for x in force.parameters))
    x, v, w = (sp.Matrix(sp.symbols(f"{n}_1 {n}_2 {n}_3", real=True)) for n in ("x", "v", "w"))
    rotation = sp.Matrix(3, 3, sp.symbols("R_1:10", real=True))
    effort, t = sp.Symbol("effort", real=True), sp.Symbol("t", real=True)
    label = "wrench(x, v, rotation, w, p, effort, t)"
    push, turn = stated.pair(location, label, force.wrench, x, v, rotation, w, p, effort, t)
    energy = _potential(location, force, x, rotation, p)
    dimensions = _dimensions(p, force.parameters)
    for symbols, unit in ((x, "m"), (v, "m/s"), (w, "rad/s"), (rotation, "")):
        dimensions |= {s: dimension(unit) for s in symbols}
    dimensions |= {effort: dimension("N"), t: dimension("s")}
    _reject_unknown_symbols(location, label, sp.Matrix.vstack(push, turn), set(dimensions))
    numbers, angle = random.Random(20262), sp.Symbol("angle", real=True)
    points = [{s: numbers.uniform(-1, 1) for s in (*x, angle)} for _ in range(2)]
    for point in points:
        point |= {
            s: _draw_value(parameter, numbers)
            for s, parameter in zip(p, force.parameters, strict=True)
        }
    refuse_jumps(
        location,
        {"potential(x, p)": sp.Matrix([energy.xreplace(_rotation_entries(rotation, angle))])},
        dict.fromkeys((*x, angle), (-2.0, 2.0)),
        points,
        "a jump of the potential creates energy; define branches with equal values there",
    )
    _check_dimension(location, "the force of wrench", push, "N", dimensions)
    _check_dimension(location, "the moment of wrench", turn, "N*m", dimensions)
    _check_dimension(location, "potential", sp.Matrix([energy]), "J", dimensions)


def _potential(
    where: str, force: ForceElement, x: sp.Matrix, rotation: sp.Matrix, p: Symbols
) -> sp.Expr:
    """Potential as a function of x and, if a deflection is stated, of the rotation."""
    label = "deflection(x, rotation, p)"
    deflection = stated.optional(where, label, force.deflection, x, rotation, p)
    if deflection is None:
        energy = stated.scalar(where, "potential(x, p)", force.potential, x, p)
        _reject_unknown_symbols(where, "potential(x, p)", energy, {*x, *p})
        return energy
    if deflection.cols != 1:
        raise ElementError(
            f"{where}: {label} must be n x 1, found {deflection.rows} x {deflection.cols}"
        )
    energy = stated.scalar(where, "potential(deflection, p)", force.potential, deflection, p)
    _reject_unknown_symbols(where, "potential(deflection, p)", energy, {*x, *rotation, *p})
    return energy


def _rotation_entries(rotation: sp.Matrix, angle: sp.Symbol) -> dict[sp.Symbol, sp.Expr]:
    """Entries of a rotation by `angle` about an axis other than a coordinate axis."""
    axis = (sp.Rational(3, 13), sp.Rational(4, 13), sp.Rational(12, 13))
    return dict(zip(rotation, rotation_about(axis, angle), strict=True))


__all__ = ["check_body", "check_element", "check_force", "check_hinge"]
