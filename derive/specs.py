"""Element -> ElementSpec: derive and lower every kernel an element offers."""

from __future__ import annotations

from functools import partial

import sympy as sp

from mstmm.ir import KernelIR
from mstmm.spec import ElementSpec

from . import body as body_kernels
from . import force as force_kernels
from . import frames, laws, sweep
from .classical import CLASSICAL, classical_spec
from .derivation import Quantity, vector
from .element import Body, ForceElement, Hinge
from .hinge import HingeMotion, hinge_derivation, hinge_quantities, motion_of, speeds_of
from .lower import lower
from .registry import Element, builtin_elements

FRAME_DERIVATIONS = (
    frames.pose, frames.velocity, frames.point, frames.turning, frames.end_frame,
    frames.applied_load, frames.opposite, frames.power, frames.momentum, frames.gravity_energy,
    frames.reaction, frames.transport, frames.rotor_energy,
    frames.length, frames.turned, frames.classical_body, frames.state_deviation,
)  # fmt: skip

#: Largest number of speeds of a hinge.
MAX_SPEEDS = 6


def spec_of(element: Element) -> ElementSpec:
    """Kernels of any element, built in or the user's."""
    if isinstance(element, Hinge):
        return hinge_spec(element)
    if isinstance(element, Body):
        return body_spec(element)
    return force_spec(element)


def hinge_spec(hinge: Hinge) -> ElementSpec:
    """`hinge` always; `forward`, `condense`, `recover` specialised to its motion subspace."""
    motion = motion_of(hinge)
    inputs = hinge_quantities(hinge)
    kernels = [
        lower(hinge_derivation(motion), "hinge"),
        lower(sweep.forward(motion, inputs), "forward"),
        *_elimination(motion),
    ]
    measure = hinge.singular_when(motion.q, motion.p)
    if measure is not None:
        kernels.append(_singularity(motion, measure))
    return ElementSpec(
        "hinge", hinge.name, hinge.title or hinge.name, hinge.coordinates, speeds_of(hinge),
        hinge.parameters, tuple(kernels), hinge.sources,
    )  # fmt: skip


def _elimination(motion: HingeMotion) -> tuple[KernelIR, KernelIR]:
    subspace = motion.in_arrays(motion.subspace)
    inputs = hinge_quantities(motion.hinge)[:2]  # p and q
    nu, name = motion.nu, motion.hinge.name
    across = sweep.condense(nu, subspace, inputs, name)
    back = sweep.recover(nu, subspace, inputs, name)
    return (
        lower(across, "condense", sweep.pivot_guards(nu, subspace)),
        lower(back, "recover"),
    )


def _singularity(motion: HingeMotion, measure: sp.Expr) -> KernelIR:
    from .derivation import Derivation, Equation

    value = Quantity(vector("measure", 1), "", "tends to zero where the coordinates fail")
    return lower(
        Derivation(
            motion.hinge.name,
            "distance from the singular configuration",
            hinge_quantities(motion.hinge)[:2],
            (value,),
            (Equation("measure", value.symbol, motion.in_arrays(sp.Matrix([measure]))),),
        ),
        "singularity",
    )


def body_spec(body: Body) -> ElementSpec:
    """`inertia`, `bias_load` and `energy`."""
    kernels = (
        lower(body_kernels.inertia(body), "inertia"),
        lower(body_kernels.bias_load(body), "bias_load"),
        lower(body_kernels.kinetic_energy(body), "energy"),
    )
    return ElementSpec(
        "body", body.name, body.title or body.name, (), (), body.parameters, kernels, body.sources
    )


def force_spec(force: ForceElement) -> ElementSpec:
    """`wrench` between two ends."""
    kernel = lower(force_kernels.wrench(force), "wrench", force_kernels.wrench_guards(force))
    return ElementSpec(
        "force", force.name, force.title or force.name, (), (), force.parameters, (kernel,),
        force.sources,
    )  # fmt: skip


def generic_spec(nu: int) -> ElementSpec:
    """The sweep's steps for any hinge with `nu` free speeds."""
    kernels = [
        lower(sweep.forward_generic(nu), "forward"),
        lower(sweep.condense(nu), "condense", sweep.pivot_guards(nu)),
        lower(sweep.recover(nu), "recover"),
        lower(sweep.effort(nu), "effort"),
        lower(sweep.project(nu), "project"),
    ]
    return ElementSpec(
        "sweep", f"generic{nu}", f"sweep across a hinge with {nu} speeds", (), (), (),
        tuple(kernels), sweep.SOURCES,
    )  # fmt: skip


def shared_specs() -> list[ElementSpec]:
    """What is no element of a scene: frames, laws, generic sweep."""
    plain = partial(ElementSpec, coordinates=(), speeds=(), parameters=())
    frame_kernels = tuple(
        lower(derivation(), derivation.__name__) for derivation in FRAME_DERIVATIONS
    )
    law_kernels = (
        lower(laws.coordinate_law(full=False), "linear"),
        lower(laws.coordinate_law(full=True), "full"),
        lower(laws.rotation_law(), "rotation"),
        lower(laws.six_direction_law(), "six"),
    )
    return [
        plain(kind="sweep", name="frames", title="poses, points and loads", kernels=frame_kernels),
        plain(kind="sweep", name="laws", title="laws on hinge coordinates", kernels=law_kernels),
        *(generic_spec(nu) for nu in range(MAX_SPEEDS + 1)),
    ]


def all_specs() -> list[ElementSpec]:
    """Everything that is generated and compiled when the package is built."""
    return [
        *(spec_of(e) for e in builtin_elements()),
        *shared_specs(),
        *(classical_spec(name) for name in CLASSICAL),
    ]
