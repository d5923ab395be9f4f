"""CVODE of SUNDIALS with the interface of SciPy's solvers (extra `stiff`: scikit-sundae).

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

#: Smallest step in units of the spacing of doubles at t.
_MIN_STEP_SPACINGS = 4.0


def require_package(method: str) -> None:
    """Raise EnvironmentFailure, naming the extra, if the package is not installed."""
    try:
        import sksundae.cvode  # noqa: F401
    except ImportError as error:
        raise missing_package_error("stiff", f'method "{method}"', error) from None


class Cvode:
    """Solver from t to `stop` (s): call `step`, then use `t_old`, `t`, `y` and `dense_output`."""

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

        def fill_rates(t: float, y: Array, out: Array) -> None:
            out[:] = rates(t, y)

        def fill_jacobian(t: float, y: Array, _: Array, out: Array) -> None:
            out[:] = jacobian(t, y)

        min_step = _MIN_STEP_SPACINGS * float(np.spacing(max(abs(t), abs(stop))))
        self._solver = CVODE(
            fill_rates, method=METHODS[method], jacfn=fill_jacobian, min_step=min_step,
            max_step=max(min_step, min(max_step, stop - t)), **options,
        )  # fmt: skip
        self._solver.init_step(t, y)
        self.status, self.stop = "running", stop
        self.t, self.t_old, self.y = t, t, np.array(y)

    def step(self) -> str | None:
        """Make one step of CVODE's choice; returns a sentence if it fails."""
        self.t_old = self.t
        while self.t == self.t_old:  # after `dense_output` CVODE first returns to its last time
            result = self._solver.step(self.stop, "onestep", self.stop)
            if not result.success:
                self.status = "failed"
                return str(result.message)
            self.t = float(np.ravel(result.t)[-1])
        self.y = np.array(result.y, dtype=np.float64).reshape(-1)
        if self.t >= self.stop:
            self.status = "finished"
        return None

    def dense_output(self) -> Callable[[float], Array]:
        """Function of time (s) that returns the state within the last step, by dense output."""

        def state(t: float) -> Array:
            return np.array(self._solver.step(t, "normal").y, dtype=np.float64).reshape(-1)

        return state
