"""Estimators of the range of a beam's model, against known numbers; when they warn."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from mstmm.risk import Risk
from mstmm.runtime.result.checks.flexible import FLEXIBILITY_CHECKS, MODEL_RANGE
from mstmm.runtime.result.flexible import model_range, range_estimators
from mstmm.runtime.result.flexible.modal_participation import participation
from mstmm.runtime.result.flexible.model_range import ModelRange, missed_bending_energy
from mstmm.runtime.result.flexible.momentum import modal_energy, modal_frequencies, strain_energy
from tests.support.flexible.beam_motions import (
    EI_Y,
    EI_Z,
    LENGTH,
    MASS,
    beam,
    moving,
    under_tip_load,
)

#: First root of the clamped-free beam, and its moments with unit mass and length: int phi,
#: int phi x, shortening integrals G0, G1 and G(L) of the first shape.
BETA, MEAN, G0, G1, GL = 1.8751040687, 0.7829919, 1.5709, 1.1933, 4.6478

STILL = np.zeros(3)
PLAIN = ModelRange("blade", 3, "tangent", True, 0.1, 0.1, 10.0, 0.5, (0.0, 0.05), (0.01, "y3"),
                    0.01, (0.1, "y1"), 0.001)  # fmt: skip


def plain_beam(**given: Any) -> Any:
    return beam(basis="clamped-free", modes={"y": 1}, **given)


def first_squared() -> float:
    return BETA**4 * EI_Z / (MASS * LENGTH**4)


def gamma(motion: Any, ports: dict[str, Any] | None = None, gravity: Any = STILL) -> Any:
    second = range_estimators.second_order_moments(motion.body)
    assert second is not None
    k = range_estimators.stiffness_from_loads(motion, gravity, ports or {}, second)
    return range_estimators.load_ratios(motion.body.K, k)


@pytest.mark.parametrize("stiffening", [True, False])
def test_gamma_of_spin_acceleration_and_end_load(stiffening: bool) -> None:
    """Known integrals of the first clamped-free shape; a linear beam is judged by what it omits."""
    body, square = plain_beam(stiffening=stiffening), first_squared()
    spun = gamma(moving(body, angular_velocity=[7.0, 0.0, 3.0]))
    assert spun == pytest.approx((0.0, 9.0 * G1 / square), rel=1e-4)
    pushed = gamma(moving(body, acceleration=[5.0, 0.0, 0.0]))
    assert pushed == pytest.approx((-5.0 * G0 / LENGTH / square, 0.0), rel=1e-4)
    assert gamma(moving(body), gravity=np.array([-5.0, 0.0, 0.0])) == pytest.approx(pushed)
    pulled = gamma(moving(body), {"tip": (np.array([[6.0, 0.0, 0.0]]), np.zeros((1, 3)))})
    assert pulled == pytest.approx((0.0, 6.0 * GL / LENGTH**2 / (MASS * square)), rel=1e-4)


def test_gamma_reaches_one_at_the_buckling_load() -> None:
    """Clamped column under its own weight: rho A g L^3 / EI = 7.8373."""
    heavy = 7.8373 * EI_Z / (MASS * LENGTH**3)
    body = beam(modes={"y": 6})
    low, high = gamma(moving(body), gravity=np.array([-heavy, 0.0, 0.0]))
    assert low == pytest.approx(-1.0, abs=1e-4) and abs(high) < 1.0


def test_spin_across_the_beam_counts() -> None:
    body = plain_beam()
    assert modal_frequencies(body)[0] == pytest.approx(np.sqrt(first_squared()), rel=1e-9)
    assert range_estimators.transverse_spin(
        moving(body, angular_velocity=[9.0, 3.0, 4.0])
    ) == pytest.approx(5.0)


def test_slope_and_turn() -> None:
    force = np.array([0.0, 0.7, -0.4])
    motion = under_tip_load(beam(), force)
    exact = np.hypot(force[1] / EI_Z, force[2] / EI_Y) * LENGTH**2 / 2
    assert range_estimators.max_slope(motion) == pytest.approx(exact, rel=1e-12)
    body = beam(polar_inertia_per_length=0.03, torsional_stiffness=20.0, modes={"y": 1, "twist": 1})
    eta = np.array([0.0, 0.3])
    twisted = moving(body, eta=eta)
    assert range_estimators.max_slope(twisted) == 0.0
    assert range_estimators.max_rotation(twisted) == pytest.approx(
        abs(0.3 * body.ports["tip"].theta[0, 1])
    )


def test_coupling_of_a_hub_and_a_beam() -> None:
    """Hub of inertia J with a clamped beam of unit length and mass: chi = .061 and .607."""
    unit = beam(length=1.0, mass_per_length=1.0, basis="clamped-free", modes={"y": 1})
    rows = unit.E[0, 1][None]
    assert abs(rows[0, 0]) == pytest.approx(2 / BETA**2, rel=1e-9)
    for hub, expected in ((5.0, 0.061), (0.2, 0.607)):
        inertia = np.array([[hub + 1 / 3]])
        assert participation(rows, inertia, np.diag(unit.Mff))[0] == pytest.approx(
            expected, abs=5e-4
        )


def test_modal_energies_share_the_energy() -> None:
    body = beam(modes=3)
    assert body.shapes is not None
    random = np.random.default_rng(3)
    motion = moving(body, eta=random.normal(size=body.n), etad=random.normal(size=body.n))
    x, weights = body.shapes.rule()
    velocity = np.einsum("mak,k->ma", body.shapes.values_at(x).phi, motion.etad[0])
    kinetic = 0.5 * MASS * float(weights @ np.sum(velocity**2, axis=1))
    assert modal_energy(motion).sum() - strain_energy(motion)[0] == pytest.approx(kinetic)
    bent = np.einsum("mak,k->ma", body.shapes.values_at(x).curvature[:, 1:], motion.eta[0])
    stored = 0.5 * float(weights @ (bent**2 @ [EI_Y, EI_Z]))
    assert strain_energy(motion)[0] == pytest.approx(stored)


def test_last_shape_is_that_of_its_family() -> None:
    body = beam(modes=3)
    eta = np.zeros(body.n)
    eta[body.modes.index("y1")], eta[body.modes.index("z3")] = 1e-3, 1e-4
    eta[body.modes.index("z1")] = 1e-3
    share, name = range_estimators.last_shape_share(moving(body, eta=eta))
    energy = modal_energy(moving(body, eta=eta))[0]
    of_z = energy[[body.modes.index(f"z{k}") for k in (1, 2, 3)]].sum()
    assert name == "z3"
    assert share == pytest.approx(energy[body.modes.index("z3")] / of_z)


def test_bending_that_the_shapes_miss() -> None:
    """Under a tip force the clamped-free shapes miss 1 - sum 12/beta^4 of the energy, the static
    shape none; under a couple at the tip they miss half of it and more."""
    places, weights = beam().shapes.rule()  # type: ignore[union-attr]
    force = np.array([0.0, 0.01, 0.0])
    for table, expected in (({"basis": "clamped-free"}, 1 - 12 / BETA**4 - 12 / 4.694091**4),
                            ({}, 0.0)):  # fmt: skip
        motion = under_tip_load(beam(**table), force)
        moment = np.zeros((1, len(places), 2))
        moment[0, :, 1] = force[1] * (LENGTH - places)
        found = missed_bending_energy(motion, places, weights, moment)
        assert found == pytest.approx(expected, abs=1e-6)


def test_shear_error_grows_with_the_square_of_the_wave_number() -> None:
    table: dict[str, Any] = {
        "basis": "simply-supported",
        "frame": "chord",
        "rotary_inertia": MASS * 1e-4,
    }
    found = range_estimators.shear_errors(beam(modes={"y": 4}, **table))
    assert found is not None
    exact = 0.5 * (np.pi / LENGTH) ** 2 * 1e-4 * 3.12
    assert found == pytest.approx(exact * np.arange(1, 5) ** 2, rel=1e-6)
    assert range_estimators.shear_errors(beam()) is None


def test_shear_counts_as_much_as_its_shape_moves() -> None:
    """A tip load bends by the first shapes, a short wave by the fourth."""
    table: dict[str, Any] = {"modes": {"y": 4}, "rotary_inertia": MASS * 1e-2}
    body = beam(**table)
    slow, each = (
        under_tip_load(body, np.array([0.0, 1.0, 0.0])),
        range_estimators.shear_errors(body),
    )
    fast = replace(slow, eta=np.eye(4)[3:])
    assert each is not None
    (low, high), still = (
        map(range_estimators.weighted_shear_error, (slow, fast)),
        replace(slow, eta=0 * slow.eta),
    )
    assert low is not None and low < 0.2 * each[3] and high == pytest.approx(each[3], rel=1e-6)
    assert range_estimators.weighted_shear_error(still) == 0.0


# --- warnings -------------------------------------------------------------------------------------


def flexibility_risks(ranges: Sequence[ModelRange]) -> list[Risk]:
    """Risks of a result with these ranges of its flexible bodies."""
    result: Any = SimpleNamespace(_measures={MODEL_RANGE: tuple(ranges)})
    return [risk for check in FLEXIBILITY_CHECKS for risk in check.after(result)]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"stiffening": False, "spin_ratio": 1.58}, "spins at 1.6 times its first frequency"),
        ({"stiffening": False, "gamma": (-0.2, 0.0)}, "change its stiffness by 20%"),
        ({"slope": 0.31}, "slope of 0.31 relative to its floating frame.*split the body"),
        ({"turn": 1.45}, r"the model is not valid above 1\.5 rad"),
        ({"tail": 0.2}, "miss 20% of its bending energy.*static\\+fixed-interface"),
        ({"gamma": (-0.95, 0.0)}, "buckling load"),
        ({"shear": 0.2}, "too short for a beam without shear"),
        ({"said": ("basis of blade is poor; take another",)}, "^basis of blade is poor; take"),
    ],
)
def test_each_limit_has_its_warning(changes: dict[str, Any], words: str) -> None:
    (risk,) = flexibility_risks([replace(PLAIN, **changes)])
    assert re.search(words, str(risk))
    assert risk.invalidates and risk.element == '"blade"'


def test_a_body_within_its_range_is_not_warned_about() -> None:
    assert flexibility_risks([PLAIN]) == []
    fast = replace(PLAIN, spin_ratio=2.0, gamma=(0.0, 5.0))
    assert flexibility_risks([fast]) == []


def test_many_bodies_give_one_sentence_of_a_kind_and_a_few_rows() -> None:
    many = [replace(PLAIN, name=f"b{k}", slope=0.01 * k) for k in range(100)]
    (risk,) = flexibility_risks(many)
    assert risk.element == '"b99"' and "68 more bodies" in str(risk)
    rows = dict(model_range.rows(many))
    assert rows["largest slope"] == '0.99 at "b99"' and len(rows) < 6
    own = dict(model_range.rows([PLAIN]))
    assert set(own) == {"blade", "blade shapes"}
    assert "y3 holds 1.0e-02 of the energy" in own["blade shapes"]
