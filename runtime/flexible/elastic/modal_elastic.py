"""General elastic bodies of a scene -> modal bodies: read, checked, reduced, integrated.

Floating-frame description with the shapes of a finite-element model (Rui, Wang, Zhang, section 8.2,
(8.20) to (8.24)).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import lru_cache
from math import prod
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from mstmm.array_validation import Array
from mstmm.numerics.rotations import from_orientation
from mstmm.scene.checks.topology import inboard_hinges_by_body
from mstmm.scene.tables.hinge_frames import initial_motion_axes
from mstmm.scene.validators.scalars_and_vectors import GROUND, split_reference

from ...platform_support.subprocess_call import run_in_subprocess
from ..mass_definiteness import is_definite_with_first_shape, is_mass_definite
from ..modal_body import ModalBody
from ..modal_port import ModalPort
from ..numerical_checks import checked_result
from ..support_motion import Supports
from .craig_bampton import Reduction, Release, reduce, resolution
from .field_moments import field_moments
from .finite_element_model import ElasticModel
from .geometric_stiffness import SecondOrder, second_order_moments, truncation
from .interface_nodes import Port, check_separate_nodes, select_port
from .matrices import from_arrays, load_matrices, save_matrices
from .matrix_checks import check_matrices
from .mesh import Material, box_mesh, check_element_count, mesh_model, read_mesh
from .surface_mesh import skin

if TYPE_CHECKING:
    from mstmm.scene import Hinge, Scene
    from mstmm.scene.tables.elastic import Elastic
    from mstmm.scene.tables.law import LawEntry

__all__ = [
    "elastic_bodies", "elastic_body", "elastic_model", "modal_body", "rigid_inertia_and_ends",
    "save_matrices",
]  # fmt: skip

T = TypeVar("T")

#: Fixed-interface modes where the scene leaves their number open.
AUTO_MODES = 4
#: Bodies whose numbers are kept.
KEPT = 8
#: Unknowns, about, from which numbers are found by a process that can be interrupted: some tenths
#: of a second of factorisation.
LONG = 6000
#: Entries below this part of the largest of their kind are rounding, and become exact zeros.
_ROUNDING = 1e-10


def elastic_bodies(scene: Scene) -> dict[str, ModalBody]:
    """The modal body of every [[elastic]] table but those with model = "rigid", in the order of
    the scene.

    Raises SceneError for files and matrices that describe no free elastic body and for ends off the
    mesh, EnvironmentFailure where a mesh needs the extra `fem`.
    """
    return {e.name: modal_body(e, scene) for e in scene.elastic if e.model != "rigid"}


def modal_body(elastic: Elastic, scene: Scene) -> ModalBody:
    """The modal body of one [[elastic]] table of a scene, whatever its model.

    The last few are kept: a scene is compiled again for other parameters of other bodies.
    """
    holder = _holder(elastic.name, scene)
    held = holder.outboard_end if holder is not None else next(iter(elastic.ends))
    used = frozenset(_used(elastic.name, scene) | {held})
    source, (frame, why) = _Source(elastic), _frame(elastic, holder, held)
    free = _freedom(elastic.name, held, holder, scene)
    body = _made(source, held, used, free, frame, why)
    if elastic.frame != "auto" or frame == "mean" or _stays_definite(body, held, scene):
        return body
    turns, support = _turns(body), Supports(scene).of(body.name)
    natural = frame if is_definite_with_first_shape(body, held, support, turns) else ""
    why = "mean, because the mass matrix stays definite there"
    why += f", {natural} with fewer shapes" if natural else ""
    return replace(_made(source, held, used, free, "mean", why), unmoved_frame=natural)


def _stays_definite(body: ModalBody, held: str, scene: Scene) -> bool:
    return is_mass_definite(body, body.ports[held], Supports(scene).of(body.name), _turns(body))


def _turns(body: ModalBody) -> Array:
    """(ports, 3, n) rotations of the sections, per mode."""
    return np.stack([one.theta for one in body.ports.values()])


class _Source:
    """A table and the file it names, equal where both are the same."""

    def __init__(self, elastic: Elastic) -> None:
        self.elastic = elastic
        path = Path(elastic.matrices or elastic.mesh or "")
        stamp = path.stat() if path.is_file() else None
        file = None if stamp is None else (stamp.st_mtime_ns, stamp.st_size)
        self._key = (elastic.model_dump_json(), str(path.absolute()), file)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Source) and self._key == other._key

    def __hash__(self) -> int:
        return hash(self._key)


@lru_cache(maxsize=KEPT)
def _made(
    source: _Source, held: str, used: frozenset[str], free: Freedom, frame: str, why: str
) -> ModalBody:
    elastic = source.elastic
    where = f'elastic "{elastic.name}"'
    return checked_result(
        where, lambda: _maybe_apart(_reduced, elastic, held, used, free, frame, why)
    )


def _maybe_apart(work: Callable[..., T], elastic: Elastic, *arguments: Any) -> T:
    """work(elastic, *arguments), by a process of its own where that may take long."""
    if _unknowns(elastic) < LONG:
        return work(elastic, *arguments)
    return run_in_subprocess(f'elastic "{elastic.name}"', work, elastic, *arguments)


def _unknowns(elastic: Elastic) -> float:
    """Unknowns of a body, roughly and before anything is read or made."""
    if elastic.box is not None:
        return 12.0 * prod(elastic.box.divisions)
    if elastic.arrays is not None:
        return float(np.shape(elastic.arrays.nodes)[0] * 3)
    path = Path(elastic.matrices or elastic.mesh or "")
    return path.stat().st_size / 50 if path.is_file() else 0.0


def _reduced(
    elastic: Elastic, held: str, used: frozenset[str], free: Freedom, frame: str, why: str
) -> ModalBody:
    model = elastic_model(elastic)
    ports = []
    for name, end in elastic.ends.items():
        loaded = name in used if end.static_shapes is None else end.static_shapes
        ports.append(select_port(model, name, end, loaded or name == held))
    modes = AUTO_MODES if elastic.modes is None else elastic.modes
    notes = [f"frame: {why}"]
    if elastic.modes is None:
        notes.append(f"modes: {modes} vibration modes")
    return elastic_body(
        elastic.name, model, ports, held, modes, frame, release=_release(elastic, held, free),
        highest=elastic.highest_frequency, stiffening=elastic.stiffening,
        damping=elastic.damping, start=elastic.initial, notes=notes,
    )  # fmt: skip


#: (translation, rotation) per speed that a hinge leaves free, outboard axes, and whether something
#: acts along it.
Freedom = tuple[tuple[tuple[float, ...], bool], ...]


def _freedom(name: str, held: str, holder: Hinge | None, scene: Scene) -> Freedom:
    """What the hinge of a body leaves free; nothing where that is not known or may change."""
    released = {event.hinge for event in scene.event}
    if holder is None or holder.lets_go or holder.name in released:
        return ()
    loaded = held in _used(name, scene, but=holder)
    coupled = any(holder.name in one.parts for c in scene.coupling for one in c.names)
    drive, motions = holder.drive or (), initial_motion_axes(holder) or ()
    return tuple(
        ((*translation, *rotation), loaded or coupled or _acts(holder.law.entry(k)))
        for k, (translation, rotation) in enumerate(motions)
        if k >= len(drive) or drive[k] is None
    )


def _acts(law: LawEntry) -> bool:
    """Whether a law ever gives an effort."""
    numbers = law.stiffness, law.damping, law.inertia
    return any(numbers) or not law.effort.is_zero or law.friction.acts or law.limits.acts


def _release(elastic: Elastic, held: str, free: Freedom) -> Release:
    turn = np.array(from_orientation(elastic.ends[held].orientation))
    twists = [(np.array(twist).reshape(2, 3) @ turn.T).reshape(6) for twist, _ in free]
    loaded = [twist for twist, (_, acts) in zip(twists, free, strict=True) if acts]
    return Release(*(np.array(some).reshape(-1, 6).T for some in (twists, loaded)))


def rigid_inertia_and_ends(elastic: Elastic) -> tuple[Array, dict[str, Port]]:
    """(6, 6) inertia about the origin and the ends of an [[elastic]] table, without any shapes."""
    return _maybe_apart(_rigid, elastic)


def _rigid(elastic: Elastic) -> tuple[Array, dict[str, Port]]:
    model = elastic_model(elastic)
    ends = {name: select_port(model, name, end, False) for name, end in elastic.ends.items()}
    return model.inertia, ends


def elastic_model(elastic: Elastic) -> ElasticModel:
    """The checked matrices of an [[elastic]] table."""
    where = f'elastic "{elastic.name}"'
    if elastic.matrices is not None:
        path = Path(elastic.matrices)
        return check_matrices(load_matrices(path, f"{where} ({path.name})"))
    if elastic.arrays is not None:
        a = elastic.arrays
        return check_matrices(
            from_arrays(where, a.mass, a.stiffness, a.nodes, a.scalar_mass, a.order)
        )
    if elastic.mesh is not None:
        mesh = read_mesh(Path(elastic.mesh), where, elastic.scale or 1.0)
    else:
        assert elastic.box is not None
        check_element_count(prod(elastic.box.divisions), True, elastic.order or 2, where)
        mesh = box_mesh(elastic.box.size, elastic.box.divisions, elastic.box.corner)
    assert elastic.young is not None and elastic.density is not None
    material = Material(elastic.young, elastic.poisson or 0.0, elastic.density)

    def look(outline: ElasticModel) -> None:
        for name, end in elastic.ends.items():
            select_port(outline, name, end, False)

    return check_matrices(mesh_model(mesh, material, elastic.order or 2, where, look))


def _holder(name: str, scene: Scene) -> Hinge | None:
    """The hinge that holds the body."""
    return inboard_hinges_by_body(scene).get(name)


def _used(name: str, scene: Scene, but: Hinge | None = None) -> set[str]:
    """Ends on which a hinge (`but` for one), a chain, a load, a spring or a constraint acts."""
    references = [
        reference for hinge in scene.hinge if hinge is not but
        for reference in (hinge.inboard, hinge.outboard)
    ]  # fmt: skip
    references += [chain.inboard for chain in scene.chain] + [load.on for load in scene.load]
    acting = (*scene.forces, *scene.constraint)
    references += [reference for one in acting for reference in (one.from_, one.to)]
    return {at for body, at in map(split_reference, references) if body == name and body != GROUND}


def _frame(elastic: Elastic, holder: Hinge | None, held: str) -> tuple[str, str]:
    """The frame and why: a hinge that leaves rotations free should not hold the frame's section."""
    if elastic.frame != "auto":
        return elastic.frame, f"{elastic.frame}, as given"
    if holder is not None and prescribes_rotation(holder):
        return "tangent", f'tangent at "{held}", which hinge "{holder.name}" turns with it'
    what = "no hinge holds it" if holder is None else f'hinge "{holder.name}" lets it turn freely'
    return "mean", f"mean, because {what}"


