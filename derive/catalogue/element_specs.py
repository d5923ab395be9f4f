"""Element -> ElementSpec: derive and lower all kernels of an element."""

from __future__ import annotations

import difflib
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from mstmm.ir import KernelIR
from mstmm.ir.element_spec import ElementSpec
from mstmm.ir.hinge_properties import HingeProperties, hinge_properties

from ..classical.catalogue import CLASSICAL, RUN_ELEMENTS, classical_derivation, classical_spec
from ..codegen.template_rendering import generated_files, write_generated
from ..definition.element import Hinge
from ..equations import riccati_sweep
from ..equations.hinge import speeds_of
from .combined_hinge_kernels import planar_spec, with_slopes
from .kernels import (
    FRAME_DERIVATIONS,
    MAX_SPEEDS,
    Kernel,
    beam_kernels,
    frame_kernels,
    generic_kernels,
    kernels_of,
    law_kernels,
    link_kernels,
    link_names,
    loop_kernels,
    modal_kernels,
    qr_kernels,
    screw_kernels,
    tangent_kernels,
)
from .registry import Element, builtin_elements, builtin_hinges, kind_of

__all__ = [
    "FRAME_DERIVATIONS",
    "MAX_SPEEDS",
    "all_facts",
    "all_specs",
    "generic_spec",
    "on_demand_specs",
    "shared_specs",
    "spec_from",
    "spec_of",
]


def _lower_kernels(kernels: tuple[Kernel, ...], group: str = "") -> tuple[KernelIR, ...]:
    return with_slopes(group, (kernel.ir() for kernel in kernels))


def spec_of(element: Element) -> ElementSpec:
    """Derive and lower the kernels of any element, built-in or user-defined."""
    return spec_from(element, kernels_of(element))


def spec_from(element: Element, kernels: tuple[Kernel, ...]) -> ElementSpec:
    """Build the specification of an element: lowered kernels and properties of a hinge."""
    hinge = element if isinstance(element, Hinge) else None
    lowered = _lower_kernels(kernels, kind_of(element))
    return ElementSpec(
        kind_of(element),
        element.name,
        element.title or element.name,
        hinge.coordinates if hinge else (),
        speeds_of(hinge) if hinge else (),
        element.parameters,
        lowered,
        element.sources,
        None if hinge is None else hinge_facts(hinge, lowered),
    )


def hinge_facts(hinge: Hinge, kernels: Sequence[KernelIR]) -> HingeProperties:
    """Free directions and input keys of a hinge, from its kernel "hinge"."""
    motion = next(kernel for kernel in kernels if kernel.name == "hinge")
    return hinge_properties(
        motion, hinge.name, hinge.coordinates, speeds_of(hinge), hinge.parameters, hinge.frame_rule,
        hinge.scene_keys, hinge.motion_text or hinge.title,
    )  # fmt: skip


def all_facts(specs: Sequence[ElementSpec]) -> list[HingeProperties]:
    """Properties of the built-in hinges, by increasing number of speeds."""
    facts_by_name = {spec.name: spec.facts for spec in specs if spec.facts is not None}
    for hinge in builtin_hinges():
        if hinge.equivalent_builtin:
            facts_by_name[hinge.name] = replace(
                facts_by_name[hinge.equivalent_builtin],
                name=hinge.name,
                allows=hinge.motion_text,
                runs_as=hinge.equivalent_builtin,
            )
    return sorted(facts_by_name.values(), key=lambda facts: (len(facts.speeds), facts.name))


def generic_spec(nu: int) -> ElementSpec:
    """Steps of the sweep for any hinge with `nu` free speeds."""
    return ElementSpec(
        "sweep", f"generic{nu}", f"sweep across a hinge with {nu} speeds", (), (), (),
        _lower_kernels(generic_kernels(nu), "generic"), riccati_sweep.SOURCES,
    )  # fmt: skip


def shared_specs() -> list[ElementSpec]:
    """Kernels that belong to no element of a scene: frames, laws, generic sweep."""
    plain = partial(ElementSpec, "sweep", coordinates=(), speeds=(), parameters=())
    frames, laws = _lower_kernels(frame_kernels(), "frames"), _lower_kernels(law_kernels(), "laws")
    screws = _lower_kernels(screw_kernels())
    return [
        plain(name="frames", title="poses, points and loads", kernels=frames),
        plain(name="laws", title="laws on hinge coordinates", kernels=laws),
        plain(name="beam", title="Euler-Bernoulli beam", kernels=_lower_kernels(beam_kernels())),
        plain(
            name="modal", title="flexible bodies", kernels=_lower_kernels(modal_kernels(), "modal")
        ),
        plain(name="tangent", title="tangent of a step", kernels=_lower_kernels(tangent_kernels())),
        plain(name="loops", title="closed loops", kernels=_lower_kernels(loop_kernels(), "loops")),
        plain(name="qr", title="sweep as least squares", kernels=_lower_kernels(qr_kernels())),
        plain(name="screw", title="transport across axial screws", kernels=screws),
        *(
            plain(name=f"link_{name}", title=title, kernels=_lower_kernels(link_kernels(name)))
            for name, title in link_names().items()
        ),
        *(generic_spec(nu) for nu in range(MAX_SPEEDS + 1)),
    ]


def all_specs() -> list[ElementSpec]:
    """Everything that runs need, compiled or interpreted; this is what is generated."""
    specs = [*(spec_of(e) for e in builtin_elements()), *shared_specs()]
    return [*specs, planar_spec(specs), *(classical_spec(name) for name in RUN_ELEMENTS)]


def on_demand_specs() -> list[ElementSpec]:
    """Classical matrices that no run needs, without their kernels."""
    derivations = (
        (name, classical_derivation(name)) for name in CLASSICAL if name not in RUN_ELEMENTS
    )
    return [
        ElementSpec("classical", name, matrix.title, (), (), (), (), matrix.sources)
        for name, matrix in derivations
    ]


# --- generated files ------------------------------------------------------------------------------


def regenerate(folder: Path | str) -> list[Path]:
    """Derive everything and write it; remove files of elements that no longer exist."""
    target, specs = Path(folder), all_specs()
    written = write_generated(specs, target, hinges=all_facts(specs), on_demand=on_demand_specs())
    for path in target.iterdir():
        if path.suffix in (".c", ".h", ".json") and path not in written:
            path.unlink()
    return written


def differences(folder: Path | str) -> list[str]:
    """Unified diffs between a fresh derivation and `folder`; empty if identical."""
    target = Path(folder)
    specs = all_specs()
    fresh = generated_files(specs, hinges=all_facts(specs), on_demand=on_demand_specs())
    stored = {
        path.name: path.read_text(encoding="utf-8")
        for path in sorted(target.iterdir())
        if path.suffix in (".c", ".h", ".json")
    }
    diffs = []
    for name in sorted(fresh.keys() | stored.keys()):
        if fresh.get(name) != stored.get(name):
            lines = difflib.unified_diff(
                stored.get(name, "").splitlines(),
                fresh.get(name, "").splitlines(),
                f"committed/{name}",
                f"derived/{name}",
                lineterm="",
            )
            diffs.append("\n".join(list(lines)[:40]))
    return diffs
