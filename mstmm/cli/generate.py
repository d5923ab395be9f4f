"""`mstmm generate`: committed C of the package, or kernels of user elements."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated, Any

import typer

from mstmm.errors import EnvironmentFailure, MstmmError

from .options import Json, flag, require_python_file
from .terminal_output import print_error, print_json, print_lines, print_note

OUT_OF_DATE_CODE = 2

_CHECK_HELP = "Derive again and compare with the committed C; write nothing."
_INSTALLED_HELP = "Generate the elements provided by installed packages (mstmm list installed)."


def generate(
    files: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[FILE]...",
            help="Python files defining elements; without one, regenerate the package's C code.",
        ),
    ] = None,
    check: Annotated[bool, flag("--check", _CHECK_HELP)] = False,
    installed: Annotated[bool, flag("--installed", _INSTALLED_HELP)] = False,
    json: Json = False,
) -> None:
    """Derive, generate and compile user elements, or the generated/ folder of a checkout."""
    if files and check:
        raise MstmmError("--check compares the package's C; to check a file: mstmm check FILE")
    if installed and (files or check):
        raise MstmmError("--installed cannot be combined with files or --check")
    if files or installed:
        _generate_user_elements([require_python_file(file) for file in files or []], json)
    elif check:
        _compare_with_committed(json)
    else:
        _regenerate(json)


# --- user elements --------------------------------------------------------------------------------


def _generate_user_elements(files: list[str], json: bool) -> None:
    """Generate the elements of files, or without files those of installed packages."""
    import mstmm
    from mstmm.pipeline.compilation import generate_published

    generated: list[dict[str, Any]] = []
    for file in files or [""]:
        begin = time.perf_counter()
        elements = mstmm.generate_file(file) if file else generate_published()
        seconds = time.perf_counter() - begin
        for element in elements:
            spec = element.spec
            entry = {"file": file, "kind": spec.kind, "name": spec.name, "how": element.execution}
            generated.append({**entry, "folder": str(element.folder), "seconds": seconds})
            if not json:
                print_lines(
                    f"{spec.kind} {spec.name}: {element.execution}; in {element.folder} "
                    f"({seconds:.1f} s)"
                )
    if json:
        print_json({"generated": generated})
    elif generated:
        print_lines("Use its name as a type in scenes.")
    else:
        print_lines("No installed package provides elements.")


# --- elements of the package ----------------------------------------------------------------------


def _generated_folder() -> Path:
    import mstmm.generated

    return Path(mstmm.generated.__file__ or "").resolve().parent


def _checkout_folder() -> Path:
    """Folder generated/ of the checkout that contains this program."""
    folder = _generated_folder()
    if not (folder.parent / "pyproject.toml").is_file():
        raise EnvironmentFailure(
            "mstmm is installed without its checkout, so there is no generated/ to write; run this "
            "from a clone with pip install -e ., or give a Python file: mstmm generate FILE"
        )
    return folder


def _regenerate(json: bool) -> None:
    from mstmm.derive.catalogue.element_specs import regenerate

    folder = _checkout_folder()
    print_note("deriving every element; this takes a while")
    written = [path.name for path in regenerate(folder)]
    if json:
        print_json({"folder": str(folder), "files": written})
    else:
        print_lines(f"{len(written)} files in {folder}")
        print_lines("Compile them: python setup.py -q build_ext --inplace")


def _compare_with_committed(json: bool) -> None:
    from mstmm.derive.catalogue.element_specs import differences

    folder = _generated_folder()
    if not json:
        print_note("deriving every element; this takes a while")
    different_files = differences(folder)
    if json:
        print_json(
            {"ok": not different_files, "folder": str(folder), "differences": different_files}
        )
    if not different_files:
        if not json:
            print_lines(f"{folder} is identical to the result of the derivations")
        return
    if not json:
        print_lines("\n".join(different_files))
    print_error(
        f"{len(different_files)} files of {folder} differ from the result of the derivations; "
        "update them: mstmm generate, and commit generated/"
    )
    raise typer.Exit(OUT_OF_DATE_CODE)
