"""A heavy slider behind a light flexible rod: refined, against the same with the rod cut off it."""

from __future__ import annotations

import pytest

import mstmm
from tests.system.loops.test_flexible_against_tree import slider_crank


def heavy_slider_model(mass: float, cut: str) -> mstmm.Model:
    """The slider-crank with a slider of so many kg; with `guide` cut it hangs behind the rod."""
    scene = slider_crank(cut)
    scene["body"][1] |= {"mass": mass, "inertia": [1e-3 * mass] * 3}
    return mstmm.compile(mstmm.Scene(**scene), engine="looped")


def accelerations(model: mstmm.Model) -> dict[str, float]:
    """Those of the speeds at the start, where the loop is closed, by their names."""
    start = model.simulate(1e-6, output_times=[0.0, 1e-6])
    found = model.accelerations(start.q[0], start.u[0])
    return dict(zip(model.coordinate_layout.u_names, found, strict=True))


@pytest.mark.parametrize(("mass", "least"), [(1e4, 1e-11), (1e8, 1e-7), (1e10, 1e-5)])
def test_it_loses_no_digits(mass: float, least: float) -> None:
    hanging, exact = (
        heavy_slider_model(mass, "guide"),
        accelerations(heavy_slider_model(mass, "wrist")),
    )
    assert accelerations(hanging).keys() == exact.keys()

    def error() -> float:
        found, size = accelerations(hanging), max(map(abs, exact.values()))
        return max(abs(found[name] - exact[name]) for name in exact) / size

    refined = error()
    assert hanging.looped.packed.model.refines > 0
    hanging.looped.packed.model.refines = 0
    plain = error()
    print(plain, refined)
    assert refined < 1e-11 and plain > least
