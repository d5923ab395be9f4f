"""Mass and stiffness of exact beams: closed forms, and the second-order beam to first order."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

from mstmm.errors import SceneError
from mstmm.runtime.flexible.modal_body import ModalBody
from tests.support.flexible.vibrations import Array, frequencies, ground_hinge_equations
from tests.support.scenes.single_beam import FREE, HELD, PIN, body_of

EXACT: dict[str, Any] = {"kinematics": "exact"}
#: Without rotary inertia, which bending of an exact beam turns.
THIN: dict[str, Any] = {"polar_inertia_per_length": 1e-12, **EXACT}
ROD: dict[str, Any] = {
    "torsional_stiffness": 0.6, "polar_inertia_per_length": 0.02, "axial_stiffness": 40.0,
}  # fmt: skip


def omegas_on_ground(body: ModalBody, free: Any = (), count: int = 3, end: str = "root") -> Array:
    port = (0, body.ports[end], np.eye(3))
    return frequencies([body], [np.eye(3)], ground_hinge_equations(port, free), count)


@pytest.mark.parametrize(
    ("hinge", "free", "exact", "errors"),
    [(HELD, (), (3.5160153, 22.034492, 61.697214), (1e-7, 1e-6, 3e-5)),
     (PIN, (5,), (15.418206, 49.964862, 104.24770), (1e-6, 3e-5, 8e-4)),
     (FREE, range(6), (22.373285, 61.672823, 120.90339), (1e-6, 1e-4, 3e-3))],
)  # fmt: skip
def test_frequencies_of_a_uniform_beam(
    hinge: dict[str, Any], free: Any, exact: tuple[float, ...], errors: tuple[float, ...]
) -> None:
    """Three strain modes: the mass in eight stations limits the highest frequency."""
    modes = body_of(hinge, modes={"y": 3}, basis="modes", **THIN)
    assert (np.abs(omegas_on_ground(modes, free) / exact - 1) < errors).all()
    legendre = body_of(hinge, modes={"y": 13}, basis="legendre", **THIN)
    assert omegas_on_ground(legendre, free) == pytest.approx(exact, rel=1e-6)


@pytest.mark.parametrize(
    ("direction", "speed"), [("twist", np.sqrt(0.6 / 0.02)), ("axial", np.sqrt(40.0))]
)
def test_frequencies_of_a_rod(direction: str, speed: float) -> None:
    body = body_of(HELD, modes={direction: 3}, **ROD, **EXACT)
    assert omegas_on_ground(body) == pytest.approx(
        np.array([1, 3, 5]) * np.pi / 2 * speed, rel=5e-5
    )


@pytest.mark.parametrize("ratio", [0.3, 1.0, 5.0])
def test_strain_modes_include_a_mass_on_the_tip(ratio: float) -> None:
    """Lowest root of 1 + cos cosh + m b (cos sinh - sin cosh) = 0, for a point mass m."""
    hinge = {"name": "w", "type": "fixed", "inboard": "b.tip", "outboard": "m"}
    more = {"body": [{"name": "m", "mass": ratio, "inertia": [1e-9] * 3}], "hinge": [hinge]}
    body = body_of(HELD, more=more, modes={"y": 1}, basis="modes", **EXACT)

    def determinant(b: float) -> float:
        shear = np.cos(b) * np.sinh(b) - np.sin(b) * np.cosh(b)
        return float(1 + np.cos(b) * np.cosh(b) + ratio * b * shear)

    mass = body.Mff[0, 0] + ratio * body.ports["tip"].phi[1, 0] ** 2
    root = brentq(determinant, 0.3, 1.87)
    assert np.sqrt(body.K[0, 0] / mass) == pytest.approx(root**2, rel=1e-6)


def test_frequencies_do_not_depend_on_the_supported_section() -> None:
    beam: dict[str, Any] = {"modes": {"y": 10}, "basis": "legendre", "ends": {"mid": 0.37}, **EXACT}
    found = [
        omegas_on_ground(body_of(FREE, at=f"b.{end}", **beam), range(6), end=end)
        for end in ("root", "mid", "tip")
    ]
    assert found[1] == pytest.approx(found[0], rel=1e-5)
    assert found[2] == pytest.approx(found[0], rel=1e-10)


def test_a_stepped_beam_has_the_frequencies_of_the_second_order_beam() -> None:
    pieces = [
        {"from": 0.0, "to": 0.4, "mass_per_length": 2.0, "bending_stiffness": [3.0, 5.0]},
        {"from": 0.4, "to": 1.0, "mass_per_length": 0.7, "bending_stiffness": [1.0, 0.8]},
    ]
    beam: dict[str, Any] = {"section": pieces, "mass_per_length": None, "bending_stiffness": None}
    second_order = body_of(HELD, modes={"y": 8, "z": 8}, **beam)
    for basis, count in (("legendre", 8), ("modes", 3)):
        exact = body_of(HELD, modes={"y": count, "z": count}, basis=basis, **beam, **EXACT)
        assert omegas_on_ground(exact) == pytest.approx(omegas_on_ground(second_order), rel=5e-5)


def test_damping_by_strain_dissipates_by_its_own_strain() -> None:
    """D = tau K for each direction; one time is stiffness-proportional damping."""
    beam: dict[str, Any] = {"modes": {"y": 2, "z": 2, "twist": 1, "axial": 1}, **ROD, **EXACT}
    times = {"strain": [1e-3, 0.0, 0.0, 2e-3, 3e-3, 4e-3]}
    six = body_of(HELD, damping=times, **beam)
    by_mode = np.array([4e-3, 4e-3, 3e-3, 3e-3, 2e-3, 1e-3])
    assert pytest.approx(six.K * by_mode, rel=1e-12, abs=1e-15) == six.D
    one = body_of(HELD, damping={"strain": 5e-3}, **beam)
    proportional = body_of(HELD, damping={"stiffness": 5e-3}, **beam)
    assert pytest.approx(proportional.D, rel=1e-12, abs=1e-15) == one.D


@pytest.mark.parametrize(
    ("change", "message"),
    [({"damping": {"strain": 1e-3}}, "only exact beams have strains"),
     ({"damping": {"strain": [1e-3, 0.0]}, **EXACT}, "or six, one per strain, found 2 entries"),
     ({"frame": "chord", **EXACT}, "an exact beam has no frame"),
     ({"basis": "modes"}, "is a basis of strains")],
)  # fmt: skip
def test_keys_of_the_other_kinematics_are_refused(change: dict[str, Any], message: str) -> None:
    with pytest.raises(SceneError, match=message):
        body_of(HELD, **change)
