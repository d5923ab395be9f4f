"""What the certificate of a run says of flexible bodies, and what it does not say."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.cli.error_boundary import run as command
from mstmm.runtime.result.result import Result

#: Spin-up to 6 rad/s, 1.58 times the first frequency (theory: Simo and Vu-Quoc 1986).
SPIN_UP = "where(t < 15, 0.4*(t^2/2 + (15/(2*pi))^2*(cos(2*pi*t/15) - 1)), 45 + 6*(t - 15))"


def beam(**given: Any) -> dict[str, Any]:
    return {
        "name": "blade", "length": 10.0, "mass_per_length": 1.2, "bending_stiffness": 1.4e4,
        "modes": {"y": 2}, **given,
    }  # fmt: skip


def scene(blade: dict[str, Any], gravity: Any = (0, 0, 0), **hinge: Any) -> mstmm.Scene:
    motor = {"name": "motor", "type": "pin", "inboard": "ground", "outboard": "blade", **hinge}
    return mstmm.Scene(gravity=gravity, beam=[blade], hinge=[motor])


def run_of(one: mstmm.Scene, t_end: float, samples: int = 81) -> Result:
    times = np.linspace(0.0, t_end, samples)
    return mstmm.compile(one, engine="looped").simulate(t_end, rtol=1e-6, output_times=times)


def matching(result: Result, words: str) -> list[str]:
    return [text for text in result.warnings if re.search(words, text)]


def test_a_linear_beam_spun_past_its_first_frequency_is_warned_about() -> None:
    result = run_of(scene(beam(stiffening=False), drive=SPIN_UP), 9.5)
    assert matching(result, r'"blade" has no geometric stiffening and spins at 1\.\d+ times')


def test_with_stiffening_the_same_spin_is_within_the_model() -> None:
    result = run_of(scene(beam(), drive=SPIN_UP), 20.0)
    assert result.warnings == ()
    (blade,) = result.certificate.flexible_bodies
    assert blade.spin_ratio == pytest.approx(1.580, abs=1e-3)
    assert blade.gamma is not None and blade.gamma[1] > 2.0
    assert 0.07 < blade.slope < 0.08
    assert blade.tail is not None and blade.tail < 1e-3


def test_a_linear_beam_that_turns_slowly_is_not_warned_about() -> None:
    result = run_of(scene(beam(stiffening=False), drive="0.1*t^2"), 2.0)
    assert result.warnings == ()
    assert result.certificate.flexible_bodies[0].load_ratio < 0.1


def test_a_slope_beyond_the_range_of_one_frame_is_warned_about() -> None:
    soft = beam(bending_stiffness=2.5e3)
    result = run_of(scene(soft, gravity=(0, -9.81, 0), type="fixed"), 1.0)
    assert matching(result, r"slope of [\d.]+ relative to its floating frame.*split the body")
    stiff = run_of(scene(beam(bending_stiffness=2.5e4), gravity=(0, -9.81, 0), type="fixed"), 1.0)
    assert not matching(stiff, "slope")


def test_shapes_that_cannot_carry_the_load_at_the_tip_are_warned_about() -> None:
    """Under a couple two clamped-free shapes miss 1 - 0.613 - 0.188 of the bending energy."""
    base = {"name": "base", "type": "fixed", "inboard": "ground", "outboard": "blade"}
    couple = {"on": "blade.tip", "moment": [0, 0, 50.0]}

    def under_couple(**given: Any) -> Result:
        blade = beam(initial="static", **given)
        one = mstmm.Scene(gravity=(0, 0, 0), beam=[blade], hinge=[base], load=[couple])
        return run_of(one, 0.2)

    poor = under_couple(basis="clamped-free", frame="tangent")
    assert matching(poor, r'shapes of "blade" miss 20% of its bending energy')
    good = under_couple()
    assert good.warnings == ()
    assert good.certificate.flexible_bodies[0].tail == pytest.approx(0.0, abs=1e-6)


def test_a_tangent_frame_at_a_pinned_end_is_warned_about() -> None:
    tied = run_of(scene(beam(frame="tangent")), 0.1)
    assert matching(tied, "tangent frame.*free to rotate")
    assert run_of(scene(beam(frame="chord")), 0.1).warnings == ()


def test_the_certificate_is_printed_and_saved(tmp_path: Path) -> None:
    result = run_of(scene(beam(), drive=SPIN_UP), 5.0)
    text = str(result.certificate)
    assert re.search(r"^blade +slope 0\.\d+ .*spin [\d.]+ of omega_1 = 3\.798 rad/s", text, re.M)
    assert re.search(r"^blade shapes +2 in a tangent frame; y2 holds", text, re.M)
    again = mstmm.load_result(result.save(tmp_path / "run.nc"))
    assert str(again.certificate) == text


def test_conserved_momentum_of_a_free_beam_is_watched() -> None:
    free = {
        "name": "spear", "length": 2.0, "mass_per_length": 0.5, "bending_stiffness": 150.0,
        "modes": 2, "polar_inertia_per_length": 1e-3, "initial": {"eta": [0.02, 0.0, -0.01, 0.0]},
    }  # fmt: skip
    hand = {"name": "hand", "type": "free", "inboard": "ground", "outboard": "spear",
            "initial": {"u": [1.0, 2.0, 0.5, 0.1, 3.0, -2.0]}}  # fmt: skip
    one = mstmm.Scene(gravity=(0, -9.81, 0), beam=[free], hinge=[hand])
    result = mstmm.compile(one, engine="looped").simulate(1.0)
    kept = {drift.name: drift.relative for drift in result.certificate.momentum}
    assert set(kept) == {"momentum x", "momentum z", "angular momentum y"}
    assert max(kept.values()) < 1e-8 and result.certificate.energy.relative < 1e-8
    dragged = mstmm.Scene(gravity=(0, -9.81, 0), beam=[{**free, "viscous_drag": 1.0}], hinge=[hand])
    assert mstmm.compile(dragged, engine="looped").simulate(0.1).certificate.momentum == ()


@pytest.mark.parametrize("frame", ["chord", "mean"])
def test_long_chains_of_pinned_beams_keep_their_pivots(frame: str) -> None:
    """Condensed modes give way: rounding does not grow from beam to beam."""
    count = 30
    hinges = [
        {"name": f"p{k}", "type": "pin", "inboard": f"b{k - 1}.tip" if k else "ground",
         "outboard": f"b{k}", "initial": {"q": [0.3 * (-1) ** k]}}
        for k in range(count)
    ]  # fmt: skip
    beams = [beam(name=f"b{k}", length=0.1, frame=frame) for k in range(count)]
    one = mstmm.Scene(gravity=(0, -9.81, 0), beam=beams, hinge=hinges)
    pivot = mstmm.compile(one, engine="looped").simulate(0.0).certificate.pivot_loss
    assert pivot is not None and 1.0 <= pivot.ratio < 1e3


def test_the_command_line_tells_prints_and_draws(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "spin.toml"
    path.write_text(scene(beam(), drive=SPIN_UP).to_toml())
    common = [
        "simulate",
        str(path),
        "--t-end",
        "0.5",
        "--no-certify",
        "-o",
        str(tmp_path / "spin.nc"),
    ]
    assert command([*common, "--json", "--plot", str(tmp_path / "spin.png"), "--times", "21"]) == 0
    (blade,) = json.loads(capsys.readouterr().out)["certificate"]["flexible"]
    assert blade["name"] == "blade" and blade["stiffening"] is True and blade["frame"] == "tangent"
    assert (tmp_path / "spin.png").stat().st_size > 20_000
    picture = str(tmp_path / "some.svg")
    chosen = ["-q", "blade.shape", "-q", "blade.strain_energy", "--plot", picture]
    assert command([*common, *chosen]) == 0
    shown = capsys.readouterr().out
    assert "blade.strain_energy" in shown and "blade shapes" in shown
    assert command([*common, "-q", "blade.shap"]) == 2
    assert "blade.shape" in capsys.readouterr().err
