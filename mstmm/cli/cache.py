"""`mstmm cache`: list, verify or delete compiled libraries."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from .error_boundary import ENVIRONMENT
from .options import Json, option, parse_not_negative, quote
from .run_summary import count_text
from .terminal_output import build_table, print_error, print_json, print_lines, table_console

if TYPE_CHECKING:
    from mstmm.runtime.libraries.cache import ListedEntry

ACTIONS = ("list", "verify", "clean")

_DAY = 86400.0

_UNUSED_HELP = "clean: delete only entries unused for this many days."


def cache(
    action: Annotated[
        str,
        typer.Argument(
            metavar="[list|verify|clean]",
            help="list the libraries; verify their checksums; clean: delete them.",
        ),
    ] = "list",
    unused: Annotated[float, option("--unused", "DAYS", _UNUSED_HELP, parse_not_negative)] = 0.0,
    json: Json = False,
) -> None:
    """List, verify or delete compiled scene libraries."""
    if action not in ACTIONS:
        raise typer.BadParameter(f"{quote(action)}: expected {', '.join(ACTIONS)}")
    if unused and action != "clean":
        raise typer.BadParameter("--unused requires clean")
    from mstmm.runtime.libraries.cache_files import private_folder

    folder = private_folder()
    if action == "clean":
        _delete_entries(folder, unused, json)
    else:
        _list_entries(folder, json, verify=action == "verify")


def _list_entries(folder: Path, json: bool, verify: bool) -> None:
    from mstmm.runtime.libraries.cache import count_unfinished_builds, list_entries
    from mstmm.runtime.libraries.cache_files import size_limit

    entries, unfinished_count = list_entries(folder), count_unfinished_builds(folder)
    damaged = [entry for entry in entries if entry.problem]
    size = sum(entry.bytes for entry in entries)
    if json:
        print_json({
            "ok": not damaged, "folder": str(folder), "bytes": size, "limit": size_limit(),
            "unfinished": unfinished_count,
            "entries": [
                {"name": entry.folder.name, "bytes": entry.bytes, "last_used": entry.used,
                 "problem": entry.problem, **entry.about}
                for entry in entries
            ],
        })  # fmt: skip
    else:
        if not verify and entries:
            columns = ("library", "kB>", "last used", "compiled in s>", "compiler", "state")
            table_console().print(build_table("", columns, map(_entry_row, entries)))
        intact = sum(not entry.problem for entry in entries)
        print_lines(
            f"{folder}: {count_text(len(entries), 'library', 'libraries')}, {intact} intact; "
            f"{size / 1e6:.1f} of {size_limit() / 1e6:.0f} MB"
        )
        if unfinished_count:
            builds = count_text(unfinished_count, "build", "builds")
            print_lines(f"{builds} in progress or interrupted")
        for entry in damaged:
            print_error(
                f"{entry.folder.name} is corrupt: {entry.problem}; it is rebuilt when used; "
                "mstmm cache clean deletes it"
            )
    if verify and damaged:
        raise typer.Exit(ENVIRONMENT)


def _delete_entries(folder: Path, unused: float, json: bool) -> None:
    from mstmm.runtime.libraries.cache import clean_cache

    removed, size = clean_cache(folder, unused * _DAY)
    if json:
        print_json({"ok": True, "folder": str(folder), "removed": removed, "bytes": size})
    else:
        print_lines(
            f"{folder}: deleted {count_text(removed, 'library', 'libraries')}, {size / 1e6:.1f} MB"
        )


def _entry_row(entry: ListedEntry) -> tuple[str, ...]:
    last_used = time.strftime("%Y-%m-%d %H:%M", time.localtime(entry.used))
    return (
        entry.folder.name,
        f"{entry.bytes / 1e3:.0f}",
        last_used,
        str(entry.about.get("seconds", "")),
        str(entry.about.get("compiler_version", "")),
        entry.problem or "intact",
    )
