"""The 8(5,3) method of Dormand, Prince, Hairer and Wanner with its dense output of order 7.

E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd ed., Springer
1993, section II.5 (coefficients) and II.6 (dense output).  The coefficients are SciPy's.
"""

from __future__ import annotations

from scipy.integrate import DOP853

from .tableau import Tableau, frozen, hermite


def tableau() -> Tableau:
    """The method `dop853`."""
    return Tableau(
        name="dop853",
        order=DOP853.order,
        A=frozen(DOP853.A),
        B=frozen(DOP853.B),
        C=frozen(DOP853.C),
        dense=hermite(DOP853.B, n_extra=len(DOP853.C_EXTRA), D=DOP853.D),
        dense_order=7,
        E=frozen(DOP853.E5),
        error_order=DOP853.error_estimator_order,
        E_low=frozen(DOP853.E3),
        A_extra=frozen(DOP853.A_EXTRA),
        C_extra=frozen(DOP853.C_EXTRA),
        source="Hairer, Norsett and Wanner (1993), section II.5, as in SciPy",
    )
