"""Energy and momentum balances of a run.

Energy less work, and momentum without external loads, should stay constant.  Their drift is
not the error of the motion, but it reveals wrong steps and wrong laws.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from mstmm.arrays import Array
from mstmm.scene import Hinge, Scene

from .blows import kept_by_blows
from .evidence import Drift
from .flexible.momentum import undeformed
from .record import Record

#: A hinge load counts as zero below this part of the largest one.
_ZERO = 1e-9

#: Fraction of the stored energy that serves as scale where hardly anything moves.
_AT_REST = 1e-8

#: Height differences (m) below this are rounding.
_HEIGHT = 1e-15

#: Maximum number of bodies sampled to estimate the extent of a scene.
_SOME = 30


def _largest(values: Array) -> float:
    return float(np.max(np.abs(values[np.isfinite(values)]), initial=0.0))


def _change(values: Array) -> float:
    """Largest change (n,) from the first sample, of those that can be evaluated; nan where one of
    them is beyond what numbers hold, or none is left."""
    known = values[~np.isnan(values)]
    if not len(known) or not np.isfinite(known).all():
        return np.nan
    return float(np.max(np.abs(known - known[0])))


# --- energy ---------------------------------------------------------------------------------------


def energy(result: Record) -> Drift:
    """Drift of T + V - W relative to the largest energy exchanged: T, changes of V, W.

    At rest under load nothing is exchanged: then against a part of what is stored, or against what
    rounding of places is worth to gravity.
    """
    parts, work = result.energies(), result.work
    with np.errstate(all="ignore"):  # the residual shows an overflow
        residual = sum(parts.values(), -work)
        overflows = any(np.isinf(part).any() for part in (*parts.values(), work))
        exchanged = parts["kinetic"] + np.abs(work)
        for name in ("gravity", "springs"):
            exchanged = exchanged + np.abs(parts[name] - parts[name][:1])
    rounding = _HEIGHT * _mass(result) * float(np.linalg.norm(result.model.scene.gravity))
    scale = max(_largest(exchanged), _AT_REST * _stored(parts), rounding)
    change = np.nan if overflows else _change(residual)
    return Drift("energy", "J", change if len(residual) else 0.0, scale, "exchanged")


def _mass(result: Record) -> float:
    """Total moving mass, kg."""
    scene = result.model.scene
    mass = sum(body.mass for body in scene.body)
    mass += sum(chain.body_of(k).mass for chain in scene.chain for k in range(chain.count))
    return mass + sum(undeformed(body)[0] for body in result.model.flexible.values())


def _stored(parts: Mapping[str, Array]) -> float:
    """Largest stored energy of gravity and springs, J."""
    with np.errstate(all="ignore"):
        return _largest(np.abs(parts["gravity"]) + np.abs(parts["springs"]))


# --- momentum -------------------------------------------------------------------------------------


def momentum(result: Record) -> list[Drift]:
    """Drifts of the momentum components that no external load changes.

    Components that are zero throughout, and those that a blow may have changed, are left out.
    Angular momentum is taken about the origin, or about the one point of the ground through which a
    scene is held.  Scales: sqrt(2 m T), at rest with a part of what is stored for T, and the larger
    of the largest angular momentum and that times the scene's reach.
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
    pivot, about = _pivot(result, reach)
    reach = max((_largest(result.position(name) - pivot) for name in names), default=0.0)
    kinetic = _largest(result.energies()["kinetic"])
    mass = _mass(result)
    linear, angular = result.momentum(), result.angular_momentum()
    angular = angular - np.cross(pivot, linear)
    asked = np.array(_support(result, reach, kinetic, pivot)) & _unweighted(scene)
    asked &= np.array([linear.any(axis=0), angular.any(axis=0)])
    asked = kept_by_blows(result, _roots(scene), pivot, asked.ravel()).reshape(2, 3)
    speed = np.sqrt(2 * max(kinetic, _AT_REST * _stored(result.energies()))) * np.sqrt(mass)
    scale = max(_largest(np.linalg.norm(angular, axis=1)), speed * reach)
    for k, axis in enumerate("xyz"):
        if asked[0, k]:
            change = _change(linear[:, k])
            found.append(Drift(f"momentum {axis}", "kg*m/s", change, speed, "that moves"))
        if asked[1, k]:
            name, change = f"angular momentum {axis}{about}", _change(angular[:, k])
            found.append(Drift(name, "kg*m2/s", change, scale, "that turns"))
    return found


def _unweighted(scene: Scene) -> NDArray[np.bool_]:
    """Axes (2, 3) along which gravity has no force, and about which it has no moment."""
    still = np.array(scene.gravity) == 0
    return np.array([still, [still[[1, 2]].all(), still[[0, 2]].all(), still[[0, 1]].all()]])


def _isolated(scene: Scene) -> bool:
    """Whether only uncoupled hinges and gravity act between the scene and the ground."""
    loads = any(
        not e.is_zero
        for load in scene.load
        for e in (*load.force, *load.moment, *(load.force_per_length or ()))
    )
    joined = (*scene.forces, *scene.constraint)
    coupled = {name.hinge for coupling in scene.coupling for name in coupling.names}
    roots = _roots(scene)
    return (
        not loads
        and not any("ground" in (one.from_, one.to) for one in joined)
        and not any(hinge.name in coupled for hinge in roots)
        and all(_passive(hinge) for hinge in roots)
    )


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


def _pivot(result: Record, reach: float) -> tuple[Array, str]:
    """The point (3,) about which angular momentum is taken, and how its name says so.

    The point of the only hinge on the ground, where it stays; else the origin.
    """
    roots = _roots(result.model.scene)
    if len(roots) == 1 and not _carries_nothing(roots[0]):
        places = result.position(roots[0].outboard)
        place, size = places[0], reach + _largest(places[0])
        if np.isfinite(place).all() and _largest(places - place) <= _ZERO * size:
            return place, f' about "{roots[0].name}"' if place.any() else ""
    return np.zeros(3), ""


def _carries_nothing(hinge: Hinge) -> bool:
    """Whether a hinge transmits no load other than that of its law."""
    return hinge.facts is not None and hinge.facts.free_body


def _support(
    result: Record, reach: float, kinetic: float, pivot: Array
) -> tuple[list[bool], list[bool]]:
    """Which components of force, and of moment about the pivot, the ground never passes on.

    Judged against the largest loads of the scene and against its motion, whose kinetic energy is
    what moments turn and forces move: where nothing else acts, loads are rounding.
    """
    scene = result.model.scene
    roots = _roots(scene)
    if all(map(_carries_nothing, roots)):
        return [True] * 3, [True] * 3
    force, moment = np.zeros((len(result.t), 3)), np.zeros((len(result.t), 3))
    largest = result._observed.largest_loads()
    sizes = (
        max(largest[0], kinetic / reach if reach > 0 else 0.0),
        max(largest[1] + largest[0] * reach, kinetic),
    )
    for hinge in roots:
        f = result.force(hinge.name)
        force = force + f
        place = result.position(hinge.outboard) - pivot
        moment = moment + result.moment(hinge.name) + np.cross(place, f)
    zero = [[_largest(x[:, k]) <= _ZERO * size for k in range(3)]
            for x, size in zip((force, moment), sizes, strict=True)]  # fmt: skip
    return zero[0], zero[1]
