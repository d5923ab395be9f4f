"""Cases: scene, duration, and the ends whose final positions are compared."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from . import scenes
from .scenes import Scene


@dataclass(frozen=True)
class Case:
    """One motion.

    Attributes:
        name, title: for the command line and for pictures.
        scene: makes the scene.
        t_end: s.
        end_names: the error is the largest distance (m) of one of these ends from its reference.
        bushings: (count, k, zeta) of `scenes.bushed_rods`, for peers that build it themselves.
        dampers: (count, c) of `scenes.damped_rods`, likewise.
    """

    name: str
    title: str
    scene: Callable[[], Scene]
    t_end: float
    end_names: tuple[str, ...]
    bushings: tuple[int, float, float] | None = None
    dampers: tuple[int, float] | None = None


def _bushing_case(name: str, count: int, k: float, zeta: float) -> Case:
    damping = {0.0: "undamped", 1.0: "critical"}.get(zeta, f"{100 * zeta:g} %")
    return Case(
        name, f"{count} rods on bushings, 1e{math.log10(k):g} N/m, {damping}",
        partial(scenes.bushed_rods, count, k, zeta), 1.0,
        tuple(f"rod{i}.tip" for i in range(count)), bushings=(count, k, zeta),
    )  # fmt: skip


def _beam_case(name: str, shapes: int, stiffness: float, zeta: float) -> Case:
    title = f"falling beam, {shapes} shapes, EI {stiffness:g} N m², {100 * zeta:g} %"
    return Case(
        name, title, partial(scenes.falling_beam, shapes, stiffness, zeta), 1.0, ("beam.tip",)
    )


def _spin_up_case(name: str, shapes: int) -> Case:
    title = f"beam spun up, {shapes} shapes"
    return Case(name, title, partial(scenes.spun_beam, shapes, 1.4e5, 0.0), 5.0, ("beam.tip",))


def _arm_case(name: str, title: str, friction: bool, stop: bool) -> Case:
    scene = partial(scenes.loaded_arm, friction, stop)
    return Case(name, title, scene, 1.0, ("upper.tip", "fore.tip", "hand.tip"))


_LINKS = tuple(f"link{i}.tip" for i in range(6))

CASES = {case.name: case for case in (
    _bushing_case("a10-1e4", 10, 1e4, 0.01),
    _bushing_case("a10-1e6", 10, 1e6, 0.01),
    _bushing_case("a10-1e8-undamped", 10, 1e8, 0.0),
    _bushing_case("a10-1e8", 10, 1e8, 0.01),
    _bushing_case("a10-1e8-critical", 10, 1e8, 1.0),
    _bushing_case("a50-1e8", 50, 1e8, 0.01),
    _beam_case("b4", 4, 500.0, 0.0),
    _beam_case("b8", 8, 5e4, 0.0),
    _beam_case("b8-damped", 8, 5e4, 0.01),
    _spin_up_case("b4-spun", 4),
    _spin_up_case("b8-spun", 8),
    _arm_case("c", "arm: stiff drive, friction, stop", True, True),
    _arm_case("c-no-stop", "arm: stiff drive, friction", True, False),
    _arm_case("c-no-friction", "arm: stiff drive, stop", False, True),
    Case("d-half", "half car on bushings", scenes.half_car, 1.0,
         ("car.front", "car.rear", "front.tip", "rear.tip")),
    Case("d-quarter", "quarter car on a stiff mount", scenes.quarter_car, 2.0,
         ("wheel", "plate", "car")),
    Case("e", "six-pin arm (not stiff)", scenes.rigid_arm, 1.0, _LINKS),
    Case("f", "100 rods on damped pins", partial(scenes.damped_rods, 100, 1e3), 1.0,
         tuple(f"rod{i}.tip" for i in range(100)), dampers=(100, 1e3)),
)}  # fmt: skip
