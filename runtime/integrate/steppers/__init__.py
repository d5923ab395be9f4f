"""Time-integration methods by name.

A new explicit Runge-Kutta method is one file: a function `tableau() -> Tableau`.  Inside the
package its module name goes into `BUILT_IN`; outside it, call `register(my_tableau())` before the
run.  Nothing else changes: the C loop reads the coefficients at run time.
"""

from __future__ import annotations

from functools import cache
from importlib import import_module

from mstmm.errors import SceneError

from .tableau import Tableau, from_monomials, frozen, hermite

__all__ = [
    "BUILT_IN",
    "Tableau",
    "from_monomials",
    "frozen",
    "get",
    "hermite",
    "names",
    "register",
]

BUILT_IN = ("rk4", "dopri5", "dop853", "pirk13")

_registered: dict[str, Tableau] = {}


@cache
def _built_in(name: str) -> Tableau:
    module = import_module(f".{name}", __name__)
    tableau: Tableau = module.tableau()
    return tableau


def register(tableau: Tableau) -> None:
    """Makes a method known by its name.

    Raises:
        ValueError: if the name is taken.
    """
    if tableau.name in names():
        raise ValueError(f"a method named {tableau.name!r} exists already")
    _registered[tableau.name] = tableau


def names() -> tuple[str, ...]:
    """The names that `get` knows."""
    return (*BUILT_IN, *_registered)


def get(name: str) -> Tableau:
    """The tableau of a method.

    Raises:
        SceneError: if there is no such method; names those there are.
    """
    if name in BUILT_IN:
        return _built_in(name)
    if name not in _registered:
        raise SceneError(
            f"method {name!r} is not known; there are: {', '.join(names())}, and SciPy's as "
            "scipy-RK45, scipy-DOP853, scipy-Radau, scipy-BDF, scipy-LSODA, and SUNDIALS' as "
            "sundials-BDF, sundials-Adams"
        )
    return _registered[name]
