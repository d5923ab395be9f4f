"""`mstmm generate`: committed C of the package, or kernels of user elements."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated, Any

import typer

from mstmm.errors import EnvironmentFailure, MstmmError

from .options import Json, python_file

OUT_OF_DATE = 2


def generate(
    files: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[FILE]...",
            help="Python files defining elements; without one, regenerate the package's C code.",
        ),
    ] = None,
    check: Annotated[
        bool,
        typer.Option(
            "--check", help="Derive again and compare with the committed C; write nothing."
        ),
    ] = False,
    installed: Annotated[
        bool,
        typer.Option(
            "--installed",
            help="Generate the elements provided by installed packages (mstmm list installed).",
        ),
    ] = False,
    json: Json = False,
) -> None:
    """Derive, generate and compile user elements, or the generated/ folder of a checkout."""
    if files and check:
        raise MstmmError("--check compares the package's C; to check a file: mstmm check FILE")
    if installed and (files or check):
        raise MstmmError("--installed cannot be combined with files or --check")
    if files or installed:
        _own([python_file(file) for file in files or []], json)
    elif check:
        _compare(json)
    else:
        _regenerate(json)


# --- user elements --------------------------------------------------------------------------------


def _own(files: list[str], json: bool) -> None:
    """Generate the elements of files, or without files those of installed packages."""
    import mstmm
    from mstmm.bridge.compilation import generate_published

    from .output import emit_json, say

    made: list[dict[str, Any]] = []
    for file in files or [""]:
        begin = time.perf_counter()
        elements = mstmm.generate_file(file) if file else generate_published()
        seconds = time.perf_counter() - begin
        for each in elements:
            spec = each.spec
            entry = {"file": file, "kind": spec.kind, "name": spec.name, "how": each.how}
            made.append({**entry, "folder": str(each.folder), "seconds": seconds})
            if not json:
                say(f"{spec.kind} {spec.name}: {each.how}; in {each.folder} ({seconds:.1f} s)")
    if json:
        emit_json({"generated": made})
    elif made:
        say("Use its name as a type in scenes.")
    else:
        say("No installed package provides elements.")


# --- elements of the package ----------------------------------------------------------------------


def _folder() -> Path:
    import mstmm.generated

    return Path(mstmm.generated.__file__ or "").resolve().parent


def _checkout() -> Path:
    """Folder generated/ of the checkout that contains this program."""
    folder = _folder()
    if not (folder.parent / "pyproject.toml").is_file():
        raise EnvironmentFailure(
            "mstmm is installed without its checkout, so there is no generated/ to write; run this "
            "from a clone with pip install -e ., or give a Python file: mstmm generate FILE"
        )
    return folder


def _regenerate(json: bool) -> None:
    from mstmm.derive.catalogue.generate import regenerate

    from .output import emit_json, note, say

    folder = _checkout()
    note("deriving every element; this takes a while")
    written = [path.name for path in regenerate(folder)]
    if json:
        emit_json({"folder": str(folder), "files": written})
    else:
        say(f"{len(written)} files in {folder}")
        say("Compile them: python setup.py -q build_ext --inplace")


def _compare(json: bool) -> None:
    from mstmm.derive.catalogue.generate import differences

    from .output import complain, emit_json, note, say

    folder = _folder()
    if not json:
        note("deriving every element; this takes a while")
    found = differences(folder)
    if json:
        emit_json({"ok": not found, "folder": str(folder), "differences": found})
    if not found:
        if not json:
            say(f"{folder} is identical to the result of the derivations")
        return
    if not json:
        say("\n".join(found))
    complain(
        f"{len(found)} files of {folder} differ from the result of the derivations; "
        "update them: mstmm generate, and commit generated/"
    )
    raise typer.Exit(OUT_OF_DATE)
