"""What `mstmm show` can show: every element and every step of the sweep, by name.

A full name is kind and name, as in the C files: hinge_pin, body_rigid, force_spring, sweep_frames,
classical_ball.  The name alone means the first of these kinds that has it.
"""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterable
from functools import cache, partial

from mstmm.errors import ElementError
from mstmm.ir import KernelIR
from mstmm.spec import ElementSpec

from . import body as body_kernels
from . import force as force_kernels
from . import laws, sweep
from .classical import CLASSICAL, classical_spec
from .derivation import Derivation
from .element import Body, ForceElement, Hinge
from .hinge import hinge_derivation, hinge_quantities, motion_of
from .registry import Element, builtin_elements, kind_of
from .render import element_source
from .show_document import ElementView
from .specs import FRAME_DERIVATIONS, MAX_SPEEDS, generic_spec, shared_specs, spec_of

KINDS = ("hinge", "body", "force", "classical", "sweep")


def names() -> list[str]:
    """Every full name, by kind."""
    return list(_makers())


def view(name: str, more: Iterable[Element] = ()) -> ElementView:
    """The view of a built-in element, or of one of `more` (a user's).

    Raises ElementError, with the nearest name, for an unknown one.
    """
    makers = {f"{kind_of(e)}_{e.name}": partial(of_element, e) for e in more} | _makers()
    full = full_name(name, makers)
    if full is None:
        near = difflib.get_close_matches(name, [*makers, *_short(makers)], 1, 0.6)
        hint = f'; did you mean "{near[0]}"?' if near else "; mstmm list shows what there is"
        raise ElementError(f'element "{name:.60}": there is no such element{hint}')
    return makers[full]()


def full_name(name: str, known: Iterable[str]) -> str | None:
    """The full name that a user means, None if there is none."""
    candidates = [name, *(f"{kind}_{name}" for kind in KINDS)]
    there = set(known)
    return next((c for c in candidates if c in there), None)


def _short(full: Iterable[str]) -> list[str]:
    return [name.split("_", 1)[1] for name in full]


@cache
def _makers() -> dict[str, Callable[[], ElementView]]:
    elements = sorted(builtin_elements(), key=lambda e: KINDS.index(kind_of(e)))
    makers: dict[str, Callable[[], ElementView]] = {
        f"{kind_of(e)}_{e.name}": partial(of_element, e) for e in elements
    }
    makers |= {f"classical_{name}": partial(_of_classical, name) for name in CLASSICAL}
    makers["hinge_elastic"] = makers["hinge_free"]  # the same motion; its law is in sweep_laws
    makers["sweep_frames"] = partial(_of_shared, "frames")
    makers["sweep_laws"] = partial(_of_shared, "laws")
    makers |= {f"sweep_generic{nu}": partial(_of_generic, nu) for nu in range(MAX_SPEEDS + 1)}
    return makers


def of_element(element: Element) -> ElementView:
    """View of a hinge, body or force element."""
    return _view(kind_of(element), element.name, element.title or element.name,
                 _derivations(element), partial(spec_of, element), element.sources)  # fmt: skip


def _derivations(element: Element) -> tuple[Derivation, ...]:
    if isinstance(element, Hinge):
        motion = motion_of(element)
        inputs, subspace = hinge_quantities(element), motion.in_arrays(motion.subspace)
        return (
            hinge_derivation(motion),
            sweep.forward(motion, inputs),
            sweep.condense(motion.nu, subspace, inputs[:2], element.name),
            sweep.recover(motion.nu, subspace, inputs[:2], element.name),
        )
    if isinstance(element, Body):
        return (
            body_kernels.inertia(element),
            body_kernels.bias_load(element),
            body_kernels.kinetic_energy(element),
        )
    assert isinstance(element, ForceElement)
    return (force_kernels.wrench(element),)


def _of_classical(name: str) -> ElementView:
    derivation = CLASSICAL[name]()
    return _view("classical", name, derivation.title, (derivation,), partial(classical_spec, name),
                 derivation.sources)  # fmt: skip


def _of_generic(nu: int) -> ElementView:
    made = (
        sweep.forward_generic(nu), sweep.condense(nu), sweep.recover(nu), sweep.effort(nu),
    )  # fmt: skip
    title = f"sweep across a hinge with {nu} speeds"
    return _view("sweep", f"generic{nu}", title, made, partial(generic_spec, nu), sweep.SOURCES)


def _of_shared(name: str) -> ElementView:
    made = {
        "frames": tuple(derivation() for derivation in FRAME_DERIVATIONS),
        "laws": (
            laws.coordinate_law(full=False), laws.coordinate_law(full=True),
            laws.rotation_law(), laws.six_direction_law(),
        ),
    }  # fmt: skip
    titles = {"frames": "poses, points and loads", "laws": "laws on hinge coordinates"}
    find = partial(_shared_spec, name)
    return _view("sweep", name, titles[name], made[name], find, ())


def _shared_spec(name: str) -> ElementSpec:
    return next(spec for spec in shared_specs() if spec.name == name)


def _view(
    kind: str,
    name: str,
    title: str,
    derivations: tuple[Derivation, ...],
    make: Callable[[], ElementSpec],
    sources: tuple[str, ...],
) -> ElementView:
    spec = cache(make)

    def kernels() -> tuple[KernelIR, ...]:
        return spec().kernels

    return ElementView(
        f"{kind}_{name}", title, derivations, kernels, lambda: element_source(spec()), sources
    )