def prescribes_rotation(hinge: Hinge) -> bool:
    """True if the hinge prescribes every rotation of its outboard side for all time."""
    if hinge.facts is not None and not hinge.facts.turns:
        return not hinge.lets_go
    driven = hinge.drive is not None and all(entry is not None for entry in hinge.drive)
    return driven and not hinge.lets_go


def elastic_body(
    name: str,
    model: ElasticModel,
    ports: Sequence[Port],
    held: str,
    modes: int,
    frame: str = "tangent",
    *,
    highest: float | None = None,
    stiffening: bool = True,
    damping: Any = None,
    start: Any = None,
    notes: Sequence[str] = (),
    release: Release | None = None,
) -> ModalBody:
    """The modal body of a checked model.

    Args:
        ports: every end; `held` names the one that the inboard hinge holds.
        modes: vibration modes besides six static shapes per loaded end but the held one.
        release: what the inboard hinge leaves free at the held end; None for nothing.
        frame: "tangent" (at the held end) or "mean".
        highest: shapes above this frequency in rad/s are left out.
        stiffening: with the stiffness that stresses bring, where the model knows stresses.
        damping: `.ratio` (one, or one per shape) and `.stiffness` (s), see the scene's table.
        start: `.eta`, `.etad` (None: zeros); a static start is found by whoever knows the loads.

    Modal coordinates are in m; modal masses equal the body's mass, K and Mff are diagonal.
    """
    ports = list(ports)
    check_separate_nodes(model, ports)
    holding = next(p for p in ports if p.name == held)
    reduction = reduce(model, ports, holding, modes, frame, highest, release)
    found = field_moments(model, reduction.shapes)
    K = np.diag(found.mass * reduction.frequencies**2)
    stiff = _stiffened(reduction, ports, stiffening)
    return ModalBody(
        name=name, modes=tuple(f"m{i + 1}" for i in range(len(K))),
        mass=found.mass, first=found.first, second=found.second,
        C=_clean(found.C), E=_clean(found.E), F=_clean(found.F),
        G=_clean(stiff.G), X=_clean(stiff.X), K=K,
        D=_damping(name, model, damping, K, found.mass, reduction.frequencies),
        ports={p.name: _port(reduction, p, stiff.ends[p.name]) for p in ports},
        eta=_start(model, start, "eta", len(K)), etad=_start(model, start, "etad", len(K)),
        skin=skin(model, reduction.shapes),
        frame=frame, notes=(*notes, *_notes(model, reduction, stiffening), found.how),
        warnings=model.warnings, resolved=resolution(reduction, release),
        truncation=truncation(reduction, ports),
    )  # fmt: skip


