"""Methods of a chart: names, families, and settings from cheap to accurate."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from mstmm.errors import SceneError
from mstmm.scene.validators.validation_messages import did_you_mean

from ..integrate.steppers import AUTO, INDEX3_SUFFIX, get, names
from ..integrate.steppers.implicit_methods import ALPHA, DIRK, EXPONENTIAL, ROSENBROCK
from ..run import classical_run, external_integrators, sundials
from .trial import Setting

#: Relative tolerances from loose to tight.
TOLERANCES = tuple(10.0**-k for k in range(2, 13))
#: Fixed steps as fractions of the run from long to short, two per decade.
STEPS = tuple(1.0 / round(10 ** (k / 2)) for k in range(3, 13))

#: Methods that are the cheapest for many scenes; they run first, while there is time.
PROMISING = ("dop853", "rodas4p2", "rodas5p", "genalpha", "dopri5", AUTO)

#: Families of methods in the order of the legend.
FAMILIES = (
    "choice", "explicit", "Rosenbrock", "diagonally implicit", "Newmark's", "exponential",
    "classical", "SciPy", "SUNDIALS",
)  # fmt: skip
_KINDS = {ROSENBROCK: 2, DIRK: 3, ALPHA: 4, EXPONENTIAL: 5}


def all_methods() -> tuple[str, ...]:
    """Every method of `simulate`: built-in, "auto", classical, and of SciPy and SUNDIALS."""
    return (*names(), AUTO, *classical_run.METHODS, *external_integrators.METHODS)


def require_methods(methods: Sequence[str] | None) -> tuple[str, ...]:
    """Validate names of methods and drop repeated ones; None means all methods.

    Raises SceneError for an empty list, and, with the nearest name, for an unknown method.
    """
    valid = all_methods()
    if methods is None:
        return valid
    for name in methods:
        if name not in valid:
            raise SceneError(f"methods: unknown method {name!r}{did_you_mean(str(name), valid)}")
    if not len(methods):
        raise SceneError("methods = []: expected one or more names; omit it for all methods")
    return tuple(dict.fromkeys(methods))


def without_index3_duplicates(methods: Sequence[str]) -> tuple[str, ...]:
    """Methods for scenes without loops, where an index-3 method repeats its plain counterpart."""
    return tuple(
        name
        for name in methods
        if not name.endswith(INDEX3_SUFFIX) or name.removesuffix(INDEX3_SUFFIX) not in methods
    )


def family(method: str) -> str:
    """Family of a method, one of FAMILIES."""
    if method == AUTO:
        return FAMILIES[0]
    if method in classical_run.METHODS:
        return FAMILIES[6]
    if method in sundials.METHODS:
        return FAMILIES[8]
    if method in external_integrators.METHODS:
        return FAMILIES[7]
    return FAMILIES[_KINDS.get(getattr(get(method), "kind", 0), 1)]


def has_fixed_steps_only(method: str) -> bool:
    """Whether a method has no step size control."""
    if method == AUTO or method in external_integrators.METHODS:
        return False
    return method in classical_run.METHODS or not get(method).adaptive


def settings(method: str, model: str, t_end: float) -> Iterator[Setting]:
    """Settings of a method from cheap to accurate."""
    if has_fixed_steps_only(method):
        yield from (Setting(method, model, fraction * t_end, fixed=True) for fraction in STEPS)
    else:
        yield from (Setting(method, model, tolerance) for tolerance in TOLERANCES)
