"""Rigid bodies in absolute coordinates: published figures, an independent solution, our engine."""

from __future__ import annotations

from functools import cache, partial
from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray

import mstmm
from mstmm.runtime.classical.c_records import Stepper
from mstmm.runtime.result.result import Result
from mstmm.runtime.run import classical_run
from tests.reference.rods_index3 import tip
from tests.support.scenes.classical import rods, spinning_rods, tree

Array = NDArray[np.float64]

STEPS = (0.02, 0.01, 0.005, 0.0025)
RICCATI, PRODUCT = "dttmm-classical", "dttmm-classical-product"


@cache
def double_pendulum() -> mstmm.Model:
    return mstmm.compile(rods(2))


@cache
def exact_angles() -> Array:
    run = double_pendulum().simulate(1.0, rtol=1e-12, atol=1e-12, output_times=[1.0])
    return np.asarray(np.cumsum(run.q[-1]))


def angle_error(step: float, scheme: str, iterations: int, method: str = RICCATI) -> float:
    run = double_pendulum().simulate(
        1.0,
        mstmm.methods.ClassicalDiscreteTime(method, scheme=scheme, iterations=iterations),
        step,
        output_times=[1.0],
    )
    return float(np.abs(np.cumsum(run.q[-1]) - exact_angles()).max())


def orders(errors: list[float]) -> list[float]:
    return [float(np.log2(coarse / fine)) for coarse, fine in pairwise(errors)]


#: Errors of the angles of two rods that fall from the horizontal, h = 0.02 ... 0.0025 s: figures of
#: an independent dense solution in the bodies' input ends, to the digits given.
ERRORS = {
    ("newmark", 1): "3.7e-03 9.3e-04 2.3e-04 5.8e-05",
    ("newmark", 20): "3.7e-03 9.2e-04 2.3e-04 5.8e-05",
    ("hht", 1): "4.3e-03 1.1e-03 2.7e-04 6.6e-05",
    ("hht:0.3", 1): "5.8e-03 1.4e-03 3.5e-04 8.7e-05",
    ("newmark:0.6", 1): "3.0e-02 1.4e-02 6.9e-03 3.4e-03",
}


@pytest.mark.parametrize("method", [RICCATI, PRODUCT])
@pytest.mark.parametrize("scheme, iterations", ERRORS)
def test_a_double_pendulum_errs_as_tabled(scheme: str, iterations: int, method: str) -> None:
    found = [angle_error(h, scheme, iterations, method) for h in STEPS]
    assert " ".join(f"{error:.1e}" for error in found) == ERRORS[scheme, iterations]


@pytest.mark.parametrize("scheme", ["newmark", "hht", "generalised-alpha", "wilson"])
def test_every_scheme_is_of_second_order(scheme: str) -> None:
    found = orders([angle_error(h, scheme, 1) for h in STEPS[1:]])
    assert found == pytest.approx([2.0, 2.0], abs=0.05)


@pytest.mark.parametrize("step, before", [(0.01, 8.0), (0.02, 10.0)])
@pytest.mark.parametrize("iterations", [1, 20])
def test_undamped_newmark_fails_on_hinges_at_position_level(
    step: float, before: float, iterations: int
) -> None:
    """Cardona, Geradin 1989: weakly unstable, converged or not; it ends with a message."""
    run = double_pendulum().simulate(
        20,
        mstmm.methods.ClassicalDiscreteTime(RICCATI, scheme="newmark", iterations=iterations),
        step,
    )
    assert not run.success
    assert 4.0 < run.t[-1] < before
    assert "position gap" in run.message or "do not converge" in run.message
    assert np.isfinite(run.q).all()


@pytest.mark.parametrize(
    "scheme, joules",
    [("wilson", 1.0), ("hht", 0.46), ("hht:0.3", 0.54), ("generalised-alpha", 0.37)],
)
def test_damped_schemes_keep_the_energy_of_twenty_seconds(scheme: str, joules: float) -> None:
    run = double_pendulum().simulate(
        20, mstmm.methods.ClassicalDiscreteTime(RICCATI, scheme=scheme), 0.01
    )
    assert run.success
    assert np.abs(run.energy() - run.energy()[0]).max() == pytest.approx(joules, abs=0.03)


# --- in space ---------------------------------------------------------------------------------


@cache
def spinning() -> mstmm.Model:
    return mstmm.compile(spinning_rods())


def spatial_tip(run: Result) -> Array:
    return np.asarray(run.position("rod1.tip")[-1])


def spatial_run(step: float, scheme: str = "", iterations: int = 1, t_end: float = 1.0) -> Result:
    return spinning().simulate(
        t_end,
        mstmm.methods.ClassicalDiscreteTime(RICCATI, scheme=scheme, iterations=iterations),
        step,
    )


@pytest.mark.parametrize("scheme, alphas", [("generalised-alpha", (1 / 3, 4 / 9)),
                                            ("newmark", (0.0, 0.0))])  # fmt: skip
def test_converged_steps_are_those_of_a_dense_solution(
    scheme: str, alphas: tuple[float, float]
) -> None:
    found = spatial_tip(spatial_run(0.02, scheme, 20, t_end=0.2))
    assert found == pytest.approx(tip(0.02, 0.2, 0.0, *alphas), abs=1e-9)