def _stiffened(reduction: Reduction, ports: list[Port], stiffening: bool) -> SecondOrder:
    if stiffening:
        return second_order_moments(reduction, ports)
    n = reduction.shapes.shape[1]
    none = {port.name: np.zeros((6, n, n)) for port in ports}
    return SecondOrder(np.zeros((3, n, n)), np.zeros((3, 3, n, n)), none)


def _notes(model: ElasticModel, reduction: Reduction, stiffening: bool) -> list[str]:
    lowest, top = reduction.frequencies[0], reduction.frequencies[-1]
    kind = "of the body as its hinge holds it" if reduction.released else "fixed-interface"
    notes = [
        *model.notes,
        f"shapes: {reduction.static} static and {reduction.fixed} {kind}, orthogonal, "
        f"{lowest:.6g} to {top:.6g} rad/s",
    ]
    if len(reduction.left_out):
        notes.append(f"left out: {len(reduction.left_out)} shapes above {top:.6g} rad/s")
    if stiffening and model.stress is None:
        notes.append("no geometric stiffening: mass and stiffness matrices do not hold it")
    return notes


def _port(reduction: Reduction, port_: Port, second: Array) -> ModalPort:
    motion = reduction.motion(port_)
    if reduction.frame == "tangent" and port_ is reduction.held:
        motion = np.zeros_like(motion)
    return ModalPort(
        position=port_.position, rotation=port_.rotation, phi=_clean(motion[:3]),
        theta=_clean(motion[3:]), second_order=_clean(second),
    )  # fmt: skip


def _clean(values: Array) -> Array:
    """Values with rounding replaced by exact zeros, so that code made of them folds."""
    largest = float(np.max(np.abs(values), initial=0.0))
    return np.where(np.abs(values) <= _ROUNDING * largest, 0.0, values)


def _damping(
    name: str, model: ElasticModel, damping: Any, K: Array, mass: float, frequencies: Array
) -> Array:
    """D = tau K + 2 zeta omega m."""
    if damping is None:
        return np.zeros_like(K)
    ratios = np.asarray(damping.ratio, dtype=float)
    if len(ratios) not in (1, len(K)):
        raise model.refuse(
            f"damping: expected one ratio, or one for each of {len(K)} shapes, found {len(ratios)}"
        )
    return np.asarray(damping.stiffness * K + np.diag(2 * ratios * frequencies * mass))


def _start(model: ElasticModel, start: Any, key: str, n: int) -> Array:
    values = None if start is None else getattr(start, key)
    if values is None:
        return np.zeros(n)
    if len(values) != n:
        raise model.refuse(
            f"initial.{key}: expected {n} numbers, one per shape (static and fixed-interface), "
            f"found {len(values)}"
        )
    return np.asarray(values, dtype=float)
