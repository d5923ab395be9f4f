"""Dynamic stiffness of beams and rods: closed forms in many digits, and the first terms."""

from __future__ import annotations

from typing import Any

import mpmath as mp
import numpy as np
import pytest

from mstmm.derive.classical.harmonic_stiffness import beam_stiffness, rod_stiffness
from mstmm.runtime.flexible.beam import beam_kernels

#: On both sides of where the series ends, near poles, far out, and with damping.
ZETA = [1e-9, 0.02, 4.99, 5.01, 5 + 0.3j, 500.0, 500.6, 1e3 + 100j, 628.3**4 * (1 - 0.02j), -50.0]


def beam(zeta: complex) -> Any:
    """Textbook functions of z: rows w_0, w'_0, w_l, w'_l."""
    z = mp.mpc(zeta) ** 0.25
    ch, sh, co, si = mp.cosh(z), mp.sinh(z), mp.cos(z), mp.sin(z)
    d = 1 - co * ch
    f1, f2 = z * (si * ch - co * sh) / d, z * (sh - si) / d
    f3, f4 = z**2 * si * sh / d, z**2 * (ch - co) / d
    f5, f6 = z**3 * (si * ch + co * sh) / d, z**3 * (si + sh) / d
    return mp.matrix([
        [f5, f3, -f6, f4], [f3, f1, -f4, f2], [-f6, -f4, f5, -f3], [f4, f2, -f3, f1],
    ])  # fmt: skip


def rod(zeta: complex) -> Any:
    z = mp.mpc(zeta) ** 0.5
    return mp.matrix([[z * mp.cot(z), -z / mp.sin(z)], [-z / mp.sin(z), z * mp.cot(z)]])


STATIC = {
    "harmonic_bending": [[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]],
    "harmonic_rod": [[1, -1], [-1, 1]],
}


@pytest.mark.parametrize(("name", "closed"), [("harmonic_bending", beam), ("harmonic_rod", rod)])
def test_the_kernels_in_double_precision(name: str, closed: Any) -> None:
    zeta = np.array([z for z in ZETA if closed is beam or abs(z) < 1e4], dtype=complex)
    found = beam_kernels.evaluate(name, {"zeta": np.stack([zeta.real, zeta.imag])})
    static = np.array(STATIC[name])
    upper = np.triu_indices(len(static))
    with mp.workdps(40):
        for k, z in enumerate(zeta.tolist()):
            expected = closed(z) - mp.matrix(static.tolist())
            size = max(abs(x) for x in expected)
            for entry, (i, j) in enumerate(zip(*upper, strict=True)):
                value = complex(found["D_re"][entry, k], found["D_im"][entry, k])
                # Next to a pole (500.56) the distance to it is known to rounding.
                assert abs(value - expected[i, j]) < (1e-11 if z == 500.6 else 1e-13) * size


@pytest.mark.parametrize("name", list(STATIC))
def test_the_first_term_is_the_mass_of_polynomial_shapes(name: str) -> None:
    found = beam_kernels.evaluate(name, {"zeta": np.array([[1e-20], [0.0]])})["D_re"][:, 0] / -1e-20
    cubic = np.array([[156, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4]])
    mass = cubic / 420 if name == "harmonic_bending" else np.array([[2, 1], [1, 2]]) / 6
    np.testing.assert_allclose(found, mass[np.triu_indices(len(mass))], rtol=1e-14)


def test_both_are_symmetric_for_every_z() -> None:
    for matrix, _ in (beam_stiffness(), rod_stiffness()):
        assert (matrix - matrix.T).is_zero_matrix