def test_the_spatial_rods_converge_to_the_exact_tip() -> None:
    exact = spinning().simulate(1.0, rtol=1e-12, atol=1e-12, output_times=[1.0])
    assert spatial_tip(exact) == pytest.approx([-1.73440907, -0.60301530, -0.73141152], abs=1e-8)
    errors = [float(np.linalg.norm(spatial_tip(spatial_run(h)) - spatial_tip(exact)))
              for h in STEPS]  # fmt: skip
    assert orders(errors)[1:] == pytest.approx([2.0, 2.0], abs=0.02)


def test_one_iteration_fails_without_the_tangent_operator(monkeypatch: pytest.MonkeyPatch) -> None:
    assert spatial_run(0.02, "newmark").success
    assert spatial_run(0.01, "generalised-alpha", t_end=5.0).success
    monkeypatch.setattr(classical_run, "Stepper", partial(Stepper, turning=False))
    lost = spatial_run(0.02, "newmark")
    assert not lost.success and "position gap" in lost.message
    assert not spatial_run(0.01, "generalised-alpha", t_end=5.0).success


# --- springs, trees, product ------------------------------------------------------------------


def bushing(stiffness: float) -> mstmm.Model:
    law = {"stiffness": [stiffness, stiffness, stiffness, 0, 0, 0]}
    return mstmm.compile(rods(2, "elastic", law))


@pytest.mark.parametrize("method", [RICCATI, PRODUCT])
@pytest.mark.parametrize("stiffness", [1e8, 1e10])
def test_stiff_bushings_tend_to_the_pins(stiffness: float, method: str) -> None:
    """One iteration with the load of the last step in the geometric term, h w far above 1."""
    model = bushing(stiffness)
    for step, worst in ((0.02, 4.1e-3), (0.01, 1.05e-3)):
        run = model.simulate(1.0, method, step, output_times=[1.0])
        assert run.success
        quaternions = run.q[-1].reshape(2, 7)[:, 3:]
        angles = np.cumsum(2 * np.arctan2(quaternions[:, 3], quaternions[:, 0]))
        off = np.angle(np.exp(1j * (angles - exact_angles())))
        assert np.abs(off).max() < worst


KINDS = {
    "pins": ["pin"],
    "balls": ["ball"],
    "welds": ["fixed", "pin", "pin"],
    "springs": ["elastic"],
    "springs and pins": ["elastic", "pin", "fixed"],
    "springs about two axes": ["sprung pin", "fixed"],
    "springs along three axes": ["sprung ball", "elastic"],
    "in flight": ["free", "ball", "ball", "ball", "ball", "ball"],
}


@pytest.mark.parametrize("kinds", KINDS.values(), ids=KINDS)
def test_trees_tend_to_the_ordinary_engine(kinds: list[str]) -> None:
    model = mstmm.compile(tree(kinds))
    exact = model.simulate(0.3, rtol=1e-12, atol=1e-12, output_times=[0.3])
    errors = []
    for step in (0.01, 0.005, 0.0025):
        run = model.simulate(0.3, RICCATI, step, output_times=[0.3])
        errors.append(float(np.abs(run.q[-1] - exact.q[-1]).max()))
    assert orders(errors) == pytest.approx([2.0, 2.0], abs=0.1)


@pytest.mark.parametrize("kinds", KINDS.values(), ids=KINDS)
def test_product_and_riccati_agree(kinds: list[str]) -> None:
    model = mstmm.compile(tree(kinds))
    runs = [model.simulate(0.1, method, 0.01) for method in (RICCATI, PRODUCT)]
    assert all(run.success for run in runs)
    assert runs[1].q == pytest.approx(runs[0].q, abs=1e-6)
    assert runs[1].u == pytest.approx(runs[0].u, abs=1e-5)


@pytest.mark.parametrize("kind", ["pin", "ball"])
def test_the_plain_product_loses_long_chains_and_says_so(kind: str) -> None:
    model = mstmm.compile(rods(24, kind))
    assert model.simulate(0.01, RICCATI, 0.001).success
    lost = model.simulate(0.01, PRODUCT, 0.001)
    assert not lost.success
    assert "is lost to rounding" in lost.message and "use method dttmm-classical" in lost.message
    assert len(lost.t) == 1


def test_a_mixed_chain_is_for_riccati_alone() -> None:
    model = mstmm.compile(tree(["pin", "ball"]))
    assert model.simulate(0.02, RICCATI, 0.01).success
    with pytest.raises(mstmm.SceneError, match=r'hinge "h1".*rotates as a pin'):
        model.simulate(0.02, PRODUCT, 0.01)


@pytest.mark.parametrize("scheme", ["newmark", "generalised-alpha"])
def test_one_iteration_fails_beside_an_unresolved_vibration(scheme: str) -> None:
    """A bushing stretched by 1 mm holds 50 J, which no step resolves: it ends with a message."""
    model = bushing(1e8)
    q, u = model.initial_state()
    q[0] = 1e-3
    run = model.simulate(
        2.0, mstmm.methods.ClassicalDiscreteTime(RICCATI, scheme=scheme), 0.01, initial=(q, u)
    )
    assert not run.success
    assert "by more than the size of the scene" in run.message


def test_converged_steps_swing_and_damp_what_they_do_not_resolve() -> None:
    model = bushing(1e8)
    q, u = model.initial_state()
    q[0] = 1e-3
    energy = model.simulate(
        2.0, mstmm.methods.ClassicalDiscreteTime(RICCATI, iterations=50), 0.01, initial=(q, u)
    ).energy()
    change = energy - energy[0]
    assert np.abs(change).max() == pytest.approx(190, rel=0.03)
    assert change[-1] == pytest.approx(-48.6, abs=0.5)
