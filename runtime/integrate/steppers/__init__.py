"""Time-integration methods by name.

A new method is one file: a function `tableau() -> Tableau`, of an explicit Runge-Kutta method by
`Tableau` itself, of an implicit one by what `implicit` offers.  Inside the package its module name
goes into `BUILT_IN`; outside it, call `register(my_tableau())` before the run.  Nothing else
changes: the C loop reads the coefficients at run time.
"""

from __future__ import annotations

from functools import cache
from importlib import import_module

from mstmm.errors import SceneError

from .implicit import on_positions
from .tableau import Tableau, from_monomials, frozen, hermite

__all__ = [
    "AUTO",
    "AUTO_EXPLICIT",
    "BUILT_IN",
    "EXPLICIT",
    "EXPLICIT_METHODS",
    "IMPLICIT",
    "ON_POSITIONS",
    "TANGENTS",
    "WITH_RADIUS",
    "Tableau",
    "check_radius",
    "check_size",
    "check_steps",
    "check_tangent",
    "from_monomials",
    "frozen",
    "get",
    "hermite",
    "names",
    "register",
]

EXPLICIT = ("rk4", "dopri5", "dop853", "pirk13")
IMPLICIT = (
    "rodas4", "rodas4p2", "rodas5p", "ros34pw2", "rodas4pw", "esdirk436", "kvaerno5",
    "genalpha", "dttmm", "hht", "newmark", "wilson", "houbolt", "exprb32",
    "genalpha-index3", "hht-index3",
)  # fmt: skip
BUILT_IN = EXPLICIT + IMPLICIT

#: Explicit methods, as messages name those that follow what others cannot.
EXPLICIT_METHODS = f"{', '.join(EXPLICIT[:-1])} or {EXPLICIT[-1]}"

#: Methods that leave a spectral radius to infinitely fast motion, which a run may choose.
WITH_RADIUS = ("genalpha", "dttmm", "genalpha-index3")

#: Ending of methods whose steps ask closed loops for positions at their ends: those without it ask
#: for accelerations, and close the loops behind each step.
ON_POSITIONS = "-index3"

#: Tangents of the equations of motion that implicit methods may take, in the order of the C loop's
#: numbers: auto is the exact one for Rosenbrock methods, while iterations try that of laws alone.
TANGENTS = ("auto", "exact", "laws")

#: Rosenbrock methods whose order does not depend on the tangent, and methods that iterate.
WITHOUT_EXACT = ("ros34pw2", "rodas4pw")
ITERATED = (
    "esdirk436", "kvaerno5", "genalpha", "hht", "newmark", "wilson", "houbolt", "genalpha-index3",
    "hht-index3",
)  # fmt: skip

#: The name of the choice that a run makes among methods, and the one by which it begins.
AUTO, AUTO_EXPLICIT = "auto", "dop853"

_registered: dict[str, Tableau] = {}


@cache
def _built_in(name: str, radius: float | None = None) -> Tableau:
    if name.endswith(ON_POSITIONS):
        return on_positions(_built_in(name.removesuffix(ON_POSITIONS), radius), name)
    module = import_module(f".{name}", __name__)
    tableau: Tableau = module.tableau() if radius is None else module.tableau(radius)
    return tableau


def register(tableau: Tableau) -> None:
    """Makes a method known by its name.

    Raises:
        ValueError: if the name is taken.
    """
    if tableau.name in (AUTO, *names()):
        raise ValueError(f"a method named {tableau.name!r} exists already")
    _registered[tableau.name] = tableau


def names() -> tuple[str, ...]:
    """The names that `get` knows."""
    return (*BUILT_IN, *_registered)


def check_damped(name: str, radius: float | None) -> None:
    """SceneError for steps on positions that damp nothing."""
    if name != f"newmark{ON_POSITIONS}" and not (name.endswith(ON_POSITIONS) and radius == 1.0):
        return
    given = f'method "{name}"' if radius is None else f'radius = {radius:g}: method "{name}"'
    raise SceneError(
        f"{given} would damp nothing, and errors of multipliers, which on rows of positions go by "
        f"1/step^2, would grow from step to step; take genalpha{ON_POSITIONS} with a radius below "
        f"1, or {name.removesuffix(ON_POSITIONS)}, which asks for accelerations"
    )


def check_radius(name: str, radius: float | None) -> None:
    """SceneError for a spectral radius outside 0 to 1, for a method that does not take one, or for
    one that would damp nothing where it must."""
    check_damped(name, radius)
    if radius is None:
        return
    if not 0.0 <= radius <= 1.0:
        raise SceneError(f"radius = {radius:g}: expected a spectral radius from 0 to 1")
    if name not in WITH_RADIUS:
        raise SceneError(
            f'radius = {radius:g}: method "{name}" takes none; those that do are '
            + ", ".join(WITH_RADIUS)
        )


def check_size(tableau: Tableau, unknowns: int) -> None:
    """SceneError for more coordinates and speeds together than the method takes."""
    if tableau.most_unknowns and unknowns > tableau.most_unknowns:
        raise SceneError(
            f'method "{tableau.name}" takes the exponential of a matrix of all coordinates and '
            f"speeds, at most {tableau.most_unknowns}; here there are {unknowns}: take rodas5p or, "
            "for vibration that is to stay, dop853, or bend bodies by fewer shapes"
        )


def check_steps(tableau: Tableau, step: float | None) -> None:
    """SceneError for a method without an estimate of its error, and no step to take."""
    if step is not None or tableau.adaptive:
        return
    kin = "genalpha" if tableau.implicit else "dopri5"
    raise SceneError(
        f'method "{tableau.name}" takes fixed steps: give step in s, or take {kin}, which chooses '
        "its steps by their error"
    )


def check_tangent(name: str, tangent: str) -> None:
    """SceneError for a tangent that there is not, or with which a method loses what it is for."""
    if tangent not in TANGENTS:
        known = ", ".join(TANGENTS)
        raise SceneError(f'tangent = "{tangent}": expected one of {known}')
    if tangent == TANGENTS[0] or (tangent == "exact" and name in IMPLICIT):
        return
    able = (*WITHOUT_EXACT, *ITERATED)
    if name in able:
        return
    if name in IMPLICIT:
        raise SceneError(
            f'tangent = "{tangent}": {name} falls to a low order without the exact tangent (rodas4 '
            f"to the first); those that do without are {', '.join(able)}"
        )
    raise SceneError(
        f'tangent = "{tangent}": method "{name}" takes none that could be chosen; those that do '
        f"are {', '.join(IMPLICIT)}"
    )


def get(name: str, radius: float | None = None) -> Tableau:
    """The tableau of a method.

    Args:
        name: of the method.
        radius: spectral radius at infinity, 0 to 1, of a method that lets it be chosen.

    Raises:
        SceneError: if there is no such method, and names those there are; for a radius that the
            method does not take.
    """
    check_radius(name, radius)
    if name in BUILT_IN:
        return _built_in(name, radius)
    if name not in _registered:
        known = ", ".join((AUTO, *names()))
        raise SceneError(
            f'method "{name}" is not known; there are: {known}, and '
            "SciPy's as scipy-DOP853, -RK45, -RK23, -Radau, -BDF, -LSODA, SUNDIALS' as "
            "sundials-BDF, -Adams; and dttmm-classical, dttmm-classical-product"
        )
    return _registered[name]
