"""CVODE of SUNDIALS, stepped as SciPy's solvers are (extra `stiff`: scikit-sundae).

Variable-order Adams and BDF methods with Newton's method on the exact Jacobian.  Hindmarsh, Brown,
Grant, Lee, Serban, Shumaker, Woodward, ACM Trans. Math. Softw. 31 (2005) 363-396.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from mstmm.array_validation import Array
from mstmm.optional_packages import missing_package_error

#: Method of `simulate` -> CVODE's name for it.
METHODS = {f"sundials-{name}": name for name in ("BDF", "Adams")}

#: Least step, in spacings of the numbers that times are: below that nothing moves any more.
_LEAST = 4.0


def refuse_without(method: str) -> None:
    """EnvironmentFailure naming the extra if the package is not installed."""
    try:
        import sksundae.cvode  # noqa: F401
    except ImportError as error:
        raise missing_package_error("stiff", f'method "{method}"', error) from None


class Cvode:
    """One stretch from t to `stop`: `step`, then `t_old`, `t`, `y` and `dense_output`."""

    def __init__(
        self,
        method: str,
        rates: Callable[[float, Array], Array],
        jacobian: Callable[[float, Array], Array],
        t: float,
        y: Array,
        stop: float,
        max_step: float,
        **options: Any,
    ) -> None:
        from sksundae.cvode import CVODE

        def fill_rates(t: float, y: Array, found: Array) -> None:
            found[:] = rates(t, y)

        def fill_jacobian(t: float, y: Array, _: Array, found: Array) -> None:
            found[:] = jacobian(t, y)

        least = _LEAST * float(np.spacing(max(abs(t), abs(stop))))
        self._solver = CVODE(
            fill_rates, method=METHODS[method], jacfn=fill_jacobian, min_step=least,
            max_step=max(least, min(max_step, stop - t)), **options,
        )  # fmt: skip
        self._solver.init_step(t, y)
        self.status, self.stop = "running", stop
        self.t, self.t_old, self.y = t, t, np.array(y)

    def step(self) -> str | None:
        """One step of CVODE's own choice; a sentence where it fails."""
        self.t_old = self.t
        while self.t == self.t_old:  # behind `dense_output` it first comes back to where it was
            found = self._solver.step(self.stop, "onestep", self.stop)
            if not found.success:
                self.status = "failed"
                return str(found.message)
            self.t = float(np.ravel(found.t)[-1])
        self.y = np.array(found.y, dtype=np.float64).reshape(-1)
        if self.t >= self.stop:
            self.status = "finished"
        return None

    def dense_output(self) -> Callable[[float], Array]:
        """States within the last step, by the method's own polynomial."""

        def at(t: float) -> Array:
            return np.array(self._solver.step(t, "normal").y, dtype=np.float64).reshape(-1)

        return at
