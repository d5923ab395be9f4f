"""Scene -> Model: chooses the engine and says why.  With `crosscheck`, the bridge between rooms."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from numbers import Real
from pathlib import Path
from typing import TYPE_CHECKING

from ..arguments import short, word_of, yes_or_no
from ..errors import ElementError, NumericalFailure, SceneError
from ..ir.facts import builtin_hinges
from ..ir.spec import ElementSpec
from ..scene import Scene, load_scene

if TYPE_CHECKING:
    from ..derive.catalogue.registry import Element
    from ..runtime.model.model import Model

ENGINES = ("auto", "fused", "looped")
SWEEPS = ("auto", "riccati", "refined", "qr", "product")


@dataclass(frozen=True)
class Generated:
    """An element of the kernel store: its kernels, its folder, and how it runs."""

    spec: ElementSpec
    folder: Path
    how: str


def compile_scene(
    scene: Scene | str | os.PathLike[str],
    engine: str = "auto",
    sweep: str = "auto",
    accuracy: float = 1e-8,
    bake: bool = False,
    flexibility: str | None = None,
    simplify: bool | Collection[str] | Mapping[str, bool | float] = True,
) -> Model:
    """Model of a scene, ready to compute.

    Args:
        scene: validated scene (`load_scene`, or `Scene(...)`), or the path of a scene file.
        engine: "looped" (element kernels driven by a loop: any size, no compiler), "fused" (code
            of this scene alone, compiled now or found in the cache; a C compiler is needed, pays
            up to about 60 bodies, possible up to 400), or "auto": fused code that is in the cache
            is used, and a run or batch long enough to repay the compiler has it built.
        sweep: "auto" (the first of the next three by which the start of a tree keeps its digits,
            if the scene can have it; `model.sweep` tells which), "riccati" (any tree), "refined"
            (what its answer leaves over is answered again, as often as the start needs: digits
            stay where heavy bodies hang behind light ones; closed loops do so by themselves), "qr"
            (the same as least squares: slower, for any ratio of masses; rigid bodies, looped
            engine, and explicit methods), which both leave the equilibrium and derivatives to the
            Riccati sweep, or "product" (the plain product of classical transfer matrices along a
            chain and loops closed on it, guarded).
        accuracy: with "product", the largest deviation from the Riccati sweep, relative to the
            largest acceleration, that is not an error.
        bake: with "fused", make the scene's numbers part of the code instead of reading them at run
            time: somewhat faster, but other parameters need the compiler again.
        flexibility: level of model of all flexible bodies: "coupled", "one-way" (they are rigid in
            the run, then respond elastically to its motion and loads) or "rigid"; None takes each
            body's own `model`.
        simplify: what may be packed otherwise than the scene says it: True, False, or a list of
            "welds" (rigid bodies on fixed hinges as one), "turns" (orientations within 1e-11 rad of
            quarter turns are these) and "links" (the looped engine's kernels that know how pins,
            prismatics, rotors on them, and balls move); a table changes one and leaves the others
            ({"turns": 1e-5}: another tolerance, rad; {"turns": 0}: none).
            `model.simplifications` tells what was done.

    Raises SceneError for hinges that do not form a tree, types that nobody defines, and masses that
    leave a motion of the start undetermined, and outputs of what results do not have;
    EnvironmentFailure if engine="fused" and there is no compiler or it fails.
    """
    if isinstance(scene, str | os.PathLike):
        scene = load_scene(scene)
    if not isinstance(scene, Scene):
        raise SceneError(f"{scene!r:.60}: expected a Scene, or the path of a scene file")
    model = compile_level(scene, engine, sweep, accuracy, bake, flexibility, simplify)
    if flexibility is None:
        model.refuse_unknown_outputs()
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
    """The same of a scene at a lower level of model, which may lack what an output is of: its
    results do not have that output."""
    if word_of("engine", engine, f"one of {', '.join(ENGINES)}") not in ENGINES:
        raise SceneError(f'engine "{engine}" is not known; there are: {", ".join(ENGINES)}')
    if word_of("sweep", sweep, f"one of {', '.join(SWEEPS)}") not in SWEEPS:
        raise SceneError(f'sweep "{sweep}" is not known; there are: {", ".join(SWEEPS)}')
    if not (isinstance(accuracy, Real) and accuracy > 0) or isinstance(accuracy, bool):
        raise SceneError(f"accuracy = {short(accuracy)}: expected a positive number")
    from ..runtime.kernels import store
    from ..runtime.model.model import Model
    from ..runtime.pack.flexible.rigidified import with_level
    from ..runtime.pack.merge.simplification import asked_for
    from .fusion import MOST_ASKED, MOST_BODIES, Fuser

    words = asked_for(simplify)
    scene = with_level(scene, flexibility)

    elements, definitions = store.known(store.needed(scene))
    scene.check_types(definitions)
    product = accuracy if sweep == "product" else None
    if engine == "fused" and sweep in ("qr", "product"):
        raise SceneError(f'sweep = "{sweep}" has no fused code; use engine = "auto" or "looped"')
    if yes_or_no("bake", bake) and engine != "fused":
        raise SceneError(
            "bake = True writes the numbers of the scene into its code; "
            'it goes with engine = "fused"'
        )
    refused = "asked for" if engine == "looped" else ""
    most = MOST_ASKED if engine == "fused" else MOST_BODIES

    fuser = Fuser(definitions, refused, bake, most)

    def made(by: str) -> Model:
        return Model(scene, elements, fuser, product, by, words)

    if sweep == "auto":
        model = _with_digits(made, engine)
    else:
        model = made(sweep if product is None else "riccati")
    model.refuse_undetermined_start()
    if engine == "fused":
        model.fusion.build()
    elif engine == "auto":
        model.fusion.find()
    return model


def _with_digits(made: Callable[[str], Model], engine: str) -> Model:
    """By the cheapest sweep that keeps the digits of the start, and that the scene can have."""
    from ..runtime.guard.heavy import sweep_that_keeps_digits

    model = made("riccati")
    wanted = sweep_that_keeps_digits(model)
    if wanted == "qr" and engine != "fused":
        with suppress(SceneError):
            return made("qr")
    if wanted != "riccati":
        with suppress(SceneError, NumericalFailure):
            return made("refined")
    return model


def generate(elements: Iterable[Element], definition: str | None = None) -> list[Generated]:
    """Check, derive, generate and compile elements into the user's kernel store, which keeps the
    text of the file that defines them, so that their equations can be shown.

    Raises ElementError naming the equation that is wrong, EnvironmentFailure if the store cannot be
    written.  A name that a built-in element has is refused.
    """
    from ..derive.audit.definition import check
    from ..derive.catalogue.registry import kind_of
    from ..derive.catalogue.specs import spec_of
    from ..derive.print.render import element_source, header
    from ..runtime.kernels import prebuilt, store

    made = []
    for element in elements:
        kind, name = kind_of(element), element.name
        if (kind, name) in prebuilt.elements() or (kind == "hinge" and name in builtin_hinges()):
            raise ElementError(f"{kind} {name!r} is built in; choose another name")
        check(element)
        spec = spec_of(element)
        files = {"mstmm.h": header(), f"{spec.kind}_{spec.name}.c": element_source(spec)}
        if definition is not None:
            files[store.DEFINITION] = definition
        place, how = store.keep(spec, files)
        made.append(Generated(spec, place, how))
    return made


def generate_file(path: str | Path) -> list[Generated]:
    """`generate` for every element that a Python file defines.  The file is executed: trust it."""
    from ..derive.catalogue.registry import load_file

    return generate(load_file(path), Path(path).read_text(encoding="utf-8"))


def generate_published() -> list[Generated]:
    """`generate` for every element that installed packages publish as entry points.

    The group is "mstmm.elements"; an entry names a class or a module of classes.
    """
    from ..derive.catalogue.registry import published

    return generate(element for _, elements in published() for element in elements)


def register(element: type[Element]) -> Generated:
    """Make a hinge, body or force element of your own known to scenes by its name."""
    from ..derive.catalogue.registry import instance

    return generate([instance(element)])[0]
