"""Time-integration methods by name.

A new method is one file with a function `tableau() -> Tableau`: `Tableau` itself for an explicit
Runge-Kutta method, a class of `implicit_methods` for an implicit one.  A method of Newmark's family
is a row in `alpha_family`.  Inside the package its
module name is added to `EXPLICIT` or `IMPLICIT` in `methods.py`, and to the lists of its
properties; outside it, call `register(my_tableau())` before the run.  The C loop reads the
coefficients at run time.  CONTRIBUTING.md lists the tests to extend.
"""

from __future__ import annotations

from functools import cache
from importlib import import_module

from mstmm.errors import SceneError

from ..methods import EXPLICIT, IMPLICIT, METHODS_WITH_RADIUS, TANGENTS
from .alpha_family import ALPHA_METHODS, alpha_method, with_position_constraints
from .tableau import Tableau, from_monomials, hermite, to_read_only

__all__ = [
    "AUTO", "AUTO_EXPLICIT", "BUILT_IN", "EXPLICIT", "EXPLICIT_METHODS", "IMPLICIT",
    "INDEX3_SUFFIX", "METHODS_WITH_RADIUS", "TANGENTS", "Tableau", "check_radius", "check_size",
    "check_steps", "check_tangent", "from_monomials", "get", "hermite", "names", "register",
    "to_read_only",
]  # fmt: skip

BUILT_IN = EXPLICIT + IMPLICIT

#: Explicit methods, as messages list them.
EXPLICIT_METHODS = f"{', '.join(EXPLICIT[:-1])} or {EXPLICIT[-1]}"

#: Suffix of methods that satisfy the position constraints of closed loops at the end of a step;
#: the others satisfy those of accelerations and project the state after each step.
INDEX3_SUFFIX = "-index3"

#: Rosenbrock methods whose order does not depend on the tangent, and methods that iterate.
W_METHODS = ("ros34pw2", "rodas4pw")
ITERATED_METHODS = (
    "esdirk436", "kvaerno5", "genalpha", "hht", "newmark", "wilson", "houbolt", "genalpha-index3",
    "hht-index3",
)  # fmt: skip

#: Name of the automatic choice of a method, and the method with which it starts.
AUTO, AUTO_EXPLICIT = "auto", "dop853"

_registered_methods: dict[str, Tableau] = {}


@cache
def _built_in(name: str, radius: float | None = None) -> Tableau:
    if name.endswith(INDEX3_SUFFIX):
        return with_position_constraints(_built_in(name.removesuffix(INDEX3_SUFFIX), radius), name)
    if name in ALPHA_METHODS:
        return alpha_method(name, radius)
    tableau: Tableau = import_module(f".{name}", __name__).tableau()
    return tableau


def register(tableau: Tableau) -> None:
    """Register a method under its name.

    Raises:
        ValueError: if the name exists already.
    """
    if tableau.name in (AUTO, *names()):
        raise ValueError(f"a method named {tableau.name!r} exists already")
    _registered_methods[tableau.name] = tableau


def names() -> tuple[str, ...]:
    """Names of all methods that `get` accepts."""
    return (*BUILT_IN, *_registered_methods)


def check_damped(name: str, radius: float | None) -> None:
    """Raise SceneError for methods with position constraints (index 3) and no damping."""
    if name != f"newmark{INDEX3_SUFFIX}" and not (name.endswith(INDEX3_SUFFIX) and radius == 1.0):
        return
    label = f'method "{name}"' if radius is None else f'radius = {radius:g}: method "{name}"'
    raise SceneError(
        f"{label} would have no damping, and errors of multipliers, which with position "
        "constraints are proportional to 1/step^2, would grow from step to step; use "
        f"genalpha{INDEX3_SUFFIX} with a radius below 1, or {name.removesuffix(INDEX3_SUFFIX)}, "
        "which uses constraints of accelerations"
    )


def check_radius(name: str, radius: float | None) -> None:
    """Raise SceneError for a spectral radius that a method does not permit.

    It must be from 0 to 1, the method must have one, and a method that needs damping must damp.
    """
    check_damped(name, radius)
    if radius is None:
        return
    if not 0.0 <= radius <= 1.0:
        raise SceneError(f"radius = {radius:g}: expected a spectral radius from 0 to 1")
    if name not in METHODS_WITH_RADIUS:
        raise SceneError(
            f'radius = {radius:g}: method "{name}" has no such parameter; methods with a radius '
            "are " + ", ".join(METHODS_WITH_RADIUS)
        )


def check_size(tableau: Tableau, unknowns: int) -> None:
    """Raise SceneError if coordinates and speeds together exceed the limit of the method."""
    if tableau.max_unknowns and unknowns > tableau.max_unknowns:
        raise SceneError(
            f'method "{tableau.name}" computes the exponential of a matrix of all coordinates and '
            f"speeds, at most {tableau.max_unknowns}; found {unknowns}: use rodas5p or, for "
            "undamped vibration, dop853, or fewer shapes of flexible bodies"
        )


def check_steps(tableau: Tableau, step: float | None) -> None:
    """Raise SceneError for a method without an error estimate if no step is given."""
    if step is not None or tableau.adaptive:
        return
    suggested_method = "genalpha" if tableau.implicit else "dopri5"
    raise SceneError(
        f'method "{tableau.name}" takes fixed steps: give step in s, or use {suggested_method}, '
        "which chooses its steps by their error"
    )


def check_tangent(name: str, tangent: str) -> None:
    """Raise SceneError for an unknown tangent, or one with which a method loses its order."""
    if tangent not in TANGENTS:
        tangent_names = ", ".join(TANGENTS)
        raise SceneError(f'tangent = "{tangent}": expected one of {tangent_names}')
    if tangent == TANGENTS[0] or (tangent == "exact" and name in IMPLICIT):
        return
    methods_without_exact = (*W_METHODS, *ITERATED_METHODS)
    if name in methods_without_exact:
        return
    if name in IMPLICIT:
        raise SceneError(
            f'tangent = "{tangent}": {name} has a low order without the exact tangent (rodas4 the '
            f"first); methods that do not need it are {', '.join(methods_without_exact)}"
        )
    raise SceneError(
        f'tangent = "{tangent}": method "{name}" has no tangent to choose; methods with a tangent '
        f"are {', '.join(IMPLICIT)}"
    )


def get(name: str, radius: float | None = None) -> Tableau:
    """Tableau of a method by its name.

    Args:
        name: of the method.
        radius: spectral radius at infinity, 0 to 1, of a method with this parameter.

    Raises:
        SceneError: if there is no such method (lists the existing ones), or for a radius that the
            method does not permit.
    """
    check_radius(name, radius)
    if name in BUILT_IN:
        return _built_in(name, radius)
    if name not in _registered_methods:
        known_names = ", ".join((AUTO, *names()))
        raise SceneError(
            f'method "{name}" is not known; available are: {known_names}, and '
            "SciPy's as scipy-DOP853, -RK45, -RK23, -Radau, -BDF, -LSODA, SUNDIALS' as "
            "sundials-BDF, -Adams; and dttmm-classical, dttmm-classical-product"
        )
    return _registered_methods[name]
