"""`mstmm cache`: list, verify or delete compiled libraries."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from .explain import ENVIRONMENT
from .options import Json, not_negative, quoted

if TYPE_CHECKING:
    from mstmm.runtime.libraries.upkeep import Listed

ACTIONS = ("list", "verify", "clean")

_DAY = 86400.0


def cache(
    action: Annotated[
        str,
        typer.Argument(
            metavar="[list|verify|clean]",
            help="list the libraries; verify their checksums; clean: delete them.",
        ),
    ] = "list",
    unused: Annotated[
        float,
        typer.Option(
            "--unused",
            metavar="DAYS",
            parser=not_negative,
            help="clean: delete only entries unused for this many days.",
        ),
    ] = 0.0,
    json: Json = False,
) -> None:
    """List, verify or delete compiled scene libraries."""
    if action not in ACTIONS:
        raise typer.BadParameter(f"{quoted(action)}: expected {', '.join(ACTIONS)}")
    if unused and action != "clean":
        raise typer.BadParameter("--unused requires clean")
    from mstmm.runtime.libraries.folder import private_folder

    folder = private_folder()
    if action == "clean":
        _clean(folder, unused, json)
    else:
        _list(folder, json, verify=action == "verify")


def _list(folder: Path, json: bool, verify: bool) -> None:
    from mstmm.runtime.libraries.folder import limit
    from mstmm.runtime.libraries.upkeep import listed, unfinished

    from . import output

    entries, cut_off = listed(folder), unfinished(folder)
    damaged = [entry for entry in entries if entry.problem]
    size = sum(entry.bytes for entry in entries)
    if json:
        output.emit_json({
            "ok": not damaged, "folder": str(folder), "bytes": size, "limit": limit(),
            "unfinished": cut_off, "entries": [_plain(entry) for entry in entries],
        })  # fmt: skip
    else:
        if not verify and entries:
            columns = ("library", "kB>", "last used", "compiled in s>", "compiler", "state")
            output.console().print(output.table("", columns, map(_row, entries)))
        _sum_up(folder, entries, size, limit(), cut_off)
        for entry in damaged:
            output.complain(
                f"{entry.folder.name} is corrupt: {entry.problem}; it is rebuilt when used; "
                "mstmm cache clean deletes it"
            )
    if verify and damaged:
        raise typer.Exit(ENVIRONMENT)


def _sum_up(folder: Path, entries: list[Listed], size: int, limit: int, cut_off: int) -> None:
    from . import output
    from .summary import count

    whole = sum(1 for entry in entries if not entry.problem)
    output.say(
        f"{folder}: {count(len(entries), 'library', 'libraries')}, {whole} intact; "
        f"{size / 1e6:.1f} of {limit / 1e6:.0f} MB"
    )
    if cut_off:
        output.say(f"{count(cut_off, 'build', 'builds')} in progress or interrupted")


def _clean(folder: Path, unused: float, json: bool) -> None:
    from mstmm.runtime.libraries.upkeep import clean

    from . import output
    from .summary import count

    removed, size = clean(folder, unused * _DAY)
    if json:
        output.emit_json({"ok": True, "folder": str(folder), "removed": removed, "bytes": size})
    else:
        output.say(
            f"{folder}: deleted {count(removed, 'library', 'libraries')}, {size / 1e6:.1f} MB"
        )


def _row(entry: Listed) -> tuple[str, ...]:
    when = time.strftime("%Y-%m-%d %H:%M", time.localtime(entry.used))
    return (
        entry.folder.name, f"{entry.bytes / 1e3:.0f}", when, str(entry.about.get("seconds", "")),
        str(entry.about.get("compiler_version", "")), entry.problem or "intact",
    )  # fmt: skip


def _plain(entry: Listed) -> dict[str, Any]:
    return {
        "name": entry.folder.name, "bytes": entry.bytes, "last_used": entry.used,
        "problem": entry.problem, **entry.about,
    }  # fmt: skip
