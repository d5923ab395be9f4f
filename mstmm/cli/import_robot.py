"""`mstmm import`: conversion of a robot file to a scene."""

from __future__ import annotations

import shutil
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mstmm.display import abbreviate_names

from .options import Json, new_file, parse_positive

if TYPE_CHECKING:
    from mstmm.scene.robots.robot_model import ImportNote
    from mstmm.scene.robots.scene_from_robot import ImportedRobot

#: Largest number of elements named in one note.
_MAX_NAMED = 4


def import_robot(
    robot: Annotated[
        str, typer.Argument(metavar="ROBOT", help="Robot file: .urdf, or MJCF (.xml, .mjcf).")
    ],
    output: Annotated[
        str | None,
        typer.Option(
            "--output",
            "-o",
            metavar="FILE",
            help="Scene file, .toml; default: robot name, current folder.",
        ),
    ] = None,
    base: Annotated[
        str,
        typer.Option(
            "--base",
            metavar="fixed|free",
            help="Attach the base to the ground (fixed) or leave it free.",
        ),
    ] = "fixed",
    keep_fixed: Annotated[
        bool, typer.Option("--keep-fixed", help="Keep links on fixed joints as separate bodies.")
    ] = False,
    stops: Annotated[
        float | None,
        typer.Option(
            "--stops",
            metavar="STIFFNESS",
            parser=parse_positive,
            help="Convert joint limits to stops of this stiffness (N m/rad or N/m).",
        ),
    ] = None,
    hold_mimics: Annotated[
        bool,
        typer.Option(
            "--hold-mimics",
            help="Lock mimic joints at their initial values instead of coupling them.",
        ),
    ] = False,
    length: Annotated[
        str,
        typer.Option("--length", metavar="UNIT", help="Length unit of the file: m, cm, mm or in."),
    ] = "m",
    mass: Annotated[
        str, typer.Option("--mass", metavar="UNIT", help="Mass unit of the file: kg, g, t or lb.")
    ] = "kg",
    json: Json = False,
) -> None:
    """Convert a robot (URDF, MJCF) to a scene, and list what could not be converted."""
    import mstmm
    from mstmm.runtime.platform_support.safe_files import write_text

    from .terminal_output import print_json, print_lines

    target = new_file(output, robot, ".toml")
    imported = mstmm.import_robot(
        robot, base=base, merge=not keep_fixed, stops=stops,
        mimics="held" if hold_mimics else "coupled",
        units={"length": length, "mass": mass},
    )  # fmt: skip
    imported = _with_copied_meshes(imported, target)
    write_text(target, imported.to_toml())
    if json:
        notes = [{"where": n.where, "element": n.element, "text": n.text} for n in imported.notes]
        print_json({"scene": str(target), "names": dict(imported.names), "notes": notes})
        return
    for line in grouped_notes(imported.notes, robot):
        print_lines(line)
    print_lines(f"{target}: {imported.scene.summary}")


def _with_copied_meshes(found: ImportedRobot, target: Path) -> ImportedRobot:
    """Copy meshes from elsewhere to a folder next to the scene file, and refer to the copies.

    A scene file may refer only to files in its folder or below.
    """
    from mstmm.runtime.platform_support.safe_files import replace_atomically

    scene_folder, shapes = target.parent.resolve(), []
    folder = scene_folder / f"{target.stem}_meshes"
    copies = dict[Path, Path]()
    for shape in found.tables.get("shape", ()):
        if "file" in shape:
            mesh = Path(shape["file"]).resolve()
            if not mesh.is_relative_to(scene_folder):
                folder.mkdir(exist_ok=True)
                name = f"{len(copies)}_{mesh.name}"
                if mesh not in copies:
                    copies[mesh] = folder / name
                    with replace_atomically(folder / name) as temporary:
                        shutil.copyfile(mesh, temporary)
                mesh = copies[mesh]
            shape = shape | {"file": str(mesh.relative_to(scene_folder))}
        shapes.append(shape)
    return replace(found, tables={**found.tables, "shape": shapes})


def grouped_notes(notes: Iterable[ImportNote], file: str) -> list[str]:
    """One line for each text of notes, with its elements and their positions in `file`."""
    elements_by_text = defaultdict[str, list[str]](list)
    for note in notes:
        position = note.where.removeprefix(file).removeprefix(": ")
        elements_by_text[note.text].append(
            f"{note.element} ({position})" if position else note.element
        )
    return [
        f"{abbreviate_names(elements, _MAX_NAMED)}: {text}"
        for text, elements in elements_by_text.items()
    ]
