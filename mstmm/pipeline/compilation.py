"""Compilation of a scene into a Model, with the choice of engine and sweep and its reason."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from numbers import Real
from pathlib import Path
from typing import TYPE_CHECKING

from ..argument_validation import abbreviate, require_bool, require_word
from ..errors import ElementError, NumericalFailure, SceneError
from ..ir.element_spec import ElementSpec
from ..ir.hinge_properties import builtin_hinges
from ..scene import Scene, load_scene

if TYPE_CHECKING:
    from ..derive.catalogue.registry import Element
    from ..runtime.model.model import Model

ENGINES = ("auto", "fused", "looped")
SWEEPS = ("auto", "riccati", "refined", "qr", "product")


@dataclass(frozen=True)
class GeneratedElement:
    """Element of the kernel store: its kernels, its folder, and the way it is executed."""

    spec: ElementSpec
    folder: Path
    execution: str


def compile_scene(
    scene: Scene | str | os.PathLike[str],
    engine: str = "auto",
    sweep: str = "auto",
    accuracy: float = 1e-8,
    bake: bool = False,
    flexibility: str | None = None,
    simplify: bool | Collection[str] | Mapping[str, bool | float] = True,
) -> Model:
    """Compile a scene into a model.

    Args:
        scene: validated scene (`load_scene`, or `Scene(...)`), or the path of a scene file.
        engine: "looped" (element kernels called in a loop: any size, no compiler), "fused" (code
            for this scene only, compiled now or found in the cache; needs a C compiler, pays off
            up to about 60 bodies, possible up to 400), or "auto": uses fused code from the cache,
            and builds it for a run or batch long enough to repay the compilation.
        sweep: "auto" (the first of the next three that keeps the digits of a tree's accelerations
            at the start, if the scene supports it; see `model.sweep`), "riccati" (any tree),
            "refined" (iterative refinement, as often as the start needs: accurate for heavy bodies
            outboard of light ones; closed loops are always refined), "qr" (least squares: slower,
            accurate for any mass ratio; rigid bodies, looped engine and explicit methods only), or
            "product" (the plain product of classical transfer matrices along a chain and loops
            closed on it, with an error check).  With "refined" and "qr" the equilibrium and
            derivatives use the Riccati sweep.
        accuracy: with "product", the largest accepted deviation from the Riccati sweep, relative to
            the largest acceleration.
        bake: with "fused", write the numbers of the scene into the code instead of reading them at
            run time: somewhat faster, but other parameters need another compilation.
        flexibility: model level of all flexible bodies: "coupled", "one-way" (rigid in the run,
            then elastic response to its motion and loads) or "rigid"; None uses the `model` of each
            body.
        simplify: simplifications before packing: True, False, or a list of names.  "welds" merges
            rigid bodies joined by fixed hinges.  "turns" rounds orientations within 1e-11 rad of
            quarter turns to these.  "links" selects special kernels of the looped engine for pins,
            prismatics, rotors on them, and balls.  A table changes one and keeps the others
            ({"turns": 1e-5}: another tolerance, rad; {"turns": 0}: none).
            `model.simplifications` lists those applied.

    Raises SceneError for hinges that do not form a tree, unknown types, masses that leave a motion
    undetermined at the start, and outputs of quantities that results do not have;
    EnvironmentFailure if engine="fused" and there is no compiler or it fails.
    """
    if isinstance(scene, str | os.PathLike):
        scene = load_scene(scene)
    if not isinstance(scene, Scene):
        raise SceneError(f"{scene!r:.60}: expected a Scene, or the path of a scene file")
    model = compile_level(scene, engine, sweep, accuracy, bake, flexibility, simplify)
    if flexibility is None:
        model.check_outputs()
    return model


def compile_level(
    scene: Scene,
    engine: str = "auto",
    sweep: str = "auto",
    accuracy: float = 1e-8,
    bake: bool = False,
    flexibility: str | None = None,
    simplify: bool | Collection[str] | Mapping[str, bool | float] = True,
) -> Model:
    """Compile a scene at a model level that may lack quantities of its outputs.

    Arguments and errors are those of `compile_scene`, but outputs of missing quantities are no
    error: results do not have them.
    """
    if require_word("engine", engine, f"one of {', '.join(ENGINES)}") not in ENGINES:
        raise SceneError(f'engine "{engine}" is not known; there are: {", ".join(ENGINES)}')
    if require_word("sweep", sweep, f"one of {', '.join(SWEEPS)}") not in SWEEPS:
        raise SceneError(f'sweep "{sweep}" is not known; there are: {", ".join(SWEEPS)}')
    if not (isinstance(accuracy, Real) and accuracy > 0) or isinstance(accuracy, bool):
        raise SceneError(f"accuracy = {abbreviate(accuracy)}: expected a positive number")
    from mstmm.runtime.packing.expansion import with_level
    from mstmm.runtime.packing.simplification import parse_simplify

    from ..runtime.kernels import kernel_store
    from ..runtime.model.model import Model
    from .fused_code import DEFAULT_MAX_BODIES, MAX_BODIES, FusionFactory

    simplifications = parse_simplify(simplify)
    scene = with_level(scene, flexibility)

    elements, definitions = kernel_store.load_known(kernel_store.required_types(scene))
    scene.check_types(definitions)
    product = accuracy if sweep == "product" else None
    if engine == "fused" and sweep in ("qr", "product"):
        raise SceneError(f'sweep = "{sweep}" has no fused code; use engine = "auto" or "looped"')
    if require_bool("bake", bake) and engine != "fused":
        raise SceneError(
            "bake = True writes the numbers of the scene into its code; "
            'it requires engine = "fused"'
        )
    obstacle = "requested" if engine == "looped" else ""
    max_bodies = MAX_BODIES if engine == "fused" else DEFAULT_MAX_BODIES

    fuser = FusionFactory(definitions, obstacle, bake, max_bodies)

    def build_model(by: str) -> Model:
        return Model(scene, elements, fuser, product, by, simplifications)

    if sweep == "auto":
        model = _model_with_accurate_sweep(build_model, engine)
    else:
        model = build_model(sweep if product is None else "riccati")
    model.check_start_determined()
    if engine == "fused":
        model.fusion.build()
    elif engine == "auto":
        model.fusion.find()
    return model


def _model_with_accurate_sweep(made: Callable[[str], Model], engine: str) -> Model:
    """Model with the cheapest sweep that is accurate at the start and that the scene supports."""
    from ..runtime.result.checks.conditioning import accurate_sweep

    model = made("riccati")
    needed_sweep = accurate_sweep(model)
    if needed_sweep == "qr" and engine != "fused":
        with suppress(SceneError):
            return made("qr")
    if needed_sweep != "riccati":
        with suppress(SceneError, NumericalFailure):
            return made("refined")
    return model


def generate(elements: Iterable[Element], definition: str | None = None) -> list[GeneratedElement]:
    """Check, derive and compile elements into the user's kernel store.

    The store keeps `definition`, the text of the defining file, so that their equations can be
    shown.  Raises ElementError that names the wrong equation, or for the name of a built-in
    element; EnvironmentFailure if the store cannot be written.
    """
    from ..derive.catalogue.element_specs import spec_of
    from ..derive.catalogue.registry import kind_of
    from ..derive.codegen.template_rendering import element_source, mstmm_header
    from ..derive.verification.definition_checks import check_element
    from ..runtime.kernels import kernel_store, prebuilt_kernels

    generated = []
    for element in elements:
        kind, name = kind_of(element), element.name
        if (kind, name) in prebuilt_kernels.elements() or (
            kind == "hinge" and name in builtin_hinges()
        ):
            raise ElementError(f"{kind} {name!r} is built in; choose another name")
        check_element(element)
        spec = spec_of(element)
        files = {"mstmm.h": mstmm_header(), f"{spec.kind}_{spec.name}.c": element_source(spec)}
        if definition is not None:
            files[kernel_store.DEFINITION_FILE] = definition
        folder, execution = kernel_store.store_element(spec, files)
        generated.append(GeneratedElement(spec, folder, execution))
    return generated


def generate_file(path: str | Path) -> list[GeneratedElement]:
    """Generate every element that a Python file defines; the file is executed.  See `generate`."""
    from ..derive.catalogue.registry import load_file

    return generate(load_file(path), Path(path).read_text(encoding="utf-8"))


def generate_published() -> list[GeneratedElement]:
    """Generate every element that installed packages publish as entry points.  See `generate`.

    The group is "mstmm.elements"; an entry names a class or a module of classes.
    """
    from ..derive.catalogue.registry import installed_elements

    return generate(element for _, elements in installed_elements() for element in elements)


def register(element: type[Element]) -> GeneratedElement:
    """Register a user-defined hinge, body or force element, so that scenes can use its name.

    Errors are those of `generate`.
    """
    from ..derive.catalogue.registry import instance

    return generate([instance(element)])[0]
