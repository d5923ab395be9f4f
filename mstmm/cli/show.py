"""`mstmm show`: equations, transfer matrix, intermediate representation or C of an element."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from mstmm.errors import ElementError

from . import stored_elements
from .options import Json, flag, option, output_file, quote, require_python_file
from .terminal_output import print_json, print_note, write_stdout

if TYPE_CHECKING:
    from pathlib import Path

    from mstmm.derive.show.document import ElementView
    from mstmm.ir.element_spec import ElementSpec

STAGES = ("equations", "matrix", "ir", "c")
FORMATS = ("text", "latex", "html")


_BESIDE_HELP = "Show the classical transfer matrix next to the motion subspace."


def _choice(name: str, words: tuple[str, ...], description: str) -> Any:
    """Option whose value is one of several words."""

    def parse(text: str) -> str:
        if text not in words:
            raise typer.BadParameter(f"{quote(text)}: expected one of {', '.join(words)}")
        return text

    return option(name, "|".join(words), description, parse)


def show(
    element: Annotated[
        str,
        typer.Argument(
            metavar="ELEMENT",
            help='Element name (mstmm list), Python file, scene or robot, or "sweep" for the '
            "schedule.",
        ),
    ],
    at: Annotated[str, _choice("--at", STAGES, "Stage to show.")] = "equations",
    format: Annotated[str, _choice("--format", FORMATS, "Output format.")] = "text",
    output: Annotated[str | None, option("--output/-o", "FILE", "Output file.")] = None,
    keep: Annotated[
        list[str] | None, option("--keep", "NAME", "Scene parameter to keep symbolic; repeatable.")
    ] = None,
    beside: Annotated[bool, flag("--beside", _BESIDE_HELP)] = False,
    json: Json = False,
) -> None:
    """Show the equations, transfer matrix, intermediate representation or C of an element."""
    from mstmm.runtime.platform_support.safe_files import write_text
    from mstmm.scene.load import is_scene_file

    target = None if output is None else output_file(output, ())
    if beside:
        pages = {element: _comparison_page(element, format)}
    elif is_scene_file(element):
        pages = {element: _scene_page(element, at, format, keep or [])}
    elif keep:
        raise ElementError("--keep applies to scenes: mstmm show SCENE.toml --keep NAME")
    elif element == "sweep":
        pages = {element: _schedule_page(at, format)}
    else:
        pages = {view.name: _element_page(view, at, format) for view in _element_views(element, at)}
    text = "\n".join(pages.values())
    if target is not None:
        write_text(target, text)
    if json:
        written = None if target is None else str(target)
        print_json({"at": at, "format": format, "pages": pages, "file": written})
    elif target is None:
        write_stdout(text.rstrip("\n"))
    else:
        print_note(f"wrote {target}")


def _schedule_page(at: str, format: str) -> str:
    from mstmm.derive.show.schedule_page import sweep_page

    return sweep_page(at, format, stored_elements.generated_specs)


def _comparison_page(element: str, format: str) -> str:
    from mstmm.derive.show.show_page import render_page
    from mstmm.derive.show.subjects import classical_comparison

    return render_page(
        *classical_comparison("_".join(stored_elements.find_element(element))), format
    )


def _scene_page(file: str, at: str, format: str, keep: list[str]) -> str:
    from mstmm.pipeline.equations import equations

    if at != "equations":
        raise ElementError(
            f"a scene has no stage {at!r}, but its elements have it: mstmm show ELEMENT --at {at}"
        )
    page = equations(file, keep)
    return {"text": page.text, "latex": page.latex, "html": page.html}[format]


def _element_page(view: ElementView, at: str, format: str) -> str:
    from mstmm.derive.show.show_page import show_view

    return show_view(view, at, format)


def _element_views(element: str, at: str) -> list[ElementView]:
    """Views of a built-in element, of one in the kernel store, or of all in a file."""
    from mstmm.derive.show import subjects as views

    if element.endswith(".py"):
        from mstmm.derive.catalogue.registry import load_file
        from mstmm.derive.verification.definition_checks import check_element

        definitions = load_file(require_python_file(element))
        for definition in definitions:
            check_element(definition)
        return [views.view_of_element(definition) for definition in definitions]
    kind, name = stored_elements.find_element(element)
    full_name = f"{kind}_{name}"
    if name not in (entry.name for entry in stored_elements.builtin_entries(kind)):
        return [_view_from_store(kind, name, at)]
    kernels = stored_elements.generated_text(full_name, ".json")
    source = stored_elements.generated_text(full_name, ".c")
    if kernels is None or at not in ("ir", "c"):
        return [views.element_view(full_name)]
    if at == "c" and source is None:
        raise ElementError(
            f"{full_name} has no C: runs interpret its intermediate representation; "
            f"to show that: mstmm show {full_name} --at ir"
        )
    from mstmm.ir.element_spec import element_from_json

    # Without deriving them again.
    return [_view_from_spec(element_from_json(kernels), source or "")]


def _view_from_file(file: Path, kind: str, name: str) -> ElementView:
    """View of an element from the file from which it was generated."""
    from mstmm.derive.catalogue.registry import kind_of, load_file
    from mstmm.derive.show import subjects as views

    for element in load_file(file):
        if (kind_of(element), element.name) == (kind, name):
            return views.view_of_element(element)
    raise ElementError(f"{file}: it does not define {kind} {name!r}; generate it again")


def _view_from_store(kind: str, name: str, at: str) -> ElementView:
    """View of an element of the user's kernel store; its equations come from its file."""
    from mstmm.runtime.kernels import kernel_store

    full_name = f"{kind}_{name}"
    if at not in ("ir", "c"):
        return _view_from_file(kernel_store.definition_path((kind, name)), kind, name)
    path = kernel_store.folder() / full_name / f"{full_name}.c"
    return _view_from_spec(kernel_store.all_specs()[kind, name], path.read_text(encoding="utf-8"))


def _view_from_spec(spec: ElementSpec, source: str) -> ElementView:
    from mstmm.derive.show.document import ElementView
    from mstmm.derive.show.symbol_names import spec_names

    return ElementView(
        f"{spec.kind}_{spec.name}", spec.title, (), lambda: spec.kernels, lambda: source,
        spec.sources, spec_names(spec), spec.kind in ("hinge", "body", "force"),
    )  # fmt: skip
