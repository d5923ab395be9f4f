"""Andrews' squeezing mechanism against its published solution.

Statements: (1) at the start two accelerations are the published ones to 1e-10 and the others zero;
the rank of the fifteen rows is six, one motion is left.  (2) After 0.03 s, two and a half turns of
the crank, all angles are the published ones within 3e-9 rad, where the published ones of beta and
Theta are off by 1.1e-9 and 1.4e-9 themselves, and speeds within 1e-6.  (3) The error follows the
tolerance.
"""

from __future__ import annotations

from pathlib import Path

import mstmm

SCENE = Path(__file__).with_name("scene.toml")
#: After 0.03 s: the test set for initial value problems (andrews.f, PSIDE, tolerance 1e-14).
ANGLES = {
    "beta": 15.81077119629904, "Theta": -15.75637105984298, "gamma": 0.04082224013073101,
    "Phi": -0.5347301163226948, "delta": 0.5244099658805304, "Omega": 0.5347301163226948,
    "eps": 1.048080741042263,
}  # fmt: skip
SPEEDS = {
    "beta": 1139.920302151208, "Theta": -1424.379294994111, "gamma": 11.03291221937134,
    "Phi": 19.29337464421385, "delta": 0.5735699284790808, "eps": 0.3231791658026955,
}  # fmt: skip
#: At the start, rad/s^2.
STARTING = {"beta": 14222.4439199541, "Theta": -10666.8329399656}


def main() -> None:
    """All three statements."""
    model = mstmm.compile(mstmm.load_scene(SCENE))
    loops = model.loops
    print(
        f"cut: {', '.join(loops.cut_hinges)}; {loops.rank} of {len(loops.constraint_rows)} rows "
        f"count"
    )
    assert (len(loops.constraint_rows), loops.rank, loops.mobility) == (15, 6, 1)

    udot = model.accelerations(*model.initial_state())
    at = {name: model.coordinate_layout.hinges[name].u for name in ANGLES}
    for name in ANGLES:
        found = float(udot[at[name]])
        wanted = STARTING.get(name, 0.0)
        assert abs(found - wanted) < 1e-10 * STARTING["beta"], (name, found)

    for rtol, bound in ((1e-6, 1e-5), (1e-8, 1e-7), (1e-10, 3e-9)):
        result = model.simulate(
            0.03, "dop853", rtol=rtol, atol=1e-3 * rtol, output_times=[0.0, 0.03]
        )
        assert result.success, result.message
        q = {name: float(result.q[-1, model.coordinate_layout.hinges[name].q]) for name in ANGLES}
        apart = max(abs(q[name] - wanted) for name, wanted in ANGLES.items())
        steps = result.statistics
        assert steps is not None
        print(f"rtol {rtol:.0e}: off by {apart:.1e} rad in {steps.evaluations} evaluations")
        assert apart < bound
    for name, wanted in SPEEDS.items():
        assert abs(float(result.u[-1, at[name]]) - wanted) < 1e-6 * abs(wanted), name


if __name__ == "__main__":
    main()
