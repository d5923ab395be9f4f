"""Methods of a chart: which there are, to which family they belong, and their settings."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from mstmm.errors import SceneError
from mstmm.scene.validators.validation_messages import did_you_mean

from ..integrate.steppers import AUTO, INDEX3_SUFFIX, get, names
from ..integrate.steppers.implicit_methods import ALPHA, DIRK, EXPONENTIAL, ROSENBROCK
from ..run import classical_run, external_integrators
from ..run.external_integrators import sundials
from .chart_points import Setting

#: Relative tolerances, loose to tight.
TOLERANCES = tuple(10.0**-k for k in range(2, 13))
#: Fixed steps in parts of the run, long to short: two to a decade.
STEPS = tuple(1.0 / round(10 ** (k / 2)) for k in range(3, 13))

#: Methods that are the cheapest for many scenes: they are tried before time is short.
PROMISING = ("dop853", "rodas4p2", "rodas5p", "genalpha", "dopri5", AUTO)

#: Families in the order of legends.
FAMILIES = (
    "choice", "explicit", "Rosenbrock", "diagonally implicit", "Newmark's", "exponential",
    "classical", "SciPy", "SUNDIALS",
)  # fmt: skip
_KINDS = {ROSENBROCK: 2, DIRK: 3, ALPHA: 4, EXPONENTIAL: 5}


def every_method() -> tuple[str, ...]:
    """All that `simulate` knows: own ones, the choice among them, the classical ones, others'."""
    return (*names(), AUTO, *classical_run.METHODS, *external_integrators.METHODS)


def checked_methods(methods: Sequence[str] | None) -> tuple[str, ...]:
    """These methods, once each, or all for None.

    SceneError for none at all, and, with the nearest name, for an unknown one.
    """
    known = every_method()
    if methods is None:
        return known
    for name in methods:
        if name not in known:
            raise SceneError(f"method {name!r} is not known{did_you_mean(str(name), known)}")
    if not len(methods):
        raise SceneError("methods = []: expected one name or more; leave it out for all methods")
    return tuple(dict.fromkeys(methods))


def without_twins(methods: Sequence[str]) -> tuple[str, ...]:
    """For trees: without the methods on positions whose plain ones are there, which do the same."""
    return tuple(
        name
        for name in methods
        if not name.endswith(INDEX3_SUFFIX) or name.removesuffix(INDEX3_SUFFIX) not in methods
    )


def family(method: str) -> str:
    """One of FAMILIES."""
    if method == AUTO:
        return FAMILIES[0]
    if method in classical_run.METHODS:
        return FAMILIES[6]
    if method in sundials.METHODS:
        return FAMILIES[8]
    if method in external_integrators.METHODS:
        return FAMILIES[7]
    return FAMILIES[_KINDS.get(getattr(get(method), "kind", 0), 1)]


def takes_fixed_steps(method: str) -> bool:
    """Whether it can make fixed steps only."""
    if method == AUTO or method in external_integrators.METHODS:
        return False
    return method in classical_run.METHODS or not get(method).adaptive


def settings(method: str, model: str, t_end: float) -> Iterator[Setting]:
    """Its settings from cheap to accurate."""
    if takes_fixed_steps(method):
        yield from (Setting(method, model, part * t_end, fixed=True) for part in STEPS)
    else:
        yield from (Setting(method, model, tolerance) for tolerance in TOLERANCES)
