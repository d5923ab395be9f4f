"""Certificate of a run: what its numbers themselves say about how far they can be trusted."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mstmm.scene import Hinge, Scene

from .conditioning import LARGEST, PivotLoss, SingularDistance, pivot_loss, singular_distance
from .error_estimate import ANGLE, PART, SAFETY, ErrorEstimate
from .flexible.results import certify
from .flexible.results.certify import Flexibility
from .flexible.results.observe_momentum import undeformed
from .stability import StepCheck

if TYPE_CHECKING:
    from .result import Result

Array = NDArray[np.float64]

#: Relative drift of energy or momentum, pivot loss and singular measure that bring a warning.
DRIFT, LOSS, SINGULAR = 1e-5, 1e8, 1e-3

#: A hinge load counts as zero below this part of the largest one.
_ZERO = 1e-9

#: Part of the stored energy against which rounding is judged where hardly anything moves.
_AT_REST = 1e-8

#: Bodies that are looked at to learn how far a scene reaches.
_SOME = 30


@dataclass(frozen=True)
class Drift:
    """Largest change of a quantity that should not change, beside the scale it is judged by."""

    name: str
    unit: str
    largest: float
    scale: float
    of_what: str

    @property
    def relative(self) -> float:
        """largest / scale; 0 where both vanish."""
        if self.scale > 0:
            return self.largest / self.scale
        return np.inf if self.largest > 0 else 0.0

    def __str__(self) -> str:
        text = f"{self.largest:.1e} {self.unit} of {self.scale:.3g} {self.unit} {self.of_what}"
        return f"{text} ({self.relative:.1e})"


@dataclass(frozen=True)
class Certificate:
    """What vouches for a run.

    Attributes:
        energy: residual of kinetic + potential energy - work (J), against the energy exchanged.
        momentum: drift of every component of linear and angular momentum that is conserved.
        quaternion_residual: largest | |quaternion| - 1 | in the samples before they were settled.
        pivot: the worst loss of digits in the sweep: about 1e-16 times its ratio.
        singular: the closest approach to coordinates that fail (gimbal).
        step: the fixed step against the fastest motion at the start; None for adaptive runs.
        stability_limited: the method's stability, not its accuracy, set many of the steps.
        sum_of_local_errors: in the mixed units of q and u; NOT the error of the result, which may
            be larger by any factor.
        error: estimate of the error from a second run; None unless asked for (certify=True).
        finite: every number of q and u is finite.
        too_large: the scene has too many bodies for the pivots to be looked at.
        samples: how many samples there are; balances need two.
        end: the run's own message.
        flexible: how far the model of each flexible body was from the end of its range.
    """

    energy: Drift
    momentum: tuple[Drift, ...]
    quaternion_residual: float
    pivot: PivotLoss | None
    singular: SingularDistance | None
    step: StepCheck | None
    stability_limited: bool
    sum_of_local_errors: float | None
    error: ErrorEstimate | None
    finite: bool
    end: str
    too_large: bool = False
    samples: int = 2
    flexible: tuple[Flexibility, ...] = ()

    @property
    def warnings(self) -> tuple[str, ...]:
        """What speaks against the numbers, one sentence each; empty for a clean run."""
        return tuple(_warnings(self))

    @property
    def predictable_until(self) -> float | None:
        """Time (s) after which two accurate runs part; None if they do not, or were not made."""
        return None if self.error is None else self.error.horizon

    def __str__(self) -> str:
        few = "not determined: one sample tells of no change; ask for more output times"
        balance = few if self.samples < 2 else str(self.energy)
        rows = [("run", self.end), ("energy balance", balance)]
        rows += [(f"{d.name}", str(d)) for d in self.momentum]
        if self.quaternion_residual:
            rows.append(("quaternion length", f"within {self.quaternion_residual:.1e} of 1"))
        if self.pivot is not None:
            rows.append(("pivot ratio", f'{self.pivot.ratio:.1e} at hinge "{self.pivot.hinge}"'))
        elif self.too_large:
            rows.append(("pivot ratio", f"not computed for more than {LARGEST} bodies"))
        if self.singular is not None:
            rows.append(
                ("singular angle", f'{self.singular.measure:.1e} at "{self.singular.hinge}"')
            )
        if self.step is not None:
            rows.append(("h |lambda| at the start", f"{self.step.product:.3g}"))
        if self.sum_of_local_errors is not None:
            rows.append(("sum of local errors", f"{self.sum_of_local_errors:.1e} (not the error)"))
        rows += certify.rows(self.flexible)
        rows += _error_rows(self.error)
        rows += [("warning", text) for text in self.warnings]
        width = max(len(name) for name, _ in rows)
        return "\n".join(f"{name.ljust(width)}  {text}" for name, text in rows)


def certificate(result: Result, error: ErrorEstimate | None, step: StepCheck | None) -> Certificate:
    """The certificate of a result; `error` and `step` are what only the run itself could tell."""
    run, statistics = result.trajectory, result.statistics
    return Certificate(
        _energy(result), tuple(_momentum(result)), run.norm_residual,
        pivot_loss(result.model, run), singular_distance(result.model, run), step,
        statistics is not None and statistics.stability_limited,
        None if statistics is None else statistics.sum_local_error, error,
        bool(np.isfinite(run.q).all() and np.isfinite(run.u).all()), run.message,
        len(result.model.scene.bodies) > LARGEST, len(result.t),
        certify.flexibilities(result._flexible),
    )  # fmt: skip


def _largest(values: Array) -> float:
    return float(np.max(np.abs(values[np.isfinite(values)]), initial=0.0))


# --- balances -------------------------------------------------------------------------------------


def _energy(result: Result) -> Drift:
    """T + V - W against the largest sum of what was exchanged: T, changes of V, W.

    At rest under load nothing is exchanged: then against a part of what is stored.
    """
    parts, work = result.energies(), result.work
    residual = sum(parts.values(), -work)
    exchanged = parts["kinetic"] + np.abs(work)
    for name in ("gravity", "springs"):
        exchanged = exchanged + np.abs(parts[name] - parts[name][:1])
    start = residual[:1]
    stored = _largest(np.abs(parts["gravity"]) + np.abs(parts["springs"]))
    scale = max(_largest(exchanged), _AT_REST * stored)
    return Drift("energy", "J", _largest(residual - start), scale, "exchanged")


def _momentum(result: Result) -> list[Drift]:
    """Drift of the components of momentum that nothing outside the scene changes.

    Components that are zero throughout are left out.  Scales: sqrt(2 m T), and the larger of the
    largest angular momentum and that times the scene's reach.
    """
    scene, found = result.model.scene, list[Drift]()
    flexible = result.model.flexible
    dragged = any(body.drag is not None for body in flexible.values())
    if not len(result.t) or dragged or not _isolated(scene):
        return found
    bodies = scene.skeleton.bodies
    some = range(0, len(bodies), max(1, len(bodies) // _SOME))
    names = [bodies.name(i) for i in some]
    result._observed.fetch(names)
    reach = max((_largest(result.position(name)) for name in names), default=0.0)
    force, moment = _support(result, reach)
    kinetic = np.sqrt(2 * _largest(result.energies()["kinetic"]))
    mass = sum(body.mass for body in scene.body)
    mass += sum(chain.body_of(k).mass for chain in scene.chain for k in range(chain.count))
    mass += sum(undeformed(body)[0] for body in flexible.values())
    linear, angular = result.momentum(), result.angular_momentum()
    speed = kinetic * np.sqrt(mass)
    scale = max(_largest(np.linalg.norm(angular, axis=1)), speed * reach)
    for k, axis in enumerate("xyz"):
        others = [g for j, g in enumerate(scene.gravity) if j != k]
        if scene.gravity[k] == 0 and force[k] and linear[:, k].any():
            drift = _largest(linear[:, k] - linear[0, k])
            found.append(Drift(f"momentum {axis}", "kg*m/s", drift, speed, "that moves"))
        if not any(others) and moment[k] and angular[:, k].any():
            drift = _largest(angular[:, k] - angular[0, k])
            name = f"angular momentum {axis}"
            found.append(Drift(name, "kg*m2/s", drift, scale, "that turns"))
    return found


def _isolated(scene: Scene) -> bool:
    """Nothing but hinges and gravity acts between the scene and the ground."""
    loads = any(not e.is_zero for load in scene.load for e in (*load.force, *load.moment))
    springs = any("ground" in (spring.from_, spring.to) for spring in scene.spring)
    return not loads and not springs and all(_passive(hinge) for hinge in _roots(scene))


def _roots(scene: Scene) -> list[Hinge]:
    """Hinges on the ground."""
    firsts = zip(scene.chain, scene.hinges.starts, strict=False)
    return [
        *(hinge for hinge in scene.hinge if hinge.inboard_body == "ground"),
        *(scene.hinges[first] for chain, first in firsts if chain.inboard == "ground"),
    ]


def _passive(hinge: Hinge) -> bool:
    acts = any(
        e.stiffness or e.damping or not e.effort.is_zero or e.inertia
        or e.friction.acts or e.limits.acts
        for e in hinge.law.entries()
    )  # fmt: skip
    return not acts and hinge.drive is None and hinge.release is None


def _support(result: Result, reach: float) -> tuple[list[bool], list[bool]]:
    """Which components of force, and of moment about the origin, the ground never passes on."""
    scene = result.model.scene
    roots = _roots(scene)
    if all(hinge.type in ("free", "elastic") for hinge in roots):  # passive ones: rounding only
        return [True] * 3, [True] * 3
    force, moment = np.zeros((len(result.t), 3)), np.zeros((len(result.t), 3))
    largest = list(result._observed.largest_loads())
    largest[1] += largest[0] * reach
    for hinge in roots:
        f = result.force(hinge.name)
        force = force + f
        place = result.position(hinge.outboard)
        moment = moment + result.moment(hinge.name) + np.cross(place, f)
    zero = [[_largest(x[:, k]) <= _ZERO * size for k in range(3)]
            for x, size in zip((force, moment), largest, strict=True)]  # fmt: skip
    return zero[0], zero[1]


# --- words ----------------------------------------------------------------------------------------


def _warnings(c: Certificate) -> list[str]:
    found = [] if c.finite else ["the states hold numbers that are not finite"]
    found += [
        f"{d.name} is not kept: it changes by {d}; the tolerance or the step is too coarse"
        for d in (c.energy, *c.momentum)
        if d.relative > DRIFT
    ]
    if c.pivot is not None and c.pivot.ratio > LOSS:
        found.append(
            f'hinge "{c.pivot.hinge}" carries {c.pivot.ratio:.0e} times what its motion feels (a '
            f"heavy body behind light ones): accelerations may err by {1e-16 * c.pivot.ratio:.0e} "
            "of their size; where the root is free, make the heavy body the first one"
        )
    if c.singular is not None and c.singular.measure < SINGULAR:
        found.append(
            f'hinge "{c.singular.hinge}" comes within {c.singular.measure:.0e} of the angle '
            f"at which its coordinates fail, at t = {c.singular.time:.6g} s; use a ball hinge"
        )
    if c.step is not None and c.step.warning:
        found.append(c.step.warning)
    if c.stability_limited:
        found.append(
            "many steps were as long as the stability of the explicit method allows: the scene is "
            "stiff for it (scipy-Radau or scipy-BDF may be faster), or the fixed step is too long"
        )
    return found + certify.warnings(c.flexible)


def _error_rows(error: ErrorEstimate | None) -> list[tuple[str, str]]:
    if error is None:
        return [("error", "not estimated (certify=True makes a second run)")]
    rows = []
    until = "" if error.horizon is None else f" up to t = {error.horizon:.6g} s"
    for kind in ("q", "u"):
        values = ", ".join(f"{v:.1e} {unit or '1'}" for unit, v in error.largest(kind).items())
        if values:
            about = f" (from a second run, {error.reference})" if kind == "q" else ""
            rows.append((f"error of {kind}, at most", f"{values}{until}{about}"))
    if error.horizon is not None:
        rows.append((
            "predictable until",
            f"t = {error.horizon:.6g} s: later the two runs differ by more than {ANGLE:g} rad or "
            f"{PART:.0%} of the motion, and errors have no meaning",
        ))  # fmt: skip
    if error.tenfold is not None:
        rows.append(("growth of errors", f"tenfold every {error.tenfold:.3g} s"))
    return rows


__all__ = ["SAFETY", "Certificate", "Drift", "certificate"]
