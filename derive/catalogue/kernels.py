"""Table of all kernels by their derivations, for lowering, display and cross-checks."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache

import sympy as sp

from mstmm.errors import ElementError
from mstmm.ir import KernelIR

from ..classical import harmonic_stiffness
from ..classical.catalogue import CLASSICAL, classical_derivation, classical_guards
from ..definition.derivation import Derivation, Equation, Quantity, vector
from ..definition.element import Body, Hinge
from ..elements.body_rigid import RigidBody
from ..equations import axial_links as axial
from ..equations import (
    constraints,
    kinematics,
    laws,
    ldl_elimination,
    loop_closure,
    qr_sweep,
    riccati_sweep,
    screw_transport,
    tangent_hinge_elimination,
    tangent_sweep,
    user_elements,
)
from ..equations import rotational_links as rotational
from ..equations import tangent_position_loads as placed
from ..equations.hinge import (
    HingeMotion,
    complement,
    hinge_derivation,
    hinge_pose,
    hinge_quantities,
    motion_of,
)
from ..equations.ldl_elimination import eliminate_factored, recover_factored
from ..flexible import (
    beam_fields,
    beam_foreshortening,
    modal_constraint_rows,
    modal_residual,
    modal_sweep,
    section,
    segment,
)
from ..lower.kernel_lowering import lower
from .registry import Element, builtin_elements, kind_of

#: (condition, failure code, message) over the derivation's quantities.
Guards = tuple[tuple[sp.Basic, int, str], ...]

FRAME_DERIVATIONS = (
    kinematics.pose,
    kinematics.velocity,
    kinematics.point,
    kinematics.angular_motion,
    kinematics.end_frame,
    kinematics.applied_load,
    kinematics.reaction_wrench,
    kinematics.power,
    kinematics.momentum,
    kinematics.carried_momentum,
    kinematics.gravity_energy,
    kinematics.pivot_floor,
    kinematics.reaction,
    kinematics.moment_about,
    kinematics.transport,
    kinematics.rotor_energy,
    kinematics.driven_effort,
    kinematics.speed_power,
    kinematics.length,
    kinematics.to_inertial,
    kinematics.classical_body,
    kinematics.state_deviation,
    tangent_sweep.tangent_carry,
    tangent_sweep.tangent_motion,
    tangent_hinge_elimination.tangent_pose_change,
    tangent_sweep.tangent_known_load,
    placed.placed_displacement,
    placed.placed_pose,
    placed.placed_column,
    placed.placed_carry,
    placed.placed_known_load,
)

#: Tangent steps for hinges with any number of speeds, and for hinges with at least one.
_TANGENT_STEPS = (
    tangent_hinge_elimination.tangent_carrier,
    tangent_hinge_elimination.tangent_column,
)
_TANGENT_SPEED_STEPS = (
    tangent_hinge_elimination.tangent_coordinate_change,
    tangent_hinge_elimination.tangent_steady,
    tangent_hinge_elimination.tangent_rotational,
    tangent_hinge_elimination.tangent_rows,
    tangent_hinge_elimination.tangent_reduce,
    tangent_hinge_elimination.tangent_load,
    tangent_hinge_elimination.tangent_solution,
    tangent_hinge_elimination.tangent_load_with_increments,
    tangent_hinge_elimination.tangent_solution_with_increments,
)

#: Largest number of speeds of a hinge.
MAX_SPEEDS = 6


@dataclass(frozen=True)
class Kernel:
    """One kernel before lowering: its name within the element, its equations, its guards."""

    name: str
    derivation: Derivation
    guards: Guards = ()

    def ir(self) -> KernelIR:
        """Lowered kernel."""
        return lower(self.derivation, self.name, self.guards)


def kernels_of(element: Element) -> tuple[Kernel, ...]:
    """Kernels of any element, built-in or user-defined, in the order of the generated file."""
    if isinstance(element, Hinge):
        return hinge_kernels(element)
    if isinstance(element, Body):
        return (
            Kernel("inertia", user_elements.inertia(element)),
            Kernel("bias_load", user_elements.bias_load(element)),
            Kernel("energy", user_elements.kinetic_energy(element)),
        )
    wrench = user_elements.wrench(element)
    return (Kernel("wrench", wrench, user_elements.wrench_guards(element)),)


def hinge_kernels(hinge: Hinge) -> tuple[Kernel, ...]:
    """Kernels of a hinge, specialised to its motion subspace."""
    motion = motion_of(hinge)
    inputs = hinge_quantities(hinge)
    subspace, nu = motion.in_arrays(motion.subspace), motion.nu
    kernels = [
        Kernel("hinge", hinge_derivation(motion)),
        Kernel("forward", riccati_sweep.forward(motion, inputs)),
        Kernel(
            "condense",
            riccati_sweep.condense(nu, subspace, inputs[:2], hinge.name),
            riccati_sweep.pivot_guards(nu, subspace),
        ),
        Kernel("recover", riccati_sweep.back_substitute(nu, subspace, inputs[:2], hinge.name)),
    ]
    if nu:
        kernels.append(
            Kernel("eliminate", eliminate_factored(nu, subspace, inputs[:2], hinge.name))
        )
    measure = hinge.singularity_measure(motion.q, motion.p)
    if measure is not None:
        kernels.append(Kernel("singularity", _singularity_derivation(motion, measure)))
    return tuple(kernels)


def _singularity_derivation(motion: HingeMotion, measure: sp.Expr) -> Derivation:
    value = Quantity(vector("measure", 1), "", "tends to zero where the coordinates fail")
    return Derivation(
        motion.hinge.name,
        "distance from the singular configuration",
        hinge_quantities(motion.hinge)[:2],
        (value,),
        (Equation("measure", value.symbol, motion.in_arrays(sp.Matrix([measure]))),),
    )


@cache
def generic_kernels(nu: int) -> tuple[Kernel, ...]:
    """Steps of the sweep for any hinge with `nu` free speeds."""
    return (
        Kernel("forward", riccati_sweep.forward_generic(nu)),
        Kernel("condense", riccati_sweep.condense(nu), riccati_sweep.pivot_guards(nu)),
        Kernel("recover", riccati_sweep.back_substitute(nu)),
        Kernel("effort", riccati_sweep.effort(nu)),
        Kernel("project", riccati_sweep.project(nu)),
        Kernel("factor", ldl_elimination.factor(nu), riccati_sweep.pivot_guards(nu)),
        Kernel("column_load", ldl_elimination.column_load(nu)),
        Kernel("column_acceleration", ldl_elimination.column_acceleration(nu)),
        Kernel("qr_eliminate", qr_sweep.qr_eliminate(nu), qr_sweep.qr_guards(nu)),
        *(Kernel(make.__name__, make(nu)) for make in _TANGENT_STEPS),
        *(Kernel(make.__name__, make(nu)) for make in _TANGENT_SPEED_STEPS if nu),
        Kernel("complement", complement(nu)),
        *(Kernel(make.__name__, make(nu)) for make in loop_closure.OF_SPEEDS if nu),
        *((Kernel("required_load", riccati_sweep.required_load(nu)),) if nu else ()),
        *((Kernel("ground_column_load", ldl_elimination.ground_column_load(nu)),) if nu else ()),
        *((Kernel("eliminate", eliminate_factored(nu)),) if nu else ()),
        *((Kernel("recover_factored", recover_factored(nu)),) if nu else ()),
    )


def frame_kernels() -> tuple[Kernel, ...]:
    """Kernels of poses, points and loads."""
    return tuple(Kernel(derivation.__name__, derivation()) for derivation in FRAME_DERIVATIONS)


def law_kernels() -> tuple[Kernel, ...]:
    """Kernels of laws on hinge coordinates."""
    return (
        Kernel("linear", laws.coordinate_law(full=False)),
        Kernel("full", laws.coordinate_law(full=True)),
        Kernel("rotation", laws.rotation_law()),
        Kernel("six", laws.six_direction_law()),
    )


def screw_kernels() -> tuple[Kernel, ...]:
    """Kernels of transport across axial screws."""
    return tuple(
        Kernel(name, derivation) for name, derivation in screw_transport.derivations().items()
    )


def qr_kernels() -> tuple[Kernel, ...]:
    """Kernels of the least-squares sweep, except the elimination of hinges."""
    return tuple(
        Kernel(make.__name__, make())
        for make in (qr_sweep.factor, qr_sweep.bias, qr_sweep.merge, qr_sweep.rows_to_riccati)
    )


def loop_kernels() -> tuple[Kernel, ...]:
    """Kernels of closed loops, except those that depend on the number of hinge speeds."""
    return tuple(
        Kernel(make.__name__, make(), constraints.GUARDS.get(make.__name__, ()))
        for make in (*loop_closure.STEPS, *constraints.STEPS)
    )


@cache
def links() -> Mapping[str, Hinge]:
    """Built-in hinges that move only about and along z, or rotate about a point, by name."""
    hinges = [element for element in builtin_elements() if isinstance(element, Hinge)]
    return {
        hinge.name: hinge for hinge in hinges
        if _is_axial(hinge) or rotational.is_rotational(hinge)
    }  # fmt: skip


def _is_axial(hinge: Hinge) -> bool:
    place = hinge_pose(hinge)
    return place.nu > 0 and hinge.speeds is None and axial.along_z(place) is not None


#: Suffix of the link name of a hinge whose speed has rotor inertia.
ROTOR = "_rotor"


def link_names() -> dict[str, str]:
    """Names of all links -> title; a hinge with one speed also has a link with rotor."""
    titles = {name: f"rigid body outboard of the {hinge.title}" for name, hinge in links().items()}
    single = [name for name, hinge in links().items() if hinge_pose(hinge).nu == 1]
    return titles | {f"{name}{ROTOR}": f"{titles[name]} with a rotor" for name in single}


def link_kernels(name: str) -> tuple[Kernel, ...]:
    """Kernels of a rigid body outboard of a hinge; `name` is one of `link_names`."""
    hinge, rotor, body = links()[name.removesuffix(ROTOR)], name.endswith(ROTOR), RigidBody()
    motion = motion_of(hinge)
    guards = riccati_sweep.pivot_guards(
        motion.nu, motion.in_arrays(motion.subspace), axial.pivot_threshold(body)
    )
    if rotational.is_rotational(hinge):
        return (
            Kernel("turn", rotational.rotation_derivation(motion)),
            Kernel("forward", rotational.forward(motion, body)),
            Kernel("condense", rotational.condense(motion, body), guards),
            Kernel("recover", rotational.recover(motion)),
        )
    return (
        Kernel("turn", axial.rotation_derivation(motion)),
        Kernel("forward", axial.forward(motion, body)),
        Kernel("condense", axial.condense(motion, body, rotor), guards),
        Kernel("recover", axial.recover(motion, rotor)),
    )


def modal_kernels() -> tuple[Kernel, ...]:
    """Kernels of flexible bodies (n modes, run-time size): residual, sections, condensation."""
    turns = section.rotation_guards()
    return (
        Kernel("residual", modal_residual.residual()),
        Kernel("momentum", modal_residual.momentum()),
        Kernel("strain_energy", modal_residual.strain_energy()),
        Kernel("section", section.section()),
        Kernel("end_motion", section.end_motion(), turns),
        Kernel("frame_motion", section.frame_motion(), turns),
        Kernel("segment", segment.segment()),
        Kernel("segment_motion", segment.segment_motion(), segment.rotation_guards()),
        Kernel("subspace", section.subspace()),
        Kernel("prescribed_bias", section.prescribed_bias()),
        *(
            Kernel(step.__name__, step())
            for step in (*modal_sweep.STEPS, *modal_constraint_rows.STEPS)
        ),
    )


def tangent_kernels() -> tuple[Kernel, ...]:
    """Elimination of the unknowns of an implicit step: n of a hinge or of a flexible body."""
    return tuple(
        Kernel(make.__name__, make())
        for make in (
            tangent_sweep.invert,
            tangent_sweep.node,
            tangent_sweep.assemble_port,
            tangent_sweep.carry_columns,
            tangent_sweep.outboard_rows,
            tangent_sweep.column_load,
            tangent_sweep.column_solution,
            tangent_sweep.port_motion,
            tangent_sweep.increment_matrix,
            tangent_sweep.coordinate_increment,
            placed.placed_rows,
            placed.placed_own,
            placed.placed_reduce,
            placed.placed_node,
            placed.placed_port,
            placed.placed_carry_columns,
            placed.placed_remainder,
        )
    )


def beam_kernels() -> tuple[Kernel, ...]:
    """Kernels of beams: integrands per length for packing, and dynamic stiffness."""
    derivations = beam_fields.KERNELS | beam_foreshortening.KERNELS | harmonic_stiffness.KERNELS
    return tuple(Kernel(name, make()) for name, make in derivations.items())


def classical_kernel(name: str) -> Kernel:
    """Kernel of the classical transfer matrix `name`."""
    derivation = classical_derivation(name)
    return Kernel("transfer", derivation, classical_guards(derivation))


Table = dict[tuple[str, str], Callable[[], tuple[Kernel, ...]]]


def built_in() -> Table:
    """(kind, name) -> function that derives the kernels, for the whole package."""
    return _kernels_without_links() | {
        ("sweep", f"link_{name}"): lambda name=name: link_kernels(name) for name in link_names()
    }


def _kernels_without_links() -> Table:
    """(kind, name) -> function, without links, whose names need a derivation."""
    table: Table = {
        (kind_of(e), e.name): lambda e=e: kernels_of(e)  # type: ignore[misc]
        for e in builtin_elements()
    }
    table["sweep", "frames"] = frame_kernels
    table["sweep", "laws"] = law_kernels
    table["sweep", "screw"] = screw_kernels
    table["sweep", "qr"] = qr_kernels
    table["sweep", "loops"] = loop_kernels
    table["sweep", "modal"] = modal_kernels
    table["sweep", "tangent"] = tangent_kernels
    table["sweep", "beam"] = beam_kernels
    for nu in range(MAX_SPEEDS + 1):
        table["sweep", f"generic{nu}"] = lambda nu=nu: generic_kernels(nu)  # type: ignore[misc]
    for name in CLASSICAL:
        table["classical", name] = lambda name=name: (classical_kernel(name),)  # type: ignore[misc]
    return table


def maker(kind: str, name: str) -> Callable[[], tuple[Kernel, ...]] | None:
    """Function that derives the kernels of one built-in element; None if there is none."""
    return _kernels_without_links().get((kind, name)) or built_in().get((kind, name))


def built_in_kernels(kind: str, name: str) -> tuple[Kernel, ...]:
    """Kernels of one built-in element.  Raises ElementError if there is none."""
    make = maker(kind, name)
    if make is None:
        raise ElementError(f'unknown built-in {kind} "{name}"')
    return make()
