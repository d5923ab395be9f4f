"""Modal bodies of the [[elastic]] tables of a scene: read, checked, reduced, integrated.

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

from ...platform_support.subprocesses import run_in_subprocess
from ..mass_definiteness import is_definite_with_first_shape, is_mass_definite
from ..modal_body import ModalBody, checked_result
from ..modal_parts import CacheKey, ModalPort
from ..supports import Supports
from .craig_bampton import Reduction, Release, reduce, resolution
from .finite_element_model import ElasticModel
from .interface_nodes import Port, check_separate_nodes, select_port
from .matrices import check_matrices, from_arrays, load_matrices, save_matrices
from .mesh import Material, box_mesh, check_element_count, mesh_model, read_mesh
from .shape_moments import SecondOrder, field_moments, second_order_moments, truncation
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

#: Number of vibration modes for modes = "auto".
AUTO_MODES = 4
#: Number of cached bodies.
MAX_CACHED_BODIES = 8
#: Approximate number of unknowns from which a body is computed in a subprocess, which can be
#: interrupted: some tenths of a second of factorisation.
SUBPROCESS_UNKNOWNS = 6000
#: Entries below this share of the largest one are rounding, and are set to zero.
_ROUNDING = 1e-10


def elastic_bodies(scene: Scene) -> dict[str, ModalBody]:
    """Modal bodies by name of all [[elastic]] tables except those with model = "rigid".

    Raises SceneError for files and matrices that do not describe a free elastic body and for ends
    outside the mesh, EnvironmentFailure if a mesh needs the extra `fem`.
    """
    return {e.name: modal_body(e, scene) for e in scene.elastic if e.model != "rigid"}


def modal_body(elastic: Elastic, scene: Scene) -> ModalBody:
    """Modal body of one [[elastic]] table of a scene, for any key `model`.

    The last few bodies are cached, because a scene is compiled again when other bodies change.
    """
    hinge = _inboard_hinge(elastic.name, scene)
    held = hinge.outboard_end if hinge is not None else next(iter(elastic.ends))
    loaded = frozenset(_loaded_ends(elastic.name, scene) | {held})
    source, (frame, reason) = _cache_key(elastic), _frame_and_reason(elastic, hinge, held)
    motions = _free_motions(elastic.name, held, hinge, scene)
    body = _cached_body(source, held, loaded, motions, frame, reason)
    if elastic.frame != "auto" or frame == "mean" or _stays_definite(body, held, scene):
        return body
    rotations, support = _port_rotations(body), Supports(scene).support_of(body.name)
    fewer_suffice = is_definite_with_first_shape(body, held, support, rotations)
    natural_frame = frame if fewer_suffice else ""
    reason = "mean, because the mass matrix stays definite there"
    reason += f", {natural_frame} with fewer shapes" if natural_frame else ""
    body = _cached_body(source, held, loaded, motions, "mean", reason)
    return replace(body, unmoved_frame=natural_frame)


def _stays_definite(body: ModalBody, held: str, scene: Scene) -> bool:
    support = Supports(scene).support_of(body.name)
    return is_mass_definite(body, body.ports[held], support, _port_rotations(body))


def _port_rotations(body: ModalBody) -> Array:
    """Rotation vectors (ports, 3, n) of the sections per mode, rad."""
    return np.stack([port.theta for port in body.ports.values()])


def _cache_key(elastic: Elastic) -> CacheKey[Elastic]:
    """Key of an [[elastic]] table and its file: equal if both are equal."""
    path = Path(elastic.matrices or elastic.mesh or "")
    stamp = path.stat() if path.is_file() else None
    file = None if stamp is None else (stamp.st_mtime_ns, stamp.st_size)
    return CacheKey((elastic.model_dump_json(), str(path.absolute()), file), elastic)


@lru_cache(maxsize=MAX_CACHED_BODIES)
def _cached_body(
    source: CacheKey[Elastic],
    held: str,
    loaded_ends: frozenset[str],
    motions: FreeMotions,
    frame: str,
    reason: str,
) -> ModalBody:
    elastic = source.value
    where = f'elastic "{elastic.name}"'
    return checked_result(
        where,
        lambda: _run_long_work(_reduced_body, elastic, held, loaded_ends, motions, frame, reason),
    )


def _run_long_work(work: Callable[..., T], elastic: Elastic, *arguments: Any) -> T:
    """Return work(elastic, *arguments), computed in a subprocess if it may take long."""
    if _estimated_unknowns(elastic) < SUBPROCESS_UNKNOWNS:
        return work(elastic, *arguments)
    return run_in_subprocess(f'elastic "{elastic.name}"', work, elastic, *arguments)


def _estimated_unknowns(elastic: Elastic) -> float:
    """Estimated number of unknowns of a body, before its data are read."""
    if elastic.box is not None:
        return 12.0 * prod(elastic.box.divisions)
    if elastic.arrays is not None:
        return float(np.shape(elastic.arrays.nodes)[0] * 3)
    path = Path(elastic.matrices or elastic.mesh or "")
    return path.stat().st_size / 50 if path.is_file() else 0.0


def _reduced_body(
    elastic: Elastic,
    held: str,
    loaded_ends: frozenset[str],
    motions: FreeMotions,
    frame: str,
    reason: str,
) -> ModalBody:
    model = elastic_model(elastic)
    ports = []
    for name, end in elastic.ends.items():
        loaded = name in loaded_ends if end.static_shapes is None else end.static_shapes
        ports.append(select_port(model, name, end, loaded or name == held))
    modes = AUTO_MODES if elastic.modes is None else elastic.modes
    notes = [f"frame: {reason}"]
    if elastic.modes is None:
        notes.append(f"modes: {modes} vibration modes")
    return elastic_body(
        elastic.name, model, ports, held, modes, frame, release=_release(elastic, held, motions),
        highest=elastic.highest_frequency, stiffening=elastic.stiffening,
        damping=elastic.damping, start=elastic.initial, notes=notes,
    )  # fmt: skip


#: (translation, rotation) per free speed of a hinge, outboard axes, and whether it is loaded.
FreeMotions = tuple[tuple[tuple[float, ...], bool], ...]


def _free_motions(name: str, held: str, hinge: Hinge | None, scene: Scene) -> FreeMotions:
    """Free motions of the inboard hinge of a body; none if not known or changing."""
    released = {event.hinge for event in scene.event}
    if hinge is None or hinge.is_released or hinge.name in released:
        return ()
    is_loaded = held in _loaded_ends(name, scene, excluded=hinge)
    is_coupled = any(
        hinge.name in quantity.parts for coupling in scene.coupling for quantity in coupling.names
    )
    drive, motions = hinge.drive or (), initial_motion_axes(hinge) or ()
    return tuple(
        ((*translation, *rotation), is_loaded or is_coupled or _has_effort(hinge.law.entry(k)))
        for k, (translation, rotation) in enumerate(motions)
        if k >= len(drive) or drive[k] is None
    )


def _has_effort(law: LawEntry) -> bool:
    """Whether a hinge law can give an effort."""
    numbers = law.stiffness, law.damping, law.inertia
    return any(numbers) or not law.effort.is_zero or law.friction.acts or law.limits.acts


def _release(elastic: Elastic, held: str, motions: FreeMotions) -> Release:
    rotation = np.array(from_orientation(elastic.ends[held].orientation))
    twists = [(np.array(twist).reshape(2, 3) @ rotation.T).reshape(6) for twist, _ in motions]
    loaded = [twist for twist, (_, acts) in zip(twists, motions, strict=True) if acts]
    return Release(*(np.array(columns).reshape(-1, 6).T for columns in (twists, loaded)))


def rigid_inertia_and_ends(elastic: Elastic) -> tuple[Array, dict[str, Port]]:
    """Spatial inertia (6, 6) about the origin, and ends by name, of an [[elastic]] table."""
    return _run_long_work(_rigid_inertia_and_ends, elastic)


def _rigid_inertia_and_ends(elastic: Elastic) -> tuple[Array, dict[str, Port]]:
    model = elastic_model(elastic)
    ends = {name: select_port(model, name, end, False) for name, end in elastic.ends.items()}
    return model.inertia, ends


def elastic_model(elastic: Elastic) -> ElasticModel:
    """Checked finite-element model of an [[elastic]] table."""
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

    def check_ends(outline: ElasticModel) -> None:
        for name, end in elastic.ends.items():
            select_port(outline, name, end, False)

    return check_matrices(mesh_model(mesh, material, elastic.order or 2, where, check_ends))


def _inboard_hinge(name: str, scene: Scene) -> Hinge | None:
    """Inboard hinge of a body; None for a free body."""
    return inboard_hinges_by_body(scene).get(name)


def _loaded_ends(name: str, scene: Scene, excluded: Hinge | None = None) -> set[str]:
    """Ends of a body with a hinge (other than `excluded`), chain, load, spring or constraint."""
    references = [
        reference for hinge in scene.hinge if hinge is not excluded
        for reference in (hinge.inboard, hinge.outboard)
    ]  # fmt: skip
    references += [chain.inboard for chain in scene.chain] + [load.on for load in scene.load]
    elements = (*scene.forces, *scene.constraint)
    references += [reference for element in elements for reference in (element.from_, element.to)]
    ends = map(split_reference, references)
    return {end for body, end in ends if body == name and body != GROUND}


def _frame_and_reason(elastic: Elastic, hinge: Hinge | None, held: str) -> tuple[str, str]:
    """Kind of floating frame and the reason; mean for a hinge that leaves rotations free."""
    if elastic.frame != "auto":
        return elastic.frame, f"{elastic.frame}, as given"
    if hinge is not None and prescribes_rotation(hinge):
        return "tangent", f'tangent at "{held}", where hinge "{hinge.name}" fixes the rotation'
    free = f'hinge "{hinge.name}" lets it rotate freely' if hinge is not None else "it has no hinge"
    return "mean", f"mean, because {free}"


def prescribes_rotation(hinge: Hinge) -> bool:
    """Whether a hinge prescribes all rotations of its outboard end at all times."""
    if hinge.facts is not None and not hinge.facts.turns:
        return not hinge.is_released
    is_driven = hinge.drive is not None and all(entry is not None for entry in hinge.drive)
    return is_driven and not hinge.is_released


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
    """Modal body of a checked finite-element model.

    Args:
        ports: all ends; `held` is the name of that with the inboard hinge.
        modes: number of vibration modes, besides six static shapes per loaded end except `held`.
        release: free motions of the inboard hinge at the held end; None for none.
        frame: "tangent" (at the held end) or "mean".
        highest: shapes above this frequency in rad/s are left out.
        stiffening: with geometric stiffness, if the model has stresses.
        damping: `.ratio` (one, or one per shape) and `.stiffness` (s), see the scene's table.
        start: `.eta`, `.etad` (None: zeros); the caller computes a static start from the loads.

    Modal coordinates are in m; modal masses equal the body's mass, K and Mff are diagonal.
    """
    ports = list(ports)
    check_separate_nodes(model, ports)
    held_port = next(p for p in ports if p.name == held)
    reduction = reduce(model, ports, held_port, modes, frame, highest, release)
    integrals = field_moments(model, reduction.shapes)
    K = np.diag(integrals.mass * reduction.frequencies**2)
    eta, etad = (_initial_state(model, start, key, len(K)) for key in ("eta", "etad"))
    second_order = _second_order_terms(reduction, ports, stiffening)
    return ModalBody(
        name=name, modes=tuple(f"m{i + 1}" for i in range(len(K))),
        mass=integrals.mass, first=integrals.first, second=integrals.second,
        C=_clean(integrals.C), E=_clean(integrals.E), F=_clean(integrals.F),
        G=_clean(second_order.G), X=_clean(second_order.X), K=K,
        D=_damping(name, model, damping, K, integrals.mass, reduction.frequencies),
        ports={p.name: _port(reduction, p, second_order.ends[p.name]) for p in ports},
        eta=eta, etad=etad,
        skin=skin(model, reduction.shapes),
        frame=frame, notes=(*notes, *_notes(model, reduction, stiffening), integrals.how),
        warnings=model.warnings, resolved=resolution(reduction, release),
        truncation=truncation(reduction, ports),
    )  # fmt: skip


def _second_order_terms(reduction: Reduction, ports: list[Port], stiffening: bool) -> SecondOrder:
    if stiffening:
        return second_order_moments(reduction, ports)
    n = reduction.shapes.shape[1]
    zeros = {port.name: np.zeros((6, n, n)) for port in ports}
    return SecondOrder(np.zeros((3, n, n)), np.zeros((3, 3, n, n)), zeros)


def _notes(model: ElasticModel, reduction: Reduction, stiffening: bool) -> list[str]:
    lowest, top = reduction.frequencies[0], reduction.frequencies[-1]
    kind = "modes of the body with its hinge" if reduction.released else "fixed-interface modes"
    notes = [
        *model.notes,
        f"shapes: {reduction.static} static and {reduction.fixed} {kind}, orthogonal, "
        f"{lowest:.6g} to {top:.6g} rad/s",
    ]
    if len(reduction.left_out):
        notes.append(f"left out: {len(reduction.left_out)} shapes above {top:.6g} rad/s")
    if stiffening and model.stress is None:
        notes.append("no geometric stiffening: mass and stiffness matrices do not contain it")
    return notes


def _port(reduction: Reduction, port_: Port, second: Array) -> ModalPort:
    motion = reduction.motion(port_)
    if reduction.frame == "tangent" and port_ is reduction.held_port:
        motion = np.zeros_like(motion)
    return ModalPort(
        position=port_.position, rotation=port_.rotation, phi=_clean(motion[:3]),
        theta=_clean(motion[3:]), second_order=_clean(second),
    )  # fmt: skip


def _clean(values: Array) -> Array:
    """Values with rounding errors set to zero, so that generated code becomes simpler."""
    largest = float(np.max(np.abs(values), initial=0.0))
    return np.where(np.abs(values) <= _ROUNDING * largest, 0.0, values)


def _damping(
    name: str, model: ElasticModel, damping: Any, K: Array, mass: float, frequencies: Array
) -> Array:
    """Damping matrix D = tau K + 2 zeta omega m."""
    if damping is None:
        return np.zeros_like(K)
    ratios = np.asarray(damping.ratio, dtype=float)
    if len(ratios) not in (1, len(K)):
        raise model.error(
            f"damping: expected one ratio, or one for each of {len(K)} shapes, found {len(ratios)}"
        )
    return np.asarray(damping.stiffness * K + np.diag(2 * ratios * frequencies * mass))


def _initial_state(model: ElasticModel, start: Any, key: str, n: int) -> Array:
    values = None if start is None else getattr(start, key)
    if values is None:
        return np.zeros(n)
    if len(values) != n:
        raise model.error(
            f"initial.{key}: expected {n} numbers, one per shape (static and fixed-interface), "
            f"found {len(values)}"
        )
    return np.asarray(values, dtype=float)
