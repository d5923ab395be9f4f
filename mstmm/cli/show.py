"""`mstmm show`: equations, transfer matrix, intermediate representation or C of an element."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from mstmm.errors import ElementError

from .options import Json, output_file, python_file, quoted

if TYPE_CHECKING:
    from pathlib import Path

    from mstmm.derive.show.document import ElementView
    from mstmm.ir.spec import ElementSpec

STAGES = ("equations", "matrix", "ir", "c")
FORMATS = ("text", "latex", "html")


def one_of(words: tuple[str, ...]) -> str:
    """Choices in the notation of the help."""
    return "|".join(words)


def _choice(text: str, words: tuple[str, ...]) -> str:
    if text not in words:
        raise typer.BadParameter(f"{quoted(text)}: expected one of {', '.join(words)}")
    return text


def show(
    element: Annotated[
        str,
        typer.Argument(
            metavar="ELEMENT",
            help='Element name (mstmm list), Python file, scene or robot, or "sweep" for the '
            "schedule.",
        ),
    ],
    at: Annotated[
        str,
        typer.Option(
            "--at", metavar=one_of(STAGES), help="Stage to show.",
            parser=lambda text: _choice(text, STAGES),
        ),
    ] = "equations",
    format: Annotated[
        str,
        typer.Option(
            "--format", metavar=one_of(FORMATS), help="Output format.",
            parser=lambda text: _choice(text, FORMATS),
        ),
    ] = "text",
    output: Annotated[
        str | None, typer.Option("--output", "-o", metavar="FILE", help="Output file.")
    ] = None,
    keep: Annotated[
        list[str] | None,
        typer.Option(
            "--keep", metavar="NAME", help="Scene parameter to keep symbolic; repeatable."
        ),
    ] = None,
    beside: Annotated[
        bool, typer.Option("--beside", help="Show the classical transfer matrix next to the motion "
                           "subspace.")
    ] = False,
    json: Json = False,
) -> None:  # fmt: skip
    """Show the equations, transfer matrix, intermediate representation or C of an element."""
    from mstmm.runtime.host.files import write_text
    from mstmm.scene.load import is_scene_file

    from .output import emit_json, note, put

    target = None if output is None else output_file(output, ())
    if beside:
        pages = {element: _beside(element, format)}
    elif is_scene_file(element):
        pages = {element: _scene(element, at, format, keep or [])}
    elif keep:
        raise ElementError("--keep applies to scenes: mstmm show SCENE.toml --keep NAME")
    elif element == "sweep":
        pages = {element: _schedule(at, format)}
    else:
        pages = {view.name: _page(view, at, format) for view in _views(element, at)}
    text = "\n".join(pages.values())
    if target is not None:
        write_text(target, text)
    if json:
        written = None if target is None else str(target)
        emit_json({"at": at, "format": format, "pages": pages, "file": written})
    elif target is None:
        put(text.rstrip("\n"))
    else:
        note(f"wrote {target}")


def _schedule(at: str, format: str) -> str:
    from mstmm.derive.show.sweep import sweep_page

    from . import stored

    return sweep_page(at, format, stored.specs)


def _beside(element: str, format: str) -> str:
    from mstmm.derive.show.beside import beside
    from mstmm.derive.show.page import printed

    from .names import found

    return printed(*beside("_".join(found(element))), format)


def _scene(file: str, at: str, format: str, keep: list[str]) -> str:
    from mstmm.bridge.equations import equations

    if at != "equations":
        raise ElementError(
            f"a scene has no stage {at!r}, but its elements have it: mstmm show ELEMENT --at {at}"
        )
    shown = equations(file, keep)
    return {"text": shown.text, "latex": shown.latex, "html": shown.html}[format]


def _page(view: ElementView, at: str, format: str) -> str:
    from mstmm.derive.show.page import show_view

    return show_view(view, at, format)


def _views(element: str, at: str) -> list[ElementView]:
    """Views of a built-in element, of one in the kernel store, or of all in a file."""
    from mstmm.derive.show import subjects as views

    from . import stored
    from .names import found

    if element.endswith(".py"):
        from mstmm.derive.audit.definition import check
        from mstmm.derive.catalogue.registry import load_file

        defined = load_file(python_file(element))
        for each in defined:
            check(each)
        return [views.of_element(each) for each in defined]
    kind, name = found(element)
    full = f"{kind}_{name}"
    if name not in (entry.name for entry in stored.builtin(kind)):
        return [_kept(kind, name, at)]
    kernels, source = stored.text(full, ".json"), stored.text(full, ".c")
    if kernels is None or at not in ("ir", "c"):
        return [views.view(full)]
    if at == "c" and source is None:
        raise ElementError(
            f"{full} has no C: runs interpret its intermediate representation; "
            f"to show that: mstmm show {full} --at ir"
        )
    from mstmm.ir.stored import element_from_json

    return [_of_spec(element_from_json(kernels), source or "")]  # without deriving them again


def _defined(file: Path, kind: str, name: str) -> ElementView:
    """View of an element from the file from which it was generated."""
    from mstmm.derive.catalogue.registry import kind_of, load_file
    from mstmm.derive.show import subjects as views

    for element in load_file(file):
        if (kind_of(element), element.name) == (kind, name):
            return views.of_element(element)
    raise ElementError(f"{file}: it does not define {kind} {name!r}; generate it again")


def _kept(kind: str, name: str, at: str) -> ElementView:
    """View of an element of the user's kernel store; its equations come from its file."""
    from mstmm.runtime.kernels import store

    full = f"{kind}_{name}"
    if at not in ("ir", "c"):
        return _defined(store.definition((kind, name)), kind, name)
    path = store.folder() / full / f"{full}.c"
    return _of_spec(store.specs()[kind, name], path.read_text(encoding="utf-8"))


def _of_spec(spec: ElementSpec, source: str) -> ElementView:
    from mstmm.derive.show.document import ElementView
    from mstmm.derive.show.entries import of_spec

    return ElementView(
        f"{spec.kind}_{spec.name}",
        spec.title,
        (),
        lambda: spec.kernels,
        lambda: source,
        spec.sources,
        of_spec(spec),
        spec.kind in ("hinge", "body", "force"),
    )
