"""Dry friction in linear models: omitted at rest, or equivalent viscous damping.

Dry friction has no slope at rest.  The law of a hinge is smooth only within its regularisation
velocity; its slope there, the friction over that velocity, is not a property of the scene.  Where
the hinge slides at the state, the slope of its law is that of the motion and is kept.

For u = V sin(omega t) the work of friction F(u) in a period equals that of a viscous damper of

    c = 2/(pi V) integral from 0 to pi of F(V sin x) sin x dx,

its describing function (N. Minorsky, Introduction to Non-linear Mechanics, 1947).  For Coulomb
friction c = 4 F/(pi V); the Stribeck term adds a Dawson integral.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

from scipy.special import dawsn

from mstmm.array_validation import Array, finite_float
from mstmm.errors import SceneError
from mstmm.scene.validators.validation_messages import did_you_mean

from ...engine.looped_engine import LoopedEngine
from ...packing.scene_packing import packed_system
from ...packing.system import LawNumbers, LawRun

if TYPE_CHECKING:
    from ...engine.compiled_scene import CompiledScene

#: Amplitudes of speed (rad/s or m/s): one, or by names of hinges, chains and speeds.
Amplitudes = float | Mapping[str, float] | None

#: Multiple of the regularisation velocity above which a hinge slides: tanh is within 4e-9 of 1.
_SLIDING = 10.0
#: Kernel of laws with friction, and indices of damping, friction and velocities in its parameters.
_KERNEL, _DAMPING, _COULOMB, _STATIC, _STRIBECK, _WIDTH = "full", 2, 3, 4, 5, 6


class StickingFriction(NamedTuple):
    """Friction of one speed that does not slide.

    Attributes:
        speed: index of the speed.
        coulomb, static: Coulomb and static friction (N or N*m).
        damping: equivalent viscous damping (N*s/m or N*m*s/rad).
        is_given: whether an amplitude was given.
    """

    speed: int
    coulomb: float
    static: float
    damping: float
    is_given: bool


@dataclass(frozen=True, eq=False)
class DryFriction:
    """Friction of the hinges of a model that do not slide, and its equivalent damping."""

    model: CompiledScene
    sticking: Mapping[int, StickingFriction]
    amplitudes: Amplitudes

    def __bool__(self) -> bool:
        return bool(self.sticking)

    def replace_friction(self, laws: tuple[LawRun, ...]) -> tuple[LawRun, ...]:
        """Laws of the system of the model with viscous damping instead of this friction."""
        first = self.model.packed_scene.system.first_indices["u"]

        def replace_law(law: LawNumbers, body: int) -> LawNumbers:
            sticking = self.sticking.get(int(first[body]) + law.speed)
            if sticking is None or law.kernel != _KERNEL:
                return law
            p = list(law.p)
            p[_DAMPING] = p[_DAMPING] + sticking.damping
            p[_COULOMB] = p[_STATIC] = 0.0
            return replace(law, p=tuple(p))

        return tuple(law for run in laws for law in change_laws(run, replace_law))

    def engine(self, model: CompiledScene) -> LoopedEngine:
        """Looped engine of the model, or of its variant with other parameters, with these laws."""
        packed = model.packed_scene
        changed_system = replace(packed.system, laws=self.replace_friction(packed.system.laws))
        return LoopedEngine(packed_system(changed_system, packed))


def change_laws(run: LawRun, change: Callable[[LawNumbers, int], LawNumbers]) -> Iterator[LawRun]:
    """Yield a run of laws with `change` applied to each law and body index.

    The run keeps its pattern if all its repeats change equally; else each law becomes a run.
    """
    every = [
        (change(law, body), body, twist, speed_indices)
        for law, body, twist, speed_indices in run.iterate_laws()
    ]
    width = len(run.pattern)
    pattern = [law for law, _, _, _ in every[:width]]
    if all(law is pattern[k % width] or law == pattern[k % width]
           for k, (law, _, _, _) in enumerate(every)):  # fmt: skip
        yield replace(run, pattern=(*pattern, *run.pattern[len(pattern) :]))
        return
    for law, body, twist, places in every:
        alone = replace(law, member=0, turn=min(law.turn, 0), efforts=(places,))
        yield LawRun(body, 1, 1, (alone,), max(twist, 0))


def dry_friction(model: CompiledScene, u: Array, amplitudes: Amplitudes) -> DryFriction:
    """Friction that a linear model about a state with speeds u (nu,) omits or replaces.

    Raises SceneError for names without friction and amplitudes that are not positive.
    """
    system, free = model.packed_scene.system, set(model.free_speed_indices)
    laws = [law for run in system.laws for law in run.pattern]
    if not any(law.kernel == _KERNEL and law.p[_STATIC] for law in laws) and amplitudes is None:
        return DryFriction(model, {}, None)
    first = system.first_indices["u"]
    acting = {
        int(first[body]) + law.speed: law.p
        for run in system.laws for law, body, _, _ in run.iterate_laws()
        if law.kernel == _KERNEL and law.p[_STATIC]
    }  # fmt: skip
    amplitude_of = _amplitudes(model, amplitudes, list(acting))
    hinges = {
        speed: _sticking_friction(speed, p, amplitude_of(speed)) for speed, p in acting.items()
        if speed in free and abs(u[speed]) <= _SLIDING * p[_WIDTH]
    }  # fmt: skip
    return DryFriction(model, hinges, amplitudes)


def _sticking_friction(
    speed: int, p: tuple[float, ...], amplitude: float | None
) -> StickingFriction:
    coulomb, static = p[_COULOMB], p[_STATIC]
    if amplitude is None:
        return StickingFriction(speed, coulomb, static, 0.0, False)
    x = amplitude / p[_STRIBECK]
    level = coulomb + (static - coulomb) * float(dawsn(x)) / x
    return StickingFriction(speed, coulomb, static, 4 * level / (math.pi * amplitude), True)


def _amplitudes(
    model: CompiledScene, given: Amplitudes, speeds: list[int]
) -> Callable[[int], float | None]:
    """Function that returns the amplitude of a speed, or None if none is given for it."""
    if given is None:
        return lambda speed: None
    if not isinstance(given, Mapping):
        amplitude = _amplitude("friction", given)
        return lambda speed: amplitude
    known = {speed: _names(model.coordinate_layout.u_name(speed)) for speed in speeds}
    every = sorted({name for names in known.values() for name in names})
    for name in given:
        if name not in every:
            raise SceneError(
                f'friction: "{name}": expected a hinge with dry friction, its chain or one of its '
                f"speeds{did_you_mean(str(name), every)}"
            )
    amplitudes = {x: _amplitude(f'friction["{x}"]', value) for x, value in given.items()}
    return lambda speed: next(
        (amplitudes[name] for name in known[speed] if name in amplitudes), None
    )


def _names(speed: str) -> tuple[str, str, str]:
    """Names accepted for the friction of a speed: the speed, its hinge, the chain of the hinge."""
    hinge = speed.rpartition(".")[0]
    return speed, hinge, hinge.partition("[")[0]


def _amplitude(what: str, value: float) -> float:
    amplitude = finite_float(what, value, "an amplitude of speed in rad/s or m/s, such as 0.1")
    if amplitude <= 0:
        raise SceneError(
            f"{what} = {amplitude:g}: expected an amplitude of speed above 0 in rad/s or m/s; "
            "leave it out for a model without dry friction"
        )
    return amplitude
